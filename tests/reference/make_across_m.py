#!/usr/bin/env python3
"""Makes across_m.csv: the law from m = -20 to 29, through m = 1 and beside the steady state (needs mpmath).

The columns are those of slider_block.csv. m and x_i are the decimal numbers written. Time, slip and
t_c - t are quadratures over s = ln x at 40 digits, on panels that halve towards the steady state.
Usage: make_across_m.py > across_m.csv
"""
import csv
import sys

from mpmath import exp, expm1, fabs, log, log1p, mp, mpf, nstr, quad

mp.dps = 40

# Ordinary states for every m; then states beside the steady one, given as x - 1.
EXPONENTS = ["-20", "-7.5", "-2", "-0.5", "-0.1", "0.05", "0.3", "0.75", "0.97", "0.999",
             "0.999999", "0.999999999", "0.999999999999", "1.000000000001", "1.000000001", "1.000001", "1.001",
             "1.02", "1.25", "2", "7.5", "29"]
STATES = ["0.25", "0.5", "0.9375", "1.0625", "2", "4"]
BESIDE_EXPONENTS = ["-20", "-1", "0.5", "0.98", "0.999999", "1.000001", "1.25", "3", "29"]
BESIDE_OFFSETS = ["-1e-3", "-1e-6", "-1e-9", "-1e-12", "1e-12", "1e-9", "1e-6", "1e-3"]


def over(f, low, high):
    """Integral from low to high, two values of ln x on one side of 0, panels geometric towards 0."""
    edges = [low]
    while fabs(edges[-1]) > 2 * fabs(high):
        edges.append(edges[-1] / 2)
    while fabs(edges[-1]) < fabs(high) / 2:
        edges.append(edges[-1] * 2)
    return quad(f, edges + [high], method="gauss-legendre")


def time_between(m, s_from, s_to):
    # dt = dx / (1 - x^(1-m)), x = exp(s)
    return over(lambda s: exp(s) / -expm1((1 - m) * s), s_from, s_to)


def slip_between(m, s_from, s_to):
    return over(lambda s: exp((1 - m) * s) / -expm1((1 - m) * s), s_from, s_to)


def time_to_failure(m, s):
    # What is left beyond 105 / m e-folds is under 1e-45 of the whole.
    return time_between(m, s, s - mpf(105) / m)


def solutions(m, s_i):
    """t, t_c - t, s, slip and t_c at the states ahead, each from the one before."""
    states = states_ahead(m, s_i)
    ends = list(zip([s_i, *states], states))
    steps = [time_between(m, *pair) for pair in ends]
    slips = [slip_between(m, *pair) for pair in ends]
    last = time_to_failure(m, states[-1]) if m > 1 and s_i < 0 else None
    for k, s in enumerate(states):
        t, slip = sum(steps[: k + 1]), sum(slips[: k + 1])
        remaining = None if last is None else last + sum(steps[k + 1 :])
        yield t, remaining, s, slip, None if last is None else t + remaining


def states_ahead(m, s_i):
    """Values of ln x that the law passes: soon, midway, and far on."""
    if m > 1:
        # ln v = -m ln x
        fold = mpf(-1) / m if s_i < 0 else mpf(1) / max(m - 1, 1)
        return [s_i + mpf(e) * fold for e in ["0.01", "0.5", "3", "9"]]
    return [s_i * mpf(share) for share in ["0.99", "0.5", "0.01", "1e-6", "1e-20"]]


def rows():
    for m in EXPONENTS:
        for x_i in STATES:
            yield m, x_i, log(mpf(x_i))
    for m in BESIDE_EXPONENTS:
        for offset in BESIDE_OFFSETS:
            x_i = nstr(1 + mpf(offset), 20, strip_zeros=True)
            yield m, x_i, log1p(mpf(offset))


def show(value):
    return "" if value is None else nstr(value, 20, min_fixed=-6, max_fixed=20)


def main():
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow(["m", "x_i", "t", "t_c_minus_t", "x", "velocity", "displacement", "t_c",
                  "condition_velocity", "condition_displacement"])
    for m_text, x_i_text, s_i in rows():
        m = mpf(m_text)
        for t, remaining, s, slip, t_c in solutions(m, s_i):
            velocity = exp(-m * s)
            condition_v = fabs(m * -expm1((1 - m) * s) * exp(-s) * t)
            out.writerow([m_text, x_i_text, show(t), show(remaining), show(exp(s)), show(velocity), show(slip),
                          show(t_c), nstr(condition_v, 3), nstr(fabs(velocity * t / slip), 3)])


main()
