#!/usr/bin/env python3
"""Optimal protocols under ceilings of velocity and friction, to 25 digits: writes optimal_ceilings.csv.

    python3 -m venv venv && venv/bin/pip install gmpy2
    venv/bin/python optimal_ceilings.py                 # or some of theory, structures, limits, random

The problem is solved by ceilings.py at 54 digits. Each row is checked before it is written: the time to 1e-34 of `t_f - t_least`; time and
work by another substitution to 1e-36; the Hamiltonian against the derivative of the work along the family, and every slope against a
difference of `W + C t` at fixed C, to 1e-12 of its greatest part. Rows on whose path friction falls to max(0, b - a) are left out.
"""

import csv
import math
import random
import signal
import sys
import time

import gmpy2
from gmpy2 import exp, log, mpfr

from ceilings import FULL, ROUGH, Infeasible, Path, Problem, Unphysical, bisect, phi, precision, solve

INF = math.inf
AXES = ["a", "b", "v_i", "v_f", "t_f", "bounded", "v_ceiling", "tau_ceiling"]
SLOPES = ["dwork_da", "dwork_db", "dwork_dv_i", "dwork_dv_f", "dwork_dv_ceiling", "dwork_dtau_ceiling"]
COLUMNS = [
    "work", "v_start", "v_end", "time_at_floor", "time_at_v_ceiling", "time_at_tau_ceiling", "hamiltonian", "theta_max", "friction_max",
    "strategy", *SLOPES, "d2work_dt_f2", "t_least", "v_ceiling_least", "tau_ceiling_least", "arcs",
]  # fmt: skip


def show(x):
    if isinstance(x, str):
        return x
    if x is None:
        return ""
    return f"{x:.24e}" if x != 0 else "0"


def maker(a, b, v_i, v_f, bounded, v_ceiling, tau_ceiling):
    """The problem of a row at the current precision."""

    def make(**changes):
        values = {"a": a, "b": b, "v_i": v_i, "v_f": v_f, "v_ceiling": v_ceiling, "tau_ceiling": tau_ceiling} | changes
        n = {name: None if value == INF else mpfr(value) for name, value in values.items()}
        return Problem(n["a"], n["b"], 1 / n["v_i"], 1 / n["v_f"], n["v_ceiling"], n["tau_ceiling"], bool(bounded))

    return make


def greatest_friction(path):
    """The greatest friction after the start and before the end: at an end of an arc, or where it is stationary on a free one."""
    p = path.p
    found = []
    for label, side, start, end in path.pieces:
        tau = lambda l: p.tau_ss(l) + p.a * path.clamped(l, side)[0]
        found += [tau(start), tau(end)]
        if label != "free":
            continue
        slope = lambda l: (p.b - p.a) * gmpy2.expm1(path.clamped(l, side)[0]) + (p.b - p.a) + path.c * exp(l)
        inner = [start + (end - start) * k / 64 for k in range(65)]
        for x, y in zip(inner, inner[1:]):
            if slope(x) * slope(y) < 0:
                found.append(tau(bisect(slope, x, y)))
    return max(found)


def ceilinged_time(p):
    """Time of a motion on the ceilings alone; infinite if it never ends."""
    inner = []
    if p.v_ceiling is not None and p.tau_ceiling is not None and p.b > 0:
        inner = [(p.tau_ceiling - 1 - p.a * log(p.v_ceiling)) / p.b]
    ends = [p.l_0, p.l_1]
    values = [p.cap(l)[0] for l in ends]
    if p.l_1 < p.l_0:
        return p.on_ceiling() if min(values) > 0 else mpfr(INF)
    values += [p.cap(l)[0] for l in inner if p.l_0 < l < p.l_1]
    return p.on_ceiling() if max(values) < 0 else mpfr(INF)


