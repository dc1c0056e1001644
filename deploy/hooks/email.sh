#!/bin/sh
# Hook: an e-mail through the machine's own sendmail.
#   run = ["/etc/slipwatch/hooks/email.sh", "duty@example.org", "office@example.org"]
# The alert's JSON is attached to the text, so that whoever gets it has every figure. A mailer that needs its setgid bit (Postfix,
# Exim) also needs sandbox = false. Another mailer, which takes -t -i: ["/etc/slipwatch/hooks/email.sh", "--mailer", "/usr/bin/msmtp",
# "duty@example.org"]. Exits as the mailer does, so that the daemon tries again where it fails.
set -eu
mailer=${SENDMAIL:-/usr/sbin/sendmail}
if [ "${1:-}" = --mailer ] && [ $# -ge 2 ]; then
    mailer=$2
    shift 2
fi
if [ $# -eq 0 ]; then
    echo "email.sh: name at least one address" >&2
    exit 2
fi
recipients=$(printf '%s, ' "$@")
# One line, whatever a benchmark is called.
plain() { printf '%s' "$1" | tr -d '\000-\037\177'; }
place=$(plain "${SLIPWATCH_BENCHMARK:-(site)}")
# One message may stand for many benchmarks.
if [ "${SLIPWATCH_COUNT:-1}" -gt 1 ]; then
    place="$SLIPWATCH_COUNT benchmarks"
fi
# What is unknown ends no level.
if [ -n "${SLIPWATCH_IN_FORCE:-}" ]; then
    place="$place, $SLIPWATCH_IN_FORCE stays in force"
fi
site=$(plain "$SLIPWATCH_SITE")
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
{
    printf 'To: %s\n' "${recipients%, }"
    printf 'Subject: %s\n' "$(encoded "[$SLIPWATCH_STATUS] $site: $SLIPWATCH_LEVEL $state at $place")"
    printf 'MIME-Version: 1.0\nContent-Type: text/plain; charset=utf-8\nContent-Transfer-Encoding: 8bit\n'
    # The same at each attempt: a mail program shows a repetition as what it is.
    printf 'X-Slipwatch-Key: %s\n\n' "$(encoded "$(plain "$SLIPWATCH_KEY")")"
    printf '%s: %s %s at %s, %s\n' "$site" "$SLIPWATCH_LEVEL" "$state" "$place" "$(at_the_site "$SLIPWATCH_TIME")"
    if [ -n "${SLIPWATCH_RECOMMENDED:-}" ]; then
        printf '\nWhat to do: %s\n' "$(plain "$SLIPWATCH_RECOMMENDED")"
    fi
    case $SLIPWATCH_LEVEL/$SLIPWATCH_STATE in
    red/resolved | orange/resolved)
        printf '\nThis is no all-clear: somebody has to look at the slope before anyone goes back.\n' ;;
    esac
    # With its times by the clocks at the site.
    text=${SLIPWATCH_TEXT_LOCAL:-${SLIPWATCH_TEXT:-}}
    if [ -n "$text" ]; then
        printf '\n%s.\n\n' "$(plain "$text")"
    fi
    if [ -n "${SLIPWATCH_FAILURE_TIME:-}" ] && [ "$SLIPWATCH_STATE" = firing ]; then
        printf 'Collapse forecast (median): %s. It is put on the early side: the chance of a collapse before it may be under one half, and it may come earlier or later\n' "$(at_the_site "$SLIPWATCH_FAILURE_TIME")"
    fi
    if [ -n "${SLIPWATCH_ACKNOWLEDGE_URL:-}" ]; then
        printf 'To acknowledge (the link works once): %s\n' "$(plain "$SLIPWATCH_ACKNOWLEDGE_URL")"
    fi
    printf 'Attempt %s, key %s. All figures:\n\n' "$SLIPWATCH_ATTEMPT" "$(plain "$SLIPWATCH_KEY")"
    # A mailer may refuse a line of more than 998 octets (RFC 5322): Exim bounces it after it has taken the message.
    sed 's/,"/,\n"/g'
} | fold -b -s -w 900 | "$mailer" -t -i
