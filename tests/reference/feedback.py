#!/usr/bin/env python3
"""The optimal feedback law, to 25 digits: writes feedback.csv.

    python3 -m venv venv && venv/bin/pip install gmpy2
    venv/bin/python feedback.py

The state `theta` with the time `t_left` is the start of a problem that ceilings.py solves at 54 digits: `v` is its velocity just after the
start, `work_to_go` its work, `costate` its price of theta. The gain is a difference of `v` over two such problems at neighbouring theta, to
30 digits. Checked before a row is written: the costate against the difference of the work, to 1e-20; the gain on a free start against its
formula, to 1e-15. Rows that cannot arrive in time are `infeasible`.
"""

import csv
import math
import random
import signal
import sys
import time

from gmpy2 import exp, expm1, mpfr

from ceilings import ROUGH, Infeasible, Path, Problem, Unphysical, precision, solve
from optimal_ceilings import INF, curvature_step, give_up, log_uniform, show, turn_of

AXES = ["theta", "t_left", "a", "b", "v_f", "bounded", "v_ceiling", "tau_ceiling"]
COLUMNS = ["v", "work_to_go", "costate", "gain", "arc", "status", "arcs"]
ARCS = {"free": "free", "floor": "floor", "v": "v_ceiling", "tau": "tau_ceiling"}


def maker(theta, a, b, v_f, bounded, v_ceiling, tau_ceiling, step=0):
    def make():
        n = [None if x == INF else mpfr(x) for x in (a, b, v_f, v_ceiling, tau_ceiling)]
        return Problem(n[0], n[1], mpfr(theta) * (1 + step), 1 / n[2], n[3], n[4], bool(bounded))

    return make


def velocity(path):
    return exp(path.ends()[0]) / path.p.theta_0


def gain_by_formula(family, path):
    """dv/dtheta on a free start from the second derivative of the work."""
    p = path.p
    z = path.ends()[0]
    h = curvature_step(family, path)
    up, down = [Path(p, path.c + s * h, turn_of(p, path, s * h)).time for s in (1, -1)]
    t_c = (up - down) / (2 * h)
    v, u_1 = velocity(path), expm1(z)
    tau = p.tau_ss(p.l_0) + p.a * z
    theta = p.theta_0
    return -(v / u_1) * ((tau - p.b + p.a) / (p.a * theta) + theta / (p.a * u_1 * t_c))


def row_of(case):
    theta, t_left, *rest = case
    try:
        family, path = solve(maker(theta, *rest), t_left)
    except Infeasible:
        return [None, None, None, None, "", "infeasible", ""]
    if path is None or family.kind == "sit":
        raise Unphysical
    p = path.p
    lowest = min([path.lowest] + [p.tau_ss(l) for label, _, s, e in path.pieces if label == "tau" for l in (s, e)])
    if lowest <= max(0, p.b - p.a):
        raise Unphysical
    label = path.pieces[0][0]
    z = path.ends()[0]
    costate = ((p.tau_ss(p.l_0) + p.a * z) * exp(z - p.l_0) + path.c) / expm1(z)
    step = mpfr(10) ** -15
    (v_1, w_1), (v_2, w_2) = [(velocity(q), q.work) for s in (-1, 1) for q in [solve(maker(theta, *rest, s * step), t_left)[1]]]
    h = 2 * step * p.theta_0
    assert abs((w_2 - w_1) / h - costate) < mpfr("1e-20") * (abs(costate) + abs(path.work)), "costate"
    gain = (v_2 - v_1) / h
    if label in ("floor", "v"):
        assert abs(gain) < mpfr("1e-20"), ("gain", float(gain))
        gain = mpfr(0)
    elif label == "tau":
        exact = -p.b * velocity(path) / (p.a * p.theta_0)
        assert abs(gain - exact) <= mpfr("1e-20") * velocity(path) / p.theta_0, ("gain", float(gain))
        gain = exact
    else:
        other = gain_by_formula(family, path)
        assert abs(gain - other) <= mpfr("1e-12") * (abs(gain) + velocity(path) / p.theta_0), ("gain", float(gain), float(other))
    return [velocity(path), path.work, costate, gain, ARCS[label], "ok", "-".join(path.arcs())]


