#!/bin/sh
# Hook: a push message to telephones over ntfy (https://ntfy.sh, or a server of one's own), with curl.
#   run = ["/etc/slipwatch/hooks/ntfy.sh", "https://ntfy.example.org/monte-toc"]
# A topic on a public server can be read by whoever knows its name. An access token stands in a file beside this one, ntfy.token.
set -eu
if [ $# -ne 1 ]; then
    echo "ntfy.sh: name the address of the topic" >&2
    exit 2
fi
cat >/dev/null
# What is unknown ends no red that is in force beside it.
case "$SLIPWATCH_LEVEL/$SLIPWATCH_STATE/${SLIPWATCH_IN_FORCE:-}" in
red/firing/* | unknown/firing/red) priority=5 ;;
orange/firing/* | unknown/firing/*) priority=4 ;;
*) priority=3 ;;
esac
# One line, whatever a benchmark is called.
plain() { printf '%s' "$1" | tr -d '\000-\037\177'; }
place=$(plain "${SLIPWATCH_BENCHMARK:-(site)}")
# One message may stand for many benchmarks.
if [ "${SLIPWATCH_COUNT:-1}" -gt 1 ]; then
    place="$SLIPWATCH_COUNT benchmarks"
fi
case $SLIPWATCH_STATE in
firing) state=called ;;
resolved) state=ended ;;
*) state=corrected ;;
esac
# 2017-06-06 19:00 CEST of 2017-06-06T17:00:00Z, by the clocks at the site.
# Where this machine does not know the zone, in UTC.
zone=${SLIPWATCH_TIME_ZONE:-UTC}
[ -e "/usr/share/zoneinfo/$zone" ] || zone=UTC
at_the_site() { TZ=$zone date -d "$1" '+%Y-%m-%d %H:%M %Z' 2>/dev/null || printf '%s' "$1"; }
# A header holds ASCII alone (RFC 2047).
encoded() {
    case $1 in
    *[!\ -~]*) printf '=?UTF-8?B?%s?=' "$(printf '%s' "$1" | base64 | tr -d '\n')" ;;
    *) printf '%s' "$1" ;;
    esac
}
# A locked telephone shows the title and the first words.
level=$(printf '%s' "$SLIPWATCH_LEVEL" | tr '[:lower:]' '[:upper:]')
case $SLIPWATCH_STATUS in
Actual) mark= ;;
*) mark="$(printf '%s' "$SLIPWATCH_STATUS" | tr '[:lower:]' '[:upper:]'): " ;;
esac
title="$mark$level $state: $(plain "$SLIPWATCH_SITE"), $place${SLIPWATCH_IN_FORCE:+, $SLIPWATCH_IN_FORCE stays in force}"
case $SLIPWATCH_LEVEL/$SLIPWATCH_STATE in
*/firing) todo=${SLIPWATCH_RECOMMENDED:-} ;;
red/resolved | orange/resolved) todo='This is no all-clear: somebody has to look at the slope before anyone goes back.' ;;
*) todo= ;;
esac
said=${SLIPWATCH_TEXT_LOCAL:-${SLIPWATCH_TEXT:-}}
forecast=
if [ -n "${SLIPWATCH_FAILURE_TIME:-}" ] && [ "$SLIPWATCH_STATE" = firing ]; then
    forecast="; collapse forecast (median, on the early side) $(at_the_site "$SLIPWATCH_FAILURE_TIME")"
fi
text="${todo:+$todo }At $(at_the_site "$SLIPWATCH_TIME")$forecast${said:+; $said}"
token_file="$(dirname "$0")/ntfy.token"
if [ -r "$token_file" ]; then
    # Over standard input: the command line can be read by everyone on the machine.
    printf 'header = "Authorization: Bearer %s"\n' "$(tr -d '\r\n' <"$token_file")"
fi | curl --config - --fail --silent --show-error --max-time 8 --output /dev/null \
    --header "Title: $(encoded "$title")" --header "Priority: $priority" --header "Tags: slipwatch,$SLIPWATCH_LEVEL" \
    --data-raw "$text" "$1"
