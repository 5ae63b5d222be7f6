#!/usr/bin/env python3
"""step_response_ends.csv: what becomes of responses to a step of the control velocity, by Taylor series at 36 digits.

    venv/bin/python generate_step_response_ends.py        (needs gmpy2; minutes)

The unknowns are v, theta and s themselves, in units of v_f, l/v_f and l, as in generate_step_response.py; here a response is followed to
its end. Extrema and crossings are zeros of the polynomial of a step. A response is settled once energy can no longer take it out of
the band of 1 %: it is followed until its extrema stay within 1e-3 of v_f. A limit cycle is the fixed point of the map of the section v = v_f,
crossed upwards, onto itself, by Newton's method with differences; a response ends on it when it has come within 1e-6 of it, and its extremes are then
those on the way and those of the cycle.
"""
import csv, sys
import gmpy2
from gmpy2 import log, mpfr

gmpy2.get_context().precision = 130
ORDER = 32
LEAVES = mpfr("1e-30")


class Block:
    def __init__(self, a, b, inertia, k):
        self.a, self.b, self.inertia, self.k = (mpfr(x) for x in (a, b, inertia, k))

    def series(self, start):
        """Taylor coefficients of v, theta and s about a state."""
        v, theta, s = [start[0]], [start[1]], [start[2]]
        ln_v, ln_theta = [log(v[0])], [log(theta[0])]
        for n in range(ORDER):
            force = self.k * s[n] - self.a * ln_v[n] - self.b * ln_theta[n]
            product = sum((theta[i] * v[n - i] for i in range(n + 1)), mpfr(0))
            unit = 1 if n == 0 else 0
            m = n + 1
            v.append(force / self.inertia / m)
            theta.append((unit - product) / m)
            s.append((unit - v[n]) / m)
            for ln_u, u in ((ln_v, v), (ln_theta, theta)):
                rest = sum((i * ln_u[i] * u[m - i] for i in range(1, m)), mpfr(0))
                ln_u.append((u[m] - rest / m) / u[0])
        return v, theta, s

    def legs(self, state):
        """Step after step: time, series, length and state."""
        t = mpfr(0)
        while True:
            u = self.series(state)
            sizes = [u[0][0], u[1][0], max(abs(u[2][0]), self.a / self.k)]
            h = min(((LEAVES * size / abs(c[n])) ** (mpfr(1) / n) for c, size in zip(u, sizes) for n in (ORDER - 1, ORDER) if c[n] != 0))
            yield t, u, h
            state, t = tuple(at(c, h) for c in u), t + h

    def cycle(self, theta, s):
        """From the section onto itself: duration, theta, s, greatest and least v."""
        extremes = []
        for t, u, h in self.legs((mpfr(1), theta, s)):
            extremes += [value for _, value in turns(u[0], h)]
            if t > 0 and u[0][0] < 1 <= at(u[0], h):
                x = root(lambda x: at(u[0], x) - 1, mpfr(0), h)
                return t + x, at(u[1], x), at(u[2], x), max(extremes), min(extremes)

    def limit_cycle(self, theta, s):
        for _ in range(12):
            t, y, z, high, low = self.cycle(theta, s)
            miss = (y - theta, z - s)
            if abs(miss[0]) + abs(miss[1]) < mpfr("1e-27"):
                return theta, s, t, high, low
            d = mpfr("1e-16")
            _, y_1, z_1, *_ = self.cycle(theta * (1 + d), s)
            _, y_2, z_2, *_ = self.cycle(theta, s * (1 + d))
            j = [[(y_1 - y) / (theta * d) - 1, (y_2 - y) / (s * d)], [(z_1 - z) / (theta * d), (z_2 - z) / (s * d) - 1]]
            det = j[0][0] * j[1][1] - j[0][1] * j[1][0]
            theta -= (j[1][1] * miss[0] - j[0][1] * miss[1]) / det
            s -= (j[0][0] * miss[1] - j[1][0] * miss[0]) / det
        sys.exit("no limit cycle")


def at(coefficients, h):
    value = mpfr(0)
    for c in reversed(coefficients):
        value = value * h + c
    return value


def root(f, low, high):
    """Bisection, then the middle of what is left is good to the last digit."""
    f_low = f(low)
    for _ in range(125):
        middle = (low + high) / 2
        if (f(middle) > 0) == (f_low > 0):
            low = middle
        else:
            high = middle
    return (low + high) / 2


def turns(v, h):
    """Extrema of v within a step, by the signs of its slope at eight places."""
    slope = [i * c for i, c in enumerate(v)][1:]
    places = [h * i / 8 for i in range(9)]
    values = [at(slope, x) for x in places]
    found = []
    for i in range(8):
        if (values[i] > 0) != (values[i + 1] > 0):
            x = root(lambda x: at(slope, x), places[i], places[i + 1])
            found.append((x, at(v, x)))
    return found


BAND = mpfr(1) / 100


