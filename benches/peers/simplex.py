#!/usr/bin/env python3
"""The published recipe for the inversion, as a rival to measure against.

Minimises the rms of the readings about the constant-load law by a Nelder-Mead
simplex over (m, ln x_i, ln T), the linear unknowns (D, and the zero of a
displacement) by least squares, x(t) by LSODA, from many random starting
points: what Helmstetter et al. (2004) describe, with their unstated choices
(the starting points' ranges, the simplex's tolerances, the integrator) made
here. It is neither their program nor tuned beyond what it took to converge on
known series; a better rival may be possible. m is kept in [-20, 29].

    simplex.py [--starts N] [--seed N] FILE.csv...

Each FILE has rows `days,value` without a header; the quantity is in its name
(`..._displacement.csv`, anything else is velocity). Prints name, n, best rms,
m, x_i, T in days, seconds by the clock and of the processor.
"""

import argparse
import math
import time
import warnings

import numpy as np
from scipy.integrate import odeint
from scipy.optimize import minimize

LOWEST_M, HIGHEST_M = -20.0, 29.0
MOST_STEPS = 300  # between two readings


def state_and_slip(times, m, ln_x_i, ln_t):
    """ln x and the slip over D T at `times` (days from the first); None past a singularity."""

    def slope(s, _):
        try:
            velocity = math.exp(-m * s[0])
            return [math.exp(-s[0]) - velocity, velocity]
        except OverflowError:
            return [math.nan, math.nan]

    ends = times / math.exp(ln_t)
    motion, report = odeint(
        slope,
        [ln_x_i, 0.0],
        ends,
        rtol=1e-9,
        atol=1e-11,
        mxstep=MOST_STEPS,
        full_output=True,
    )
    done = report["message"] == "Integration successful."
    return motion if done and np.all(np.isfinite(motion)) else None


def rms(parameters, times, values, displacement):
    m, ln_x_i, ln_t = parameters
    if not LOWEST_M <= m <= HIGHEST_M or abs(ln_x_i) > 60 or abs(ln_t) > 60:
        return 1e300
    with np.errstate(all="ignore"):
        motion = state_and_slip(times, m, ln_x_i, ln_t)
        if motion is None:
            return 1e300
        if displacement:
            basis = np.column_stack([motion[:, 1], np.ones(len(times))])
        else:
            # Scaled by its greatest value: D takes up the rest.
            log_velocity = -m * motion[:, 0]
            basis = np.exp(log_velocity - log_velocity.max())[:, None]
        if not np.all(np.isfinite(basis)):
            return 1e300
        scale = np.abs(basis).max(axis=0)
        if np.any(scale == 0):
            return 1e300
        solution = np.linalg.lstsq(basis / scale, values, rcond=None)[0]
        if solution[0] <= 0:
            return 1e300
        residual = values - basis / scale @ solution
        return float(np.sqrt(np.mean(residual**2)))


def invert(times, values, displacement, starts, seed):
    random = np.random.default_rng(seed)
    length, best = times[-1], None
    for _ in range(starts):
        start = [
            random.uniform(-2.0, 3.0),
            random.normal(0.0, 2.0),
            np.log(length) + random.normal(0.0, 2.5),
        ]
        options = {"maxiter": 1000, "maxfev": 1500, "xatol": 1e-8, "fatol": 1e-12}
        found = minimize(
            rms,
            start,
            args=(times, values, displacement),
            method="Nelder-Mead",
            options=options,
        )
        if best is None or found.fun < best.fun:
            best = found
    return best


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("files", nargs="+")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    for file in options.files:
        times, values = np.loadtxt(file, delimiter=",", unpack=True, ndmin=2)
        name = file.rsplit("/", 1)[-1].removesuffix(".csv")
        begin, used = time.perf_counter(), time.process_time()
        best = invert(
            times - times[0],
            values,
            name.endswith("displacement"),
            options.starts,
            options.seed,
        )
        seconds, cpu = time.perf_counter() - begin, time.process_time() - used
        m, ln_x_i, ln_t = best.x
        print(
            f"{name} n={len(times)} rms={float(best.fun)!r} m={m:.5f} "
            f"x_i={np.exp(ln_x_i):.6g} T={np.exp(ln_t):.6g} seconds={seconds:.2f} cpu={cpu:.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
