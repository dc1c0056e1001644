#!/bin/sh
# Hook: a siren or a traffic light on a relay, switched by writing 1 or 0 to a file of the kernel.
#   run = ["/etc/slipwatch/hooks/relay.sh", "/sys/class/leds/relay1/brightness"]
#   levels = ["red"]
#   site = true
#   writable = ["/sys/class/leds/relay1"]
# Switched on by a red that begins, off only when the red of the whole site ends (site = true): while one benchmark is red the end
# of another's red changes nothing. Another level, an unknown or a drill (a status other than Actual) changes nothing either. With --drills
# after the file drills switch it too. Without site = true it is switched on by each benchmark's red, and off only with --one-benchmark, for
# a site that has no other; else the end is refused, and stands in the daemon's log. The file must be writable for the daemon's user.
# The packaged unit may not write there. `systemctl edit slipwatch`: [Service], ProtectKernelTunables=no, ReadWritePaths=/sys/class/leds/relay1.
# `slipwatch hook test` runs outside the unit and does not show whether that is right; a [drill] with this hook does.
set -eu
if [ $# -lt 1 ]; then
    echo "relay.sh: name the file of the relay" >&2
    exit 2
fi
file=$1
shift
drills= one=
for flag in "$@"; do
    case "$flag" in
    --drills) drills=yes ;;
    --one-benchmark) one=yes ;;
    *)
        echo "relay.sh: $flag: expected --drills or --one-benchmark" >&2
        exit 2
        ;;
    esac
done
cat >/dev/null
if [ "$SLIPWATCH_STATUS" != Actual ] && [ -z "$drills" ]; then
    exit 0
fi
case "$SLIPWATCH_LEVEL/$SLIPWATCH_STATE" in
red/firing) echo 1 >"$file" ;;
red/resolved)
    if [ "${SLIPWATCH_COUNT:-1}" -gt 1 ]; then
        echo "relay.sh: the red of $SLIPWATCH_COUNT benchmarks has ended, others may be in force: set site = true" >&2
        exit 1
    fi
    if [ -n "${SLIPWATCH_BENCHMARK:-}" ] && [ -z "$one" ]; then
        echo "relay.sh: the red of benchmark $SLIPWATCH_BENCHMARK has ended, others may be in force: set site = true" >&2
        exit 1
    fi
    echo 0 >"$file"
    ;;
esac