def response(block, ratio):
    """Greatest and least v once v = 1 is met, time of the greatest, settling time, and the limit cycle as period and extremes."""
    ratio = mpfr(ratio)
    state = (ratio, 1 / ratio, (block.a - block.b) * log(ratio) / block.k)
    met, extremes, outside, sections = False, [], mpfr(0), []
    for t, u, h in block.legs(state):
        end = at(u[0], h)
        crossed = (u[0][0] - 1) * (end - 1) <= 0 and t + h > 0 and u[0][0] != 1
        x_met = root(lambda x: at(u[0], x) - 1, mpfr(0), h) if crossed else mpfr(0)
        for x, value in turns(u[0], h):
            if met or (crossed and x > x_met):
                extremes.append((t + x, value))
        if crossed and u[0][0] < 1:
            sections.append((at(u[1], x_met), at(u[2], x_met)))
        met = met or crossed
        # The last place out of the band within this step.
        places = [h * i / 16 for i in range(17)]
        for i in range(16):
            low, high = (abs(at(u[0], x) - 1) - BAND for x in places[i : i + 2])
            if low > 0 >= high:
                sign = 1 if at(u[0], places[i]) > 1 else -1
                outside = t + root(lambda x: sign * (at(u[0], x) - 1) - BAND, places[i], places[i + 1])
        if len(extremes) > 3 and all(abs(value - 1) < mpfr("1e-3") for _, value in extremes[-3:]):
            break
        # Without oscillation, all but at rest.
        near = [u[0][0] - 1, u[1][0] - 1, u[2][0] * block.k / block.a]
        if met and len(extremes) <= 3 and all(abs(x) < mpfr("1e-9") for x in near):
            break
        if len(sections) > 2 and all(abs(p - q) < mpfr("1e-6") * abs(q) for p, q in zip(sections[-1], sections[-2])):
            break
    peak = max(extremes + [(mpfr(0), mpfr(1))], key=lambda e: e[1])
    trough = min(extremes + [(mpfr(0), mpfr(1))], key=lambda e: e[1])
    if len(sections) > 2 and abs(sections[-1][1] - sections[-2][1]) < mpfr("1e-6") * abs(sections[-1][1]) and extremes[-1][1] < 1 - mpfr("1e-2"):
        _, _, period, high, low = block.limit_cycle(*sections[-1])
        return max(peak[1], high), min(trough[1], low), peak[0] if peak[1] > high else None, None, period, high, low
    return peak[1], trough[1], peak[0] if peak[0] > 0 else None, outside, None, None, None


# a, b, v_i, v_f, k, m: the paper's material, stiffer and softer than critical, from above and below; a stable one, a light one.
V_F, MASS = 3.2e6, 2.5e-16
CASES = [
    (0.005, 0.01, 1e5, V_F, 0.02, MASS),
    (0.005, 0.01, 1e5, V_F, 0.009, MASS),
    (0.005, 0.01, 6.4e6, V_F, 0.012, MASS),
    (0.005, 0.01, 3e6, V_F, 0.05, MASS),
    (0.03, 0.01, 3.0, 100.0, 0.5, 1e-4),
    (0.03, 0.05, 3.0, 100.0, 0.2, 1e-6),
    (0.05, 0.02, 50.0, 20.0, 0.3, 1e-3),
    (0.02, 0.02, 2.0, 10.0, 0.5, 1e-3),
    (0.005, 0.01, 1e5, V_F, 7.5e-3, MASS),
    (0.005, 0.01, 1e5, V_F, 6e-3, MASS),
    (0.005, 0.01, 6.4e6, V_F, 5e-3, MASS),
    (0.03, 0.05, 50.0, 100.0, 0.02, 1e-6),
    (0.05, 0.06, 20.0, 100.0, 0.012, 1e-5),
]

if __name__ == "__main__":
    rows = []
    for a, b, v_i, v_f, k, m in CASES:
        inertia = mpfr(m) * mpfr(v_f) ** 2
        high, low, t_peak, settled, period, cycle_high, cycle_low = response(Block(a, b, inertia, k), mpfr(v_i) / mpfr(v_f))
        v, t = mpfr(v_f), 1 / mpfr(v_f)
        numbers = [high * v, low * v, t_peak and t_peak * t, settled if settled is None else settled * t, period and period * t,
                   cycle_high and cycle_high * v, cycle_low and cycle_low * v]
        rows.append([repr(x) for x in (a, b, v_i, v_f, k, m)] + ["" if x is None else "{0:.25g}".format(x) for x in numbers])
        print(*rows[-1], flush=True)
    with open("step_response_ends.csv", "w", newline="") as file:
        file.write("# made by generate_step_response_ends.py, Taylor series of order 32 at 36 digits\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["a", "b", "v_i", "v_f", "k", "m", "v_peak", "v_trough", "t_peak", "settling_time", "period", "cycle_peak", "cycle_trough"])
        out.writerows(rows)
