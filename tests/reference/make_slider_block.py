#!/usr/bin/env python3
"""Makes slider_block.csv: solutions of dx/dt = 1 - x^(1-m) to 20 digits (needs mpmath).

Time and slip are quadratures over x, in s = ln x, at 60 digits, with panels that halve towards the
steady state at x = 1; t_c - t is its own quadrature from the singular end, never a difference.
Usage: make_slider_block.py OLD.csv > NEW.csv, which keeps the points (m, x_i, x) of OLD.csv.
"""
import csv
import sys

from mpmath import exp, expm1, fabs, log, mp, mpf, nstr, quad

mp.dps = 60


def panels(low, high):
    """Panels between two values of ln x on one side of 0, geometric towards 0."""
    edges, edge = [low], low
    while fabs(edge) > 2 * fabs(high) or fabs(edge) < fabs(high) / 2:
        edge = edge / 2 if fabs(edge) > fabs(high) else edge * 2
        edges.append(edge)
    return edges + [high]


def over_ln_x(f, x_from, x_to):
    low, high = log(x_from), log(x_to)
    return mpf(0) if low == high else quad(f, panels(low, high))


def time_between(m, x_from, x_to):
    # dt = dx / (1 - x^(1-m)), dx = x ds
    return over_ln_x(lambda s: exp(s) / -expm1((1 - m) * s), x_from, x_to)


def slip_between(m, x_from, x_to):
    return over_ln_x(lambda s: exp((1 - m) * s) / -expm1((1 - m) * s), x_from, x_to)


def time_to_failure(m, x):
    # integral from 0 of u^(m-1) / (1 - u^(m-1)), term by term; the series is slow, and exact
    total, n = mpf(0), 1
    while True:
        term = x ** (n * (m - 1) + 1) / (n * (m - 1) + 1)
        total += term
        if term < total * mpf(10) ** -45:
            return total
        n += 1


def row(m_text, x_i_text, x_text):
    m, x_i, x = mpf(m_text), mpf(x_i_text), mpf(x_text)
    fails = m > 1 and x_i < 1
    t, slip = time_between(m, x_i, x), slip_between(m, x_i, x)
    velocity = x**-m
    remaining = time_to_failure(m, x) if fails else None
    t_c = time_to_failure(m, x_i) if fails else None
    if fails:
        t = t_c - remaining
    condition_v = fabs(m * -expm1((1 - m) * log(x)) / x * t)
    condition_slip = fabs(velocity * t / slip)
    show = lambda value: "" if value is None else nstr(value, 20, min_fixed=-6, max_fixed=20)
    short = lambda value: nstr(value, 3)
    return [m_text, x_i_text, show(t), show(remaining), x_text, show(velocity), show(slip), show(t_c),
            short(condition_v), short(condition_slip)]


def main():
    with open(sys.argv[1], newline="") as old:
        points = list(csv.DictReader(old))
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow(["m", "x_i", "t", "t_c_minus_t", "x", "velocity", "displacement", "t_c",
                  "condition_velocity", "condition_displacement"])
    for point in points:
        out.writerow(row(point["m"], point["x_i"], point["x"]))


main()