def least_ceiling(make, t_f, which):
    """The least feasible ceiling of velocity or friction, the other one given."""
    p = make(**{which: INF})
    one = which == "v_ceiling"
    if p.l_0 == p.l_1:
        return 1 / p.theta_1 if one else p.tau_ss(p.l_1)
    if p.l_1 > p.l_0 and p.floor and not one and ceilinged_time(make(tau_ceiling=1 + p.b * p.l_1)) >= t_f:
        return 1 + p.b * p.l_1

    def value(x):
        """Exponential distance from the ceiling of infinite time (an acceleration) or allows any time."""
        q = make(**{which: INF})
        steady = [q.tau_ss(q.l_0), q.tau_ss(q.l_1)]
        if q.l_1 < q.l_0:
            return (1 + exp(x)) / q.theta_1 if one else max(steady) + exp(x)
        if one:
            # The least velocity that is steady sliding where the other ceiling allows to stop.
            allowed = [l for l in (q.l_0, q.l_1, *q.zero_of_caps()) if q.l_0 <= l <= q.l_1 and (not q.caps(l) or q.cap(l)[0] >= -mpfr(10) ** -25)]
            return (exp(-max(allowed)) if allowed else mpfr(10) ** 6) / (1 + exp(x))
        allowed = [q.tau_ss(l) for l in (q.l_0, q.l_1, *q.zero_of_caps()) if q.l_0 <= l <= q.l_1 and (not q.caps(l) or q.cap(l)[0] >= -mpfr(10) ** -25)]
        return (min(allowed) if allowed else mpfr(100)) - exp(x)

    def f(x):
        needed = ceilinged_time(make(**{which: value(x)}))
        return log(needed / t_f) if needed < INF else mpfr(10)

    # Within 1e-22 of a ceiling of infinite time it counts as that ceiling, to twice the digits of a double.
    if f(mpfr(-50)) < 0:
        return value(mpfr(-50))
    bits = gmpy2.get_context().precision
    precision(ROUGH)
    low = high = mpfr(-3)
    while f(low) < 0:
        low -= 4
    while f(high) > 0:
        high += 2
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if f(middle) > 0 else (low, middle)
    precision(bits)
    x_0, x_1 = mpfr(low), mpfr(high)
    f_0, f_1 = f(x_0), f(x_1)
    for _ in range(9):
        if f_0 == f_1 or abs(f_1) < mpfr(2) ** (-bits + 20):
            break
        x_0, f_0, x_1 = x_1, f_1, x_1 - f_1 * (x_1 - x_0) / (f_1 - f_0)
        f_1 = f(x_1)
    assert abs(f_1) < mpfr(2) ** (-bits // 2), float(f_1)
    return value(x_1)


def steady_for(make, t_f, family, path):
    """The row of a motion that ends in steady sliding on the ceiling."""
    p = family.p
    c = p.c_at(p.l_1)
    sat = t_f - (path.time if path else 0)
    times = dict(path.times) if path else dict.fromkeys(("floor", "v", "tau"), mpfr(0))
    on = "v" if p.v_ceiling is not None else "tau"
    times[on] += sat
    v_f = 1 / p.theta_1
    work = (path.work if path else 0) - sat * c
    # The multiplier of the velocity rises from 0 with the rate v_f (tau + a - b + rise multiplier).
    force, slip, rise = p.tau_ss(p.l_1) + p.a - p.b, sat * v_f, mpfr(1) if on == "v" else 1 - p.b / p.a
    pressed = force * (gmpy2.expm1(rise * slip) / rise if rise else slip)
    price = force / v_f * ((gmpy2.expm1(rise * slip) / rise - slip) / rise if rise else slip**2 / 2)
    by_v, by_tau = (-price, mpfr(0)) if on == "v" else (mpfr(0), -price * v_f / p.a)
    a, b = (slip - by_tau) * -p.l_1, (slip - by_tau) * p.l_1
    p_1 = (p.tau_ss(p.l_1) + p.a + pressed) / p.theta_1
    v_i, friction, start, arcs = -(p.tau_ss(p.l_1) + p.a) * p.theta_0, p.tau_ss(p.l_1), v_f, []
    if path:
        slopes = path.slopes()
        a, b, v_i = a + slopes["a"], b + slopes["b"], -slopes["p_0"] * p.theta_0**2
        friction, start, arcs = max(friction, greatest_friction(path)), exp(path.ends()[0]) / p.theta_0, path.arcs()
    by = [a, b, v_i, p_1 * p.theta_1**2, by_v, by_tau]
    return [work, start, v_f, times["floor"], times["v"], times["tau"], -c, p.theta_1, friction, *by, mpfr(0), arcs + ["sit"]]


def check_slope(make, path, name, found, whole):
    """A slope against the difference of W + C t at fixed C."""
    p = path.p
    value = {"a": p.a, "b": p.b, "v_i": 1 / p.theta_0, "v_f": 1 / p.theta_1, "v_ceiling": p.v_ceiling, "tau_ceiling": p.tau_ceiling}[name]
    h = max(abs(value), mpfr(1)) * mpfr(10) ** -16
    ends = []
    for x in (value + h, value - h):
        q = make(**{name: x})
        turn = path.turn
        if turn is not None:
            for _ in range(10):
                turn -= (q.c_at(turn) - path.c) * exp(turn) / (q.tau_ss(turn) - (q.b - q.a))
        r = Path(q, path.c, turn)
        ends.append(r.work + r.c * r.time)
    difference = (ends[0] - ends[1]) / (2 * h)
    # A ceiling met by h alone adds h^2.
    assert abs(difference - found) <= mpfr("1e-12") * (abs(found) + whole), (name, float(difference), float(found))


def row_of(case, check=True):
    a, b, v_i, v_f, t_f, bounded, v_ceiling, tau_ceiling = case
    make = maker(a, b, v_i, v_f, bounded, v_ceiling, tau_ceiling)
    family, path = solve(make, t_f)
    p = family.p
    t_f = mpfr(t_f)
    least = make().least_time()
    if p.l_0 == p.l_1:
        least = mpfr(0)
    limits = [least, least_ceiling(make, t_f, "v_ceiling"), least_ceiling(make, t_f, "tau_ceiling")]
    if path is None or family.kind == "sit":
        *numbers, arcs = steady_for(make, t_f, family, path)
        lowest = min(path.lowest if path else INF, p.tau_ss(p.l_1))
    else:
        slopes = path.slopes()
        assert abs(slopes["time"] - path.time) < mpfr("1e-36") * path.time and abs(slopes["work"] - path.work) < mpfr("1e-36") * abs(path.work)
        z_0, z_1 = path.ends()
        by = {"a": slopes["a"], "b": slopes["b"], "v_i": -slopes["p_0"] * p.theta_0**2, "v_f": slopes["p_1"] * p.theta_1**2}
        by["v_ceiling"], by["tau_ceiling"] = slopes["v_ceiling"], slopes["tau_ceiling"]
        neighbours = [Path(p, path.c + s * h, turn_of(p, path, s * h)) for h in [curvature_step(family, path)] for s in (1, -1)]
        (t_2, w_2), (t_1, w_1) = [(r.time, r.work) for r in neighbours]
        if check and t_2 != t_1:
            slope = (w_2 - w_1) / (t_2 - t_1)
            assert abs(slope + path.c) < mpfr("1e-10") * (abs(path.c) + 1), (float(slope), float(path.c))
        curvature = -(neighbours[0].c - neighbours[1].c) / (t_2 - t_1) if t_2 != t_1 else None
        if check:
            for name, value in by.items():
                if name == "v_ceiling" and p.v_ceiling is None or name == "tau_ceiling" and p.tau_ceiling is None:
                    continue
                if name == "b" and b == 0 or name in ("v_i", "v_f") and v_i == v_f:
                    continue
                whole = mpfr(0) if name not in ("v_ceiling", "tau_ceiling") else mpfr("1e-3") * path.work * (mpfr("1e-12") if value == 0 else 0)
                try:
                    check_slope(make, path, name, value, whole)
                except (Infeasible, ZeroDivisionError) as error:
                    print("unchecked", name, case, error, file=sys.stderr)
        top = exp(path.turn) if path.turn is not None else max(p.theta_0, p.theta_1)
        numbers = [
            path.work, exp(z_0) / p.theta_0, exp(z_1) / p.theta_1, path.times["floor"], path.times["v"], path.times["tau"], -path.c, top,
            greatest_friction(path), *by.values(), curvature,
        ]  # fmt: skip
        arcs = path.arcs()
        lowest = min([path.lowest] + [p.tau_ss(l) for label, _, s, e in path.pieces if label == "tau" for l in (s, e)])
    if lowest <= max(0, p.b - p.a):
        raise Unphysical
    start = numbers[1]
    # v(0+) on the floor is 1 by the bound.
    strategy = "floor" if arcs[0] == "floor" else "speed_up" if start > p.theta_0**-1 else "slow_down"
    return numbers[:9] + [strategy] + numbers[9:] + limits + ["-".join(arcs)]


def curvature_step(family, path):
    """A difference of C that changes the time by about 1e-12 of what is beyond the limits."""
    span = abs(path.c - family.p.c_at(family.limit)) if path.turn is None else abs(path.c)
    if path.turn is not None:
        span = min(span, abs(path.c - family.p.c_at(family.limit)))
    return span * mpfr(10) ** -14


def turn_of(p, path, step):
    if path.turn is None:
        return None
    turn, c = path.turn, path.c + step
    for _ in range(10):
        turn -= (p.c_at(turn) - c) * exp(turn) / (p.tau_ss(turn) - (p.b - p.a))
    return turn


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def free_peaks(case):
    """Greatest velocity and friction of the optimum without ceilings."""
    *start, bounded, _, _ = case
    family, path = solve(maker(*start[:4], bounded, INF, INF), start[4])
    z_0, z_1 = path.ends()
    return float(max(exp(z_0) / path.p.theta_0, exp(z_1) / path.p.theta_1)), float(greatest_friction(path)), path


def least_of(case, which):
    a, b, v_i, v_f, t_f, bounded, v_ceiling, tau_ceiling = case
    precision(ROUGH)
    return float(least_ceiling(maker(a, b, v_i, v_f, bounded, v_ceiling, tau_ceiling), mpfr(t_f), which))


def between(low, high, fraction):
    """A value above low, near it for a small fraction."""
    return low + (high - low) * fraction


def transitions(rng):
    """Random transitions with every order of a and b, in both directions."""
    while True:
        a = log_uniform(rng, 1e-3, 0.3)
        b = rng.choice([0.0, a, a * rng.uniform(0.1, 0.95), min(a * log_uniform(rng, 1.05, 8), 0.4), min(a * log_uniform(rng, 1.05, 8), 0.4)])
        v = rng.choice([log_uniform(rng, 2, 100), log_uniform(rng, 100, 1e6), 1 + log_uniform(rng, 1e-3, 1)])
        ratio = rng.choice([log_uniform(rng, 1.1, 1e2), log_uniform(rng, 1.1, 1e5), 1 + log_uniform(rng, 1e-5, 0.1)])
        kind = rng.choice(["up", "up", "down", "down", "equal"])
        pair = {"up": (v, v * ratio), "down": (v * ratio, v), "equal": (v, v)}[kind]
        # Durations from a fraction of a slip distance to many.
        t_f = log_uniform(rng, 1e-2, 1e3) / max(pair)
        if kind == "up":
            t_f = rng.choice([t_f, log_uniform(rng, 0.1, 10) / min(pair)])
        floor = rng.random() < 0.75
        if kind == "down":
            v_i, v_f = pair
            least = math.log1p((v_i - v_f) / (v_i * (v_f - 1))) if floor else 1 / v_f - 1 / v_i
            t_f = least * (1 + log_uniform(rng, 1e-4, 1e2)) if rng.random() < 0.5 else least + log_uniform(rng, 1e-3, 30) / v_f
        if t_f <= 200:
            yield a, b, *pair, t_f, int(floor), INF, INF


PAPER = (0.03, 0.05, 3.0, 100.0)
SLOW = (0.03, 0.05, 100.0, 3.0)


def checked_by_the_theory():
    yield "theory", (*PAPER, 0.02, 1, 1000.0, INF)
    yield "theory", (*PAPER, 0.02, 1, 300.0, INF)
    yield "theory", (*PAPER, 0.02, 1, INF, 1.05)
    yield "theory", (*PAPER, 0.08, 1, 400.0, 1.04)
    yield "theory", (*SLOW, 0.7, 1, 4.5, INF)
    yield "theory", (*SLOW, 0.5, 1, INF, 0.965)
    yield "theory", (0.05, 0.02, 3.0, 100.0, 0.0012, 1, INF, 1.36)
    yield "theory", (*SLOW, 1.0, 1, 3.0, INF)
    yield "theory", (*PAPER, 0.02, 1, INF, INF)


def limits():
    """Near the least times, the least ceilings, the onsets of ceilings and of the hold, and where theta can only just turn."""
    for start, t_f in ((PAPER, 0.02), (PAPER, 0.08), ((0.05, 0.02, 3.0, 100.0), 0.02), ((0.04, 0.04, 20.0, 35.0), 0.03), ((0.01, 0.0, 5.0, 5e3), 1e-3)):
        for which, place in (("v_ceiling", 6), ("tau_ceiling", 7)):
            case = [*start, t_f, 1, INF, INF]
            peak = free_peaks(case)[place - 6]
            least = least_of(case, which)
            for fraction in (1e-3, 1e-6, 1e-9):
                case[place] = least * (1 + fraction)
                yield "near_least_ceiling", tuple(case)
            for fraction in (1e-2, 1e-5, 1e-8):
                case[place] = peak * (1 - fraction)
                yield "weak_ceiling", tuple(case)
            case[place] = between(least, peak, 0.3)
            make = maker(*case[:4], 1, case[6], case[7])
            precision(ROUGH)
            t_least = float(make().least_time())
            for fraction in (1e-2, 1e-5, 1e-8):
                case[4] = t_least * (1 + fraction)
                yield "near_t_least", tuple(case)
    for start in (SLOW, (0.05, 0.02, 100.0, 3.0), (0.02, 0.02, 40.0, 5.0), (0.03, 0.0, 1e4, 2.0)):
        v_i, v_f = start[2:]
        t_min = math.log1p((v_i - v_f) / (v_i * (v_f - 1)))
        for which, place in (("v_ceiling", 6), ("tau_ceiling", 7)):
            case = [*start, 1.3 * t_min, 1, INF, INF]
            least = least_of(case, which)
            for fraction in (1e-3, 1e-6, 1e-9):
                case[place] = least * (1 + fraction)
                yield "near_t_most", tuple(case)
            case[place] = least * (1 + 1e-2)
            for fraction in (1e-3, 1e-6):
                case[4] = t_min * (1 + fraction)
                yield "near_t_min", tuple(case)
        for excess in (1e-2, 1e-5, 1e-8, -1e-3, -1e-6):
            yield "v_ceiling_near_v_f", (*start, 1.2 * t_min, 1, v_f * (1 + excess), INF)
        yield "sitting", (*start, 1.5 * t_min, 1, v_f, INF)
    yield "sitting", (0.02, 0.02, 40.0, 5.0, 0.5, 1, INF, 1.0)
    yield "sitting", (0.03, 0.05, 7.0, 7.0, 0.5, 1, 7.0, INF)
    yield "sitting", (0.02, 0.02, 7.0, 7.0, 0.5, 1, INF, 1.0)
    yield "before_sitting", (*SLOW, 0.398, 1, 3.0, INF)
    for v_ceiling, tau_ceiling in ((1000.0, INF), (INF, 1.05), (400.0, 1.04)):
        make = maker(*PAPER, 1, v_ceiling, tau_ceiling)
        precision(ROUGH)
        p = make()
        # t_cross and t_floor under these ceilings.
        t_cross = float(Path(p, p.c_at(p.l_0), p.l_0).time)
        c = (p.a * phi(p.l_0) - p.tau_ss(p.l_0)) / p.theta_0
        turn = p.l_0
        for _ in range(30):
            turn -= (p.c_at(turn) - c) * exp(turn) / (p.tau_ss(turn) - (p.b - p.a))
        t_floor = float(Path(p, c, turn).time)
        for time, word in ((t_cross, "near_t_cross"), (t_floor, "near_t_floor")):
            for fraction in (-1e-4, 1e-4, 1e-8):
                yield word, (*PAPER, time * (1 + fraction), 1, v_ceiling, tau_ceiling)
    # An acceleration under a ceiling below 1 turns only below theta_c.
    for t_f in (0.5, 2.0, 6.0):
        yield "lingers", (0.03, 0.05, 30.0, 100.0, t_f, 1, INF, 0.96)
    for t_f in (0.6, 1.0, 3.0):
        yield "lingers", (*SLOW, t_f, 1, INF, 0.965)


def structures():
    """Sequences of arcs that random points seldom have."""
    yield "structure", (0.05, 0.02, 3.0, 1e4, 0.0012941309247107252, 1, INF, 1.3763102111592858)
    yield "structure", (0.05, 0.02, 3.0, 1e4, 0.0031, 1, 2e4, 1.3263102111592857)
    yield "structure", (0.1, 0.08, 3.0, 1e4, 0.013382512430302489, 1, INF, 1.3842068074395237)
    yield "structure", (0.2, 0.05, 3.0, 100.0, 0.008085775811857467, 1, INF, 2.090775527898214)
    yield "structure", (0.2, 0.05, 3.0, 1e4, 0.0020708338167306317, 1, 2e5, 2.481551055796428)
    yield "structure", (0.2, 0.05, 3.0, 1e4, 0.0011681964113972032, 0, INF, 2.581551055796428)
    yield "structure", (*PAPER, 0.02, 1, 1500.0, 1.05)
    yield "structure", (*PAPER, 0.03, 1, 800.0, 1.045)
    yield "structure", (*PAPER, 0.08, 0, 1000.0, 1.05)
    yield "structure", (*PAPER, 0.05, 0, INF, 1.05)
    yield "structure", (*SLOW, 0.5, 1, 2.7, 0.965)
    yield "structure", (*SLOW, 0.6, 0, 4.0, 0.99)
    yield "structure", (0.05, 0.02, 100.0, 3.0, 0.5, 1, 2.5, 1.02)
    yield "structure", (0.05, 0.03, 100.0, 3.0, 0.6, 0, 4.0, INF)
    yield "structure", (0.05, 0.03, 3.0, 30.0, 0.3, 0, INF, 1.09)
    yield "structure", (0.02, 0.02, 40.0, 5.0, 0.45, 1, 4.5, 0.995)
    yield "structure", (0.02, 0.02, 40.0, 5.0, 0.45, 1, 7.0, 1.008)
    yield "structure", (0.03, 0.0, 40.0, 5.0, 0.4, 1, INF, 1.03)


def random_cases(seed, count):
    """Random transitions with ceilings between the least feasible one and the peak of the free optimum."""
    rng = random.Random(seed)
    seen = 0
    for case in transitions(rng):
        if seen == count:
            return
        try:
            v_peak, tau_peak, _ = free_peaks(case)
            case = list(case)
            kind = rng.choice(["v", "tau", "tau", "both", "both"])
            fraction = lambda: rng.choice([rng.uniform(0.02, 0.98), log_uniform(rng, 1e-3, 1), 1 - log_uniform(rng, 1e-3, 1)])
            if kind in ("v", "both"):
                low = least_of(case, "v_ceiling")
                case[6] = low * (max(v_peak, 1.5 * low) / low) ** fraction()
            if kind in ("tau", "both"):
                low = least_of(case, "tau_ceiling")
                case[7] = between(low, max(tau_peak, low + 0.05 * case[0]), fraction())
        except (Infeasible, Unphysical, AssertionError, ZeroDivisionError, ArithmeticError, OverflowError):
            continue
        seen += 1
        kind = "equal" if case[2] == case[3] else "acceleration" if case[3] > case[2] else "deceleration"
        yield f"{kind}_{'v' if case[6] < INF else ''}{'tau' if case[7] < INF else ''}", tuple(case)


def give_up(*_):
    raise ArithmeticError("the time is over")


SOURCES = {"theory": checked_by_the_theory, "structures": structures, "limits": limits, "random": lambda: random_cases(1, 160)}


def main(sources):
    signal.signal(signal.SIGVTALRM, give_up)
    start = time.time()
    with open("optimal_ceilings.csv", "w", newline="") as file:
        file.write("# made by optimal_ceilings.py, gmpy2 at 54 digits, tanh-sinh in ln theta\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["regime", *AXES, *COLUMNS])
        rows = 0
        for source in sources:
            for kind, case in SOURCES[source]():
                signal.setitimer(signal.ITIMER_VIRTUAL, 25)
                try:
                    row = row_of(case)
                except (Infeasible, Unphysical, AssertionError, ZeroDivisionError, ArithmeticError, ValueError, IndexError, TypeError) as error:
                    print("skipped", kind, case, repr(error)[:120], file=sys.stderr)
                    continue
                out.writerow([kind, *(repr(x) for x in case), *(show(x) for x in row)])
                file.flush()
                rows += 1
                print(rows, kind, row[-1], f"{time.time() - start:.0f} s", flush=True)
    print(rows, "rows")


if __name__ == "__main__":
    main(sys.argv[1:] or SOURCES)
