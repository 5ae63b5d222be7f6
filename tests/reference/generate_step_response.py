#!/usr/bin/env python3
"""step_response.csv: responses of a block on a spring to a step of the control velocity, by Taylor series at 30 digits.

    venv/bin/python generate_step_response.py        (needs mpmath; minutes)

The unknowns are v, theta and s themselves, in units of v_f, l/v_f and l; the series are those of the products and
logarithms in the equations (automatic differentiation), order 40, with steps that leave 1e-25 of the solution. A row holds the
first fastest moment and the first three upward crossings of v = v_f.
"""
import csv
from mpmath import mp, mpf, exp, log, nstr

mp.dps = 34
ORDER = 40
LEAVES = mpf(10) ** -27


def series(a, b, inertia, k, start):
    """Taylor coefficients of v, theta and s about a state."""
    v, theta, s = [start[0]], [start[1]], [start[2]]
    ln_v, ln_theta = [log(v[0])], [log(theta[0])]
    for n in range(ORDER):
        force = k * s[n] - a * ln_v[n] - b * ln_theta[n]
        product = sum(theta[i] * v[n - i] for i in range(n + 1))
        unit = mpf(1 if n == 0 else 0)
        v.append(force / inertia / (n + 1))
        theta.append((unit - product) / (n + 1))
        s.append((unit - v[n]) / (n + 1))
        for ln_u, u in ((ln_v, v), (ln_theta, theta)):
            m = n + 1
            rest = sum(i * ln_u[i] * u[m - i] for i in range(1, m))
            ln_u.append((u[m] - rest / m) / u[0])
    return v, theta, s


def at(coefficients, h):
    value = mpf(0)
    for c in reversed(coefficients):
        value = value * h + c
    return value


def slope(coefficients, h):
    return at([i * c for i, c in enumerate(coefficients)][1:], h)


def reach(coefficients):
    """A step that leaves LEAVES of the solution."""
    steps = []
    for u in coefficients:
        for n in (ORDER - 1, ORDER):
            if u[n] != 0:
                steps.append((LEAVES * abs(u[0]) / abs(u[n])) ** (mpf(1) / n))
    return min(steps)


def root(f, low, high):
    f_low = f(low)
    for _ in range(120):
        middle = (low + high) / 2
        f_middle = f(middle)
        if (f_middle > 0) == (f_low > 0):
            low, f_low = middle, f_middle
        else:
            high = middle
    return (low + high) / 2


def response(a, b, inertia, k, ratio):
    a, b, inertia, k, ratio = (mpf(x) for x in (a, b, inertia, k, ratio))
    state = (ratio, 1 / ratio, (a - b) * log(ratio) / k)
    t, peak, crossings = mpf(0), None, []
    steps = 0
    while len(crossings) < 3 or peak is None:
        u = series(a, b, inertia, k, state)
        h = reach(u)
        end = tuple(at(c, h) for c in u)
        if state[0] < 1 <= end[0]:
            x = root(lambda x: at(u[0], x) - 1, mpf(0), h)
            crossings.append((t + x, at(u[1], x), at(u[2], x)))
        if peak is None and crossings and slope(u[0], mpf(0)) > 0 > slope(u[0], h):
            x = root(lambda x: slope(u[0], x), mpf(0), h)
            peak = (t + x, at(u[0], x))
        t, state, steps = t + h, end, steps + 1
    print(k, ratio, steps, "steps", flush=True)
    return peak, crossings


V_F, MASS = 3.2e6, 2.5e-16
CASES = [(7.5e-3, 1e5 / V_F), (6e-3, 1e5 / V_F), (0.02, 1e5 / V_F), (7.5e-3, 2.0)]

with open("step_response.csv", "w", newline="") as file:
    out = csv.writer(file, lineterminator="\n")
    names = ["a", "b", "inertia", "k", "ratio", "t_peak", "v_peak"]
    out.writerow(names + [f"{name}_{i}" for i in (1, 2, 3) for name in ("t", "theta", "s")])
    for k, ratio in CASES:
        inertia = MASS * V_F * V_F
        peak, crossings = response(0.005, 0.01, inertia, k, ratio)
        numbers = [*peak, *(x for crossing in crossings for x in crossing)]
        out.writerow([repr(x) for x in (0.005, 0.01, inertia, k, ratio)] + [nstr(x, 25) for x in numbers])
        file.flush()
