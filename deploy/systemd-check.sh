#!/usr/bin/env bash
# Boots a real systemd in a container over a copy-on-write view of this machine, installs a build there as the package
# does, and tries the unit: readiness, an alert through a hook, kill -9, a hang, reload, a wrong config, the weekly
# report, and the end. Needs root and systemd-nspawn (Debian: systemd-container); says "skipped" where it cannot run.
#     deploy/systemd-check.sh target/release/slipwatch
set -euo pipefail
binary=$(realpath "${1:?the program to try, such as target/release/slipwatch}")
deploy=$(dirname "$(realpath "$0")")

skip() {
    echo "skipped: the unit under systemd ($1)" >&2
    exit 0
}
fail() {
    echo "failed: $1" >&2
    { inside journalctl -u slipwatch --no-pager -o cat | tail -30; } >&2 || true
    exit 1
}
[ "$(id -u)" = 0 ] || skip "not root"
command -v systemd-nspawn >/dev/null || skip "systemd-nspawn is not installed"

folder=$(mktemp -d)
root=$folder/all/root
container=
init=
end() {
    # With its first process all others of the container end.
    [ -z "$init" ] || kill -KILL "$init" 2>/dev/null || true
    [ -z "$container" ] || kill -KILL "$container" 2>/dev/null || true
    wait 2>/dev/null || true
    umount "$root" 2>/dev/null || true
    umount "$folder/all" 2>/dev/null || true
    rm -rf "$folder"
}
trap end EXIT
mkdir "$folder/all"
mount -t tmpfs tmpfs "$folder/all" || skip "no mounts here"
mkdir "$root" "$folder/all/upper" "$folder/all/work"
mount -t overlay overlay -o "lowerdir=/,upperdir=$folder/all/upper,workdir=$folder/all/work" "$root" ||
    skip "no overlay file system here"

# What deploy/package.sh installs, and a site whose hook says what it got in the journal.
units=$root/etc/systemd/system
install -m 755 "$binary" "$root/usr/bin/slipwatch"
install -m 755 -D "$deploy/notify.sh" "$root/etc/slipwatch/notify.sh"
install -m 644 "$deploy/debian/site.toml" "$root/etc/slipwatch/site.toml"
install -m 644 "$deploy"/slipwatch*.service "$deploy"/slipwatch*.timer "$units"
mkdir -p "$root/srv/slipwatch/incoming" "$units/multi-user.target.wants" "$units/slipwatch.service.d"
ln -sf ../slipwatch.service "$units/multi-user.target.wants/slipwatch.service"
# A hang is noticed after two minutes; here nobody waits so long.
printf '[Service]\nWatchdogSec=5\nTimeoutAbortSec=1\nRestartSec=1\n' >"$units/slipwatch.service.d/short.conf"
rm -f "$root/etc/machine-id"
# What else this machine runs has no business in there; and no network will come.
for unit in postgresql mosquitto systemd-networkd-wait-online; do
    ln -sf /dev/null "$units/$unit.service"
done

# A network of its own: the port may be in use here.
systemd-nspawn --quiet --directory "$root" --boot --private-network --register=no --keep-unit </dev/null >"$folder/console" 2>&1 &
container=$!
inside() { nsenter --target "$init" --all -- "$@"; }
# Whether it comes true within a minute.
soon() {
    for _ in $(seq 120); do
        if "$@" >/dev/null 2>&1; then return 0; fi
        sleep .5
    done
    return 1
}
# The container's program has one child that stays: the systemd inside.
is_booted() {
    init=$(pgrep --parent "$container" | tail -1) && inside systemctl list-units
}
soon is_booted || skip "systemd does not start in a container here: $(tail -1 "$folder/console")"

property() { inside systemctl show slipwatch --property "$1" --value; }
is_active() { [ "$(property ActiveState)" = active ] && [ "$(property StatusText)" = watching ]; }
logged() { inside journalctl -u slipwatch --no-pager -o cat | grep -q -- "$1"; }
soon is_active || fail "the unit is not active and watching"
echo "ok: active, and says that it is watching"