def cases():
    paper = (0.03, 0.05, 100.0)
    for ceilings in ((1000.0, INF), (INF, 1.05), (400.0, 1.04), (INF, INF)):
        for theta in (0.34, 0.2, 0.05, 0.0125, 0.009):
            for t_left in (0.01, 0.06, 0.5):
                yield (theta, t_left, *paper, 1, *ceilings)
    for ceilings in ((4.5, INF), (INF, 0.965), (2.8, INF), (5.0, 0.99)):
        for theta in (0.01, 0.1, 0.3, 0.34, 0.5):
            for t_left in (0.05, 0.35, 0.7):
                yield (theta, t_left, 0.03, 0.05, 3.0, 1, *ceilings)
    # Just before steady sliding, theta at its final value, and theta that has to turn.
    yield (0.125, 0.05, 0.02, 0.02, 8.0, 1, 20.0, INF)
    yield (0.125, 0.5, 0.02, 0.01, 8.0, 1, INF, 1.08)
    yield (0.125, 1e-4, 0.02, 0.03, 8.0, 1, INF, INF)
    rng = random.Random(5)
    for _ in range(110):
        a = log_uniform(rng, 1e-3, 0.3)
        b = rng.choice([0.0, a, a * rng.uniform(0.1, 0.95), min(a * log_uniform(rng, 1.05, 6), 0.4)])
        v_f = log_uniform(rng, 1.5, 1e4)
        theta = min(log_uniform(rng, 0.2, 60) / v_f, 0.9)
        t_left = log_uniform(rng, 1e-2, 1e2) / v_f
        kind = rng.choice(["v", "tau", "both", "none"])
        v_ceiling = v_f * log_uniform(rng, 0.8, 50) if kind in ("v", "both") else INF
        steady = 1 - (b - a) * math.log(v_f)
        tau_ceiling = max(steady, 1 + (b - a) * math.log(theta)) + a * log_uniform(rng, 0.05, 5) if kind in ("tau", "both") else INF
        yield (theta, t_left, a, b, v_f, int(rng.random() < 0.7), v_ceiling, tau_ceiling)
    # Starts at the friction ceiling: shortly after the least time, where the ceiling rises with falling theta.
    for theta, a, b, v_f, tau_ceiling in (
        (0.34, 0.03, 0.05, 100.0, 1.05), (0.34, 0.05, 0.02, 100.0, 1.36), (0.05, 0.05, 0.02, 100.0, 1.36), (0.34, 0.1, 0.08, 1e4, 1.384),
    ):  # fmt: skip
        precision(ROUGH)
        least = float(maker(theta, a, b, v_f, 1, INF, tau_ceiling)().least_time())
        for excess in (1e-6, 1e-3, 0.02):
            yield (theta, least * (1 + excess), a, b, v_f, 1, INF, tau_ceiling)


def main():
    signal.signal(signal.SIGVTALRM, give_up)
    start = time.time()
    with open("feedback.csv", "w", newline="") as file:
        file.write("# made by feedback.py, gmpy2 at 54 digits, tanh-sinh in ln theta\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow([*AXES, *COLUMNS])
        rows = 0
        for case in cases():
            signal.setitimer(signal.ITIMER_VIRTUAL, 20)
            try:
                row = row_of(case)
            except (Infeasible, Unphysical, AssertionError, ZeroDivisionError, ArithmeticError, ValueError, IndexError, TypeError) as error:
                print("skipped", case, repr(error)[:120], file=sys.stderr)
                continue
            out.writerow([*(repr(x) for x in case), *(show(x) for x in row)])
            file.flush()
            rows += 1
            print(rows, row[-3:], f"{time.time() - start:.0f} s", flush=True)
    print(rows, "rows")


if __name__ == "__main__":
    main()
