#!/usr/bin/env python3
"""Hook: a text message by a modem's AT commands.

    run = ["/etc/slipwatch/hooks/sms.py", "/dev/ttyUSB0", "+390123456789"]
    writable = ["/dev/ttyUSB0"]
    timeout = "60s"

Needs Python's standard library alone. The daemon's user must be in the modem's group (dialout). One message to each
number; exits 1 where the modem refuses one or does not answer, and the daemon tries again. Several benchmarks may be red
at once: each run waits for the ones before it, so the timeout must allow for several.

The packaged unit has no devices. `systemctl edit slipwatch`:

    [Service]
    PrivateDevices=no
    PrivateUsers=no
    DeviceAllow=/dev/ttyUSB0 rw
    SupplementaryGroups=dialout

`slipwatch hook test` runs outside the unit and does not show whether that is right; a [drill] with this hook does.
"""

import fcntl
import json
import os
import re
import sys
import termios
import time
import tty
import unicodedata
from datetime import datetime, timezone
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

ANSWER_S = 20.0
# A letter that needs two places in the letters of a modem, such as a bracket, makes a message of 160 two messages.
LONGEST = 150
ESCAPE = b"\x1b"
STATES = {"firing": "", "resolved": " ended"}
TO_DO = {
    "red": "EVACUATE by the plan",
    "orange": "PREPARE to evacuate",
    "yellow": "Look at the slope",
    "unknown": "NOT WATCHED: watch by other means",
}


class Refused(Exception):
    """The modem refused, or gave no answer."""


def wait(modem, wanted):
    """Reads until one of `wanted` has come."""
    said = b""
    until = time.monotonic() + ANSWER_S
    while time.monotonic() < until:
        part = os.read(modem, 256)
        said += part
        if b"ERROR" in said:
            raise Refused(f"the modem answers {said.decode(errors='replace').strip()!r}")
        if any(word in said for word in wanted):
            return
    raise Refused(f"no answer within {ANSWER_S:.0f} s")


def command(modem, text, wanted):
    os.write(modem, text.encode("ascii"))
    wait(modem, wanted)


def opened(path):
    modem = os.open(path, os.O_RDWR | os.O_NOCTTY)
    # One at a time: commands of two runs would mix. The kernel ends it with the process.
    fcntl.flock(modem, fcntl.LOCK_EX)
    tty.setraw(modem)
    settings = termios.tcgetattr(modem)
    # A read returns after a second at the latest.
    settings[6][termios.VMIN] = 0
    settings[6][termios.VTIME] = 10
    settings[4] = settings[5] = termios.B115200
    termios.tcsetattr(modem, termios.TCSANOW, settings)
    return modem


def plain(text):
    """Letters that every modem has: without accents, and without what begins a new line."""
    apart = unicodedata.normalize("NFKD", text)
    letters = "".join(letter for letter in apart if not unicodedata.combining(letter))
    letters = letters.encode("ascii", "replace").decode()
    return "".join(letter if letter.isprintable() else " " for letter in letters)


def minute(time, zone):
    """2017-06-07 05:00 CEST of 2017-06-07T03:00:00Z in Europe/Rome."""
    try:
        clocks = ZoneInfo(zone)
    except (ValueError, ZoneInfoNotFoundError):
        # This machine does not know the zone.
        clocks = timezone.utc
    try:
        instant = datetime.fromisoformat(f"{time[:19]}+00:00")
    except ValueError:
        return time
    return instant.astimezone(clocks).strftime("%Y-%m-%d %H:%M %Z")


def message(environment, alert):
    """What fits into one message: what it is, where, and what to do come first."""
    place = environment.get("SLIPWATCH_BENCHMARK") or "the whole site"
    # One message may stand for many benchmarks.
    count = int(environment.get("SLIPWATCH_COUNT") or 1)
    if count > 1:
        place = f"{count} benchmarks"
    level, status = environment["SLIPWATCH_LEVEL"], environment["SLIPWATCH_STATUS"]
    state = environment["SLIPWATCH_STATE"]
    words = [] if status == "Actual" else [f"{status.upper()}, do not act on this:"]
    words.append(f"{level.upper()}{STATES.get(state, ' corrected')}:")
    words.append(f"{environment['SLIPWATCH_SITE']}, {place}.")
    zone = environment.get("SLIPWATCH_TIME_ZONE") or "UTC"
    in_force = environment.get("SLIPWATCH_IN_FORCE")
    if in_force in ("red", "orange"):
        # What is unknown ends no level.
        words.append(f"{in_force.upper()} STAYS IN FORCE: {TO_DO[in_force]}.")
    elif state == "firing" and level in TO_DO:
        words.append(f"{TO_DO[level]}.")
    if state == "resolved" and level in ("red", "orange"):
        words.append("No all-clear: look at the slope first.")
    forecast = environment.get("SLIPWATCH_FAILURE_TIME")
    if forecast and state == "firing":
        words.append(f"Collapse forecast {minute(forecast, zone)}.")
    # The place and the level stand above already, and by which span a chance counts is too long for this.
    said = environment.get("SLIPWATCH_TEXT_LOCAL") or alert.get("text", "")
    _, _, figures = said.partition(": ")
    figures = figures.removeprefix(level).removeprefix(" ends").lstrip("; ")
    # Of a level that comes from the past the figures are more than where they were found.
    figures = re.sub(r", found in the readings from before [^;]*; nothing since has ended it", "", figures)
    figures = re.sub(r" \([^)]*\)", "", figures).replace(" %", "%")
    words.append(f"At {minute(environment['SLIPWATCH_TIME'], zone)}{': ' if figures else ''}{figures}")
    text = plain(" ".join(words))
    if len(text) > LONGEST:
        # After a figure that is whole, or a word: half a figure is another figure.
        whole = text[: LONGEST + 1]
        figure, word = whole.rfind("; "), whole.rfind(" ")
        text = text[: figure if figure > LONGEST // 2 else word if word > LONGEST // 2 else LONGEST]
    return text.rstrip(" ;,")


def main():
    if len(sys.argv) < 3:
        print("sms.py: name the modem and at least one number", file=sys.stderr)
        return 2
    alert = json.load(sys.stdin)
    text = message(os.environ, alert)
    try:
        modem = opened(sys.argv[1])
        command(modem, "AT\r", [b"OK"])
        command(modem, "AT+CMGF=1\r", [b"OK"])
    except (OSError, Refused) as error:
        print(f"sms.py: {sys.argv[1]}: {error}", file=sys.stderr)
        return 1
    refused = 0
    for number in sys.argv[2:]:
        try:
            command(modem, f'AT+CMGS="{number}"\r', [b">"])
            command(modem, f"{text}\x1a", [b"+CMGS:"])
        except (OSError, Refused) as error:
            # The others are to have it all the same; the modem may still wait for the text.
            refused += 1
            print(f"sms.py: {sys.argv[1]}: {number}: {error}", file=sys.stderr)
            os.write(modem, ESCAPE)
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