# Hourly, v = 300 mm / (time to failure), from 300 h to 6 h before the failure; the last 20 rows come live.
readings() {
    awk -v now="$(date -u +%s)" 'BEGIN {
        print "time,P1_displacement_mm"
        for (i = 0; i < 300; i++)
            printf "%s,%.3f\n", strftime("%Y-%m-%dT%H:%M:%SZ", now - (299 - i) * 3600, 1), -300 * log((306 - i) / 306)
    }'
}
readings >"$folder/all/readings.csv"
head -281 "$folder/all/readings.csv" >"$root/srv/slipwatch/incoming/p1.csv"
site=/etc/slipwatch/site.toml
has_past() { inside slipwatch status --config $site --format json | grep -q '"P1"'; }
soon has_past || fail "the readings were not taken"
tail -20 "$folder/all/readings.csv" >>"$root/srv/slipwatch/incoming/p1.csv"
delivered() { inside slipwatch alerts list --config $site --format json; }
is_red() { delivered | grep -q '"red"'; }
soon is_red || fail "no red"
soon logged 'red called at benchmark P1' || fail "the hook has not said red"
echo "ok: a red from a growing file, through the hook"

# What the hook was given by now, by its key; a restart gives none of it again.
given() { inside journalctl -u slipwatch --no-pager -o cat | grep -c 'called at benchmark' || true; }
sleep 2
before=$(given)
restarts=$(property NRestarts)
is_again() { [ "$(property NRestarts)" -gt "$restarts" ] && is_active; }
inside systemctl kill --signal KILL --kill-who main slipwatch
soon is_again || fail "not started again after kill -9"
is_red || fail "after kill -9 the red is not in force"
sleep 2
[ "$(given)" = "$before" ] || fail "after kill -9 the hook was given an alert again: $before, then $(given)"
echo "ok: killed, started again by systemd, red as before and not notified of twice"

restarts=$(property NRestarts)
inside systemctl kill --signal STOP --kill-who main slipwatch
soon is_again || fail "a daemon that hangs was not started again"
soon logged 'Watchdog timeout' || fail "not by the watchdog"
echo "ok: a daemon that hangs is ended by the watchdog and started again"

process=$(property MainPID)
printf '[site]\nname = 7\n' >"$folder/all/wrong.toml"
cp "$root$site" "$folder/all/right.toml"
cp "$folder/all/wrong.toml" "$root$site"
if inside systemctl reload slipwatch 2>/dev/null; then fail "a wrong config was reloaded"; fi
if [ "$(property MainPID)" != "$process" ] || ! is_active; then fail "a wrong config ended the daemon"; fi
sed 's/Unnamed slope/Named slope/' "$folder/all/right.toml" >"$root$site"
inside systemctl reload slipwatch || fail "a right config was not reloaded"
soon logged 'Named slope' || fail "a right config does not hold after a reload"
[ "$(property MainPID)" = "$process" ] || fail "a reload started another daemon"
echo "ok: a wrong config is refused by reload and the daemon goes on; a right one holds without a restart"

inside systemctl start slipwatch-report || fail "no weekly report"
inside sh -c 'ls /var/lib/slipwatch/reports/*.html' >/dev/null || fail "the weekly report wrote no page"
echo "ok: the weekly report"

began=$(date +%s)
inside systemctl stop slipwatch || fail "it does not stop"
[ "$(property Result)" = success ] || fail "stopped with $(property Result)"
[ $(($(date +%s) - began)) -le 30 ] || fail "it took over 30 s to stop"
echo "ok: stopped"

cp "$folder/all/wrong.toml" "$root$site"
if inside systemctl start slipwatch 2>/dev/null; then fail "started with a wrong config"; fi
logged "site.name is of type integer" || fail "the journal does not say what is wrong in the config"
cp "$folder/all/right.toml" "$root$site"
soon is_active || fail "not started once the config is right"
is_red || fail "after the stop the red is not in force"
echo "ok: not started with a wrong config; back by itself once it is right, and red as before"
