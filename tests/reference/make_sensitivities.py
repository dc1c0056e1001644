#!/usr/bin/env python3
"""Makes sensitivities.csv: derivatives of the law's solution by r, kappa and p (needs mpmath).

With f(y) = -r + kappa bc(y; p), T(y) the time and S(y) the slip (over v_i) from y = 1 to y are
quadratures, and so are their derivatives at fixed y; at fixed time dy = -f dT and dslip = dS - dT/y.
r, kappa and p are binary fractions; lines with y = 0 are the failure. Usage: make_sensitivities.py > sensitivities.csv
"""
import csv
import sys

from mpmath import exp, expm1, log, mp, mpf, nstr, quad

mp.dps = 40

LAWS = [
    # r, kappa, p; then values of y on the way
    ("0.5", "0.25", "0.25", ["0.9", "0.5", "0.1", "1e-4", "0"]),
    ("0.015625", "0.5", "0.5", ["0.99", "0.5", "1e-3", "0"]),
    ("9.5367431640625e-7", "0.5", "0.25", ["0.999999", "0.9", "0.01", "0"]),
    ("2", "0.03125", "0.96875", ["0.9", "0.3", "0.01", "0"]),
    ("0.5", "0", "0", ["0.9", "0.5", "0.01", "0"]),
    ("0.5", "0", "0.25", ["0.9", "0.5", "0.01", "0"]),
    ("0.5", "0.25", "0", ["0.9", "0.5", "0.01", "0"]),
    ("0.5", "0.000244140625", "0.0000152587890625", ["0.9", "0.5", "0.01", "0"]),
    ("-0.5", "0", "0", ["1.1", "2", "30"]),
    ("-0.5", "0.25", "0.25", ["1.1", "2", "30", "1e6"]),
    ("-0.25", "0.03125", "0.96875", ["1.1", "5", "1e4"]),
    ("0.5", "-0.25", "-0.25", ["0.9", "0.5", "0.2", "0.1975310"]),
    ("0.5", "-0.5", "-4", ["0.9", "0.7", "0.6687404"]),
    ("0.25", "-1", "1.5", ["0.9", "0.75", "0.731005"]),
    ("-0.25", "-1", "1.5", ["1.1", "1.2", "1.23", "1.236"]),
    ("-0.25", "-1", "-0.0009765625", ["1.1", "1.2", "1.28"]),
    ("-9.5367431640625e-7", "-1", "-1", ["1.0000003", "1.0000009", "1.00000095367"]),
    ("9.5367431640625e-7", "-1", "1.0625", ["0.9999997", "0.9999991"]),
    ("-9.5367431640625e-7", "0.5", "0.25", ["1.000001", "1.1", "10"]),
]


def box_cox(s, p):
    return s if p == 0 else expm1(p * s) / p


def box_cox_by_p(s, p):
    if p == 0:
        return s * s / 2
    return (s * exp(p * s) - box_cox(s, p)) / p


def row(r, kappa, p, y):
    failure = y == 0
    end = mpf(-400) if failure else log(y)
    f = lambda s: -r + kappa * box_cox(s, p)
    nudge = abs(r / kappa) if kappa else mpf(1)
    edges, edge = [mpf(0)], min(nudge, mpf("0.125"))
    while edge < abs(end):
        edges.append(edge if end > 0 else -edge)
        edge = edge * 2
    # The stable steady state lies ahead: halve towards the end as well.
    last = edges[-1]
    edges += [end - (end - last) / 2**k for k in range(1, 24)] + [end]
    over = lambda g: quad(g, edges, method="gauss-legendre")
    by = [lambda s: mpf(-1), lambda s: box_cox(s, p), lambda s: kappa * box_cox_by_p(s, p)]
    t = over(lambda s: exp(s) / f(s))
    slip = over(lambda s: 1 / f(s))
    t_by = [over(lambda s, g=g: -exp(s) * g(s) / f(s) ** 2) for g in by]
    if failure:
        return [t, y, None, *t_by, None, None, None]
    slip_by = [over(lambda s, g=g: -g(s) / f(s) ** 2) for g in by]
    slope = f(end)
    return [t, y, slip, *[-slope * d for d in t_by], *[ds - d / y for ds, d in zip(slip_by, t_by)]]


def main():
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow(["r", "kappa", "p", "t", "y", "slip", "y_by_r", "y_by_kappa", "y_by_p",
                  "slip_by_r", "slip_by_kappa", "slip_by_p"])
    show = lambda value: "" if value is None else nstr(value, 20, min_fixed=-6, max_fixed=20)
    for r, kappa, p, states in LAWS:
        for y in states:
            values = row(mpf(r), mpf(kappa), mpf(p), mpf(y))
            out.writerow([r, kappa, p, *[show(value) for value in values]])


main()
