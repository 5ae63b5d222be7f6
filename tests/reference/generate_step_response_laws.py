#!/usr/bin/env python3
"""step_response_laws.csv: responses with the slip law and with that of Perrin, Rice and Zheng, by Taylor series at 36 digits.

    venv/bin/python generate_step_response_laws.py        (needs gmpy2; an hour)

The method is that of generate_step_response_ends.py: the unknowns are v, theta and s themselves. Without mass, ln v is the algebraic variable of
the force balance. A response without mass has diverged once q = ln(theta v) is so large that -G(u)/u >= k/(b - a): then q grows for ever. It is
followed on until v is 1e3 times the greatest v before, which must come.
"""
import csv
from gmpy2 import exp, log, mpfr, sinh

from generate_step_response_ends import ORDER, Block, response


class Diverged(Exception):
    pass


class LawBlock(Block):
    def __init__(self, law, *numbers):
        super().__init__(*numbers)
        self.law = law

    def series(self, start):
        """Taylor coefficients of v, theta and s about a state."""
        theta, s = [start[1]], [start[2]]
        ln_theta = [log(theta[0])]
        ln_v = [(self.k * s[0] - self.b * ln_theta[0]) / self.a if self.inertia == 0 else log(start[0])]
        v = [exp(ln_v[0]) if self.inertia == 0 else start[0]]
        u, zero = [], mpfr(0)
        for n in range(ORDER):
            m, unit = n + 1, 1 if n == 0 else 0
            u.append(sum((theta[i] * v[n - i] for i in range(m)), zero))
            if self.law == "slip":
                rate = -sum((u[i] * (ln_v[n - i] + ln_theta[n - i]) for i in range(m)), zero)
            else:
                rate = (unit - sum((u[i] * u[n - i] for i in range(m)), zero)) / 2
            force = self.k * s[n] - self.a * ln_v[n] - self.b * ln_theta[n]
            theta.append(rate / m)
            s.append((unit - v[n]) / m)
            ln_theta.append(logarithm(ln_theta, theta, m))
            if self.inertia == 0:
                ln_v.append((self.k * s[m] - self.b * ln_theta[m]) / self.a)
                v.append(sum((i * ln_v[i] * v[m - i] for i in range(1, m + 1)), zero) / m)
            else:
                v.append(force / self.inertia / m)
                ln_v.append(logarithm(ln_v, v, m))
        return v, theta, s

    def legs(self, state):
        top, certain = mpfr(0), False
        for leg in super().legs(state):
            _, u, _ = leg
            q = log(u[0][0]) + log(u[1][0])
            if certain and u[0][0] > 1000 * top:
                raise Diverged
            if self.inertia == 0 and self.b > self.a and not certain:
                certain = (q if self.law == "slip" else sinh(q)) >= self.k / (self.b - self.a)
                top = max(top, u[0][0])
            yield leg


def logarithm(ln_u, u, m):
    """Coefficient m of the logarithm of a series."""
    return (u[m] - sum((i * ln_u[i] * u[m - i] for i in range(1, m)), mpfr(0)) / m) / u[0]


# a, b, v_i, v_f, k, m: without mass, and with it; friction that weakens and strengthens; stiffer and softer than critical; up and down.
V_F, MASS = 3.2e6, 2.5e-16
CASES = [
    (0.01, 0.018, 60.0, 100.0, 0.01, 0.0),
    (0.01, 0.018, 80.0, 100.0, 0.012, 0.0),
    (0.01, 0.018, 30.0, 100.0, 0.024, 0.0),
    (0.01, 0.018, 200.0, 100.0, 0.01, 0.0),
    (0.01, 0.018, 10.0, 100.0, 0.0104, 0.0),
    (0.01, 0.018, 90.0, 100.0, 0.004, 0.0),
    (0.03, 0.05, 50.0, 20.0, 0.06, 0.0),
    (0.03, 0.05, 20.0, 100.0, 0.3, 0.0),
    (0.03, 0.01, 3.0, 100.0, 0.5, 0.0),
    (0.02, 0.02, 10.0, 2.0, 0.1, 0.0),
    (0.005, 0.01, 1e5, V_F, 0.02, MASS),
    (0.005, 0.01, 1e5, V_F, 0.009, MASS),
    (0.005, 0.01, 6.4e6, V_F, 0.012, MASS),
    (0.005, 0.01, 3e6, V_F, 0.05, MASS),
    (0.03, 0.01, 3.0, 100.0, 0.5, 1e-4),
    (0.03, 0.05, 3.0, 100.0, 0.2, 1e-6),
    (0.05, 0.02, 50.0, 20.0, 0.3, 1e-3),
    (0.02, 0.02, 2.0, 10.0, 0.5, 1e-3),
    (0.01, 0.05, 40.0, 100.0, 0.3, 1e-5),
    (0.03, 0.05, 200.0, 100.0, 0.05, 1e-5),
    (0.005, 0.01, 1e5, V_F, 7e-3, MASS),
    (0.005, 0.01, 1e5, V_F, 6e-3, MASS),
    (0.005, 0.01, 6.4e6, V_F, 5e-3, MASS),
    (0.03, 0.05, 50.0, 100.0, 0.02, 1e-6),
    (0.05, 0.06, 20.0, 100.0, 0.012, 1e-5),
    (0.02, 0.03, 30.0, 100.0, 0.015, 1e-5),
]


def row(law, a, b, v_i, v_f, k, m):
    v, t = mpfr(v_f), 1 / mpfr(v_f)
    axes = [law] + [repr(x) for x in (a, b, v_i, v_f, k, m)]
    try:
        numbers = response(LawBlock(law, a, b, mpfr(m) * v**2, k), mpfr(v_i) / v)
    except Diverged:
        return axes + ["diverged"] + [""] * 7
    units = (v, v, t, t, t, v, v)
    outcome = "settled" if numbers[4] is None else "limit_cycle"
    return axes + [outcome] + ["" if x is None else "{0:.25g}".format(x * unit) for x, unit in zip(numbers, units)]


if __name__ == "__main__":
    rows = []
    for law in ("slip", "prz"):
        for case in CASES:
            rows.append(row(law, *case))
            print(*rows[-1], flush=True)
    with open("step_response_laws.csv", "w", newline="") as file:
        file.write("# made by generate_step_response_laws.py, Taylor series of order 32 at 36 digits\n")
        out = csv.writer(file, lineterminator="\n")
        names = ["v_peak", "v_trough", "t_peak", "settling_time", "period", "cycle_peak", "cycle_trough"]
        out.writerow(["law", "a", "b", "v_i", "v_f", "k", "m", "outcome", *names])
        out.writerows(rows)
