#!/bin/sh
# Sample hook: one line for a person, from the environment; the alert itself is JSON on stdin.
# Replace the echo with whatever reaches people. Exit 0 only once the message is on its way:
# any other exit makes the daemon try again, with the same SLIPWATCH_KEY.
# With a file's name as argument the line is appended there.
set -eu
cat >/dev/null  # a hook may leave stdin unread; a real one reads the JSON here
case $SLIPWATCH_STATE in
firing) state=called ;;
resolved) state=ended ;;
*) state=corrected ;;
esac
forecast=
if [ "$SLIPWATCH_STATE" = firing ]; then
    forecast=${SLIPWATCH_FAILURE_TIME:+, collapse forecast (median, on the early side) $SLIPWATCH_FAILURE_TIME}
fi
line="[$SLIPWATCH_STATUS] $SLIPWATCH_SITE: $SLIPWATCH_LEVEL $state at benchmark ${SLIPWATCH_BENCHMARK:-(site)}, $SLIPWATCH_TIME$forecast${SLIPWATCH_RECOMMENDED:+. $SLIPWATCH_RECOMMENDED}${SLIPWATCH_TEXT:+ $SLIPWATCH_TEXT}"
if [ $# -gt 0 ]; then
    echo "$line" >>"$1"
else
    echo "$line"
fi
