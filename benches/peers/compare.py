#!/usr/bin/env python3
"""The inversion beside the published recipe, in one run on one machine.

Fits one benchmark with benches/peers/simplex.py (20 starts, in this process,
one thread) and with the release binary of slipwatch (whole processes, one
after the other), on the same readings, and prints the rms of both and the
ratio of their times. The peer's time is the lesser of clock and processor;
slipwatch's is the `seconds` that `fit` reports: the median of the runs, and
the least of them.

    cargo build --release
    compare.py [--benchmark ID] [--readings N] [--runs N] [FILE]

Needs numpy and scipy.
"""

import os

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import argparse
import csv
import datetime
import json
import pathlib
import statistics
import subprocess
import tempfile
import time
import warnings

import numpy as np
import scipy
import simplex

ROOT = pathlib.Path(__file__).resolve().parents[2]


def series(binary, file, benchmark, count):
    """Days from the first reading, values, whether displacements, and a CSV file of just them."""
    folder = pathlib.Path(tempfile.mkdtemp())
    table = folder / "all.csv"
    subprocess.run([binary, "convert", file, table], check=True, capture_output=True)
    with open(table) as lines:
        rows = list(csv.DictReader(lines))
    columns = [c for c in rows[0] if "velocity_" in c or "displacement_" in c]
    column = next(c for c in columns if c.startswith(f"{benchmark}_"))
    kept = [(row["time"], row[column]) for row in rows if row[column]][:count]
    chosen = folder / "chosen.csv"
    chosen.write_text(f"time,{column}\n" + "".join(f"{t},{v}\n" for t, v in kept))
    times = [datetime.datetime.fromisoformat(t.replace("Z", "+00:00")) for t, _ in kept]
    days = [(t - times[0]).total_seconds() / 86400 for t in times]
    values = np.array([float(v) for _, v in kept])
    return np.array(days), values, "displacement_" in column, chosen


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    vaiont = ROOT / "recordings/vaiont-1963-reconstruction.mcap"
    parser.add_argument("--benchmark", default="5")
    parser.add_argument("--readings", type=int, default=67)
    parser.add_argument("--runs", type=int, default=51)
    parser.add_argument("file", nargs="?", default=vaiont)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    binary = ROOT / "target/release/slipwatch"
    days, values, displacement, chosen = series(
        binary, options.file, options.benchmark, options.readings
    )
    clock, used = time.perf_counter(), time.process_time()
    peer = simplex.invert(days, values, displacement, starts=20, seed=1)
    clock, used = time.perf_counter() - clock, time.process_time() - used
    command = [binary, "fit", chosen, "--format", "json"]
    fits = []
    for _ in range(options.runs):
        run = subprocess.run(command, check=True, capture_output=True, text=True)
        fits.append(json.loads(run.stdout))
    seconds = sorted(fit["seconds"] for fit in fits)
    median, least = statistics.median(seconds), seconds[0]
    print(f"benchmark {options.benchmark}, {fits[0]['readings']} readings")
    print(f"scipy {scipy.__version__}: rms {float(peer.fun)!r}, {clock:.2f} s ({used:.2f} s of the processor)")
    print(
        f"slipwatch: rms {fits[0]['rms']!r}, {median * 1e3:.3f} ms (median of {options.runs} processes; "
        f"{least * 1e3:.3f} to {seconds[-1] * 1e3:.3f} ms), {fits[0]['evaluations']} laws"
    )
    peer_seconds = min(clock, used)
    print(f"ratio: {peer_seconds / median:,.0f} at the median, {peer_seconds / least:,.0f} at best")


if __name__ == "__main__":
    main()
