#!/bin/sh
# Hook: a siren or a traffic light on a relay, switched by writing 1 or 0 to a file of the kernel.
#   run = ["/etc/slipwatch/hooks/relay.sh", "/sys/class/leds/relay1/brightness"]
#   levels = ["red"]
#   writable = ["/sys/class/leds/relay1"]
# Switched on by a red that begins, off only when a red ends: another level, an unknown or a drill (a status other than Actual)
# changes nothing. With --drills as second argument drills switch it too. The file must be writable for the daemon's user.
set -eu
if [ $# -lt 1 ]; then
    echo "relay.sh: name the file of the relay" >&2
    exit 2
fi
cat >/dev/null
if [ "$SLIPWATCH_STATUS" != Actual ] && [ "${2:-}" != --drills ]; then
    exit 0
fi
case "$SLIPWATCH_LEVEL/$SLIPWATCH_STATE" in
red/firing) echo 1 >"$1" ;;
red/resolved) echo 0 >"$1" ;;
esac
