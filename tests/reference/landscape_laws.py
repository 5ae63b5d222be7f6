"""Cubic shortcuts under the slip law and that of Perrin, Rice and Zheng, at 40 digits, from the definitions.

    python landscape_laws.py > landscape_laws.csv      # mpmath, an hour; a law as argument for its rows alone

Works are integrals of tau v over time by tanh-sinh quadrature between the places where theta, theta' or v are extreme, and towards these places in
decades. Least velocities are at the ends or at zeros of dv/dx. Least works are those of relaxed.py. Rows near the border have theta or the distance of
theta' from its bound reduced to a fraction from 1e-3 to 1e-11 of that of the straight line.
"""

import random
import sys

from mpmath import exp, findroot, lambertw, log, mp, mpf, nstr, polyroots, quad, sqrt

import relaxed

COUNT = {"inside": 64, "border": 24, "infeasible": 8}
FASTEST = {"slip": lambda: exp(-1), "prz": lambda: mpf(1) / 2}


def at(c, x):
    return sum(c * x**i for i, c in enumerate(c))


def slope(c):
    return [i * x for i, x in enumerate(c)][1:]


def turns(c):
    """Zeros of the slope of a polynomial in (0, 1)."""
    c = slope(c)
    while c and abs(c[-1]) < mpf(10) ** -60:
        c = c[:-1]
    roots = polyroots(c[::-1], maxsteps=500, extraprec=400) if len(c) > 1 else []
    return [r.real for r in map(mp.mpc, roots) if abs(r.imag) < mpf(10) ** -25 and 0 < r.real < 1]


class Shortcut:
    def __init__(self, law, t_f, a, b, v_i, v_f, a_2, a_3):
        self.law, (self.t_f, self.a, self.b) = law, map(mpf, (t_f, a, b))
        theta_0, theta_1 = 1 / mpf(v_i), 1 / mpf(v_f)
        self.theta = [theta_0, mpf(a_2), mpf(a_3), theta_1 - theta_0 - mpf(a_2) - mpf(a_3)]
        self.rate = [x / self.t_f for x in slope(self.theta)]
        self.turns = turns(self.theta) + turns(self.rate)

    def slack(self):
        """Least theta, and least distance of theta' from the fastest rise."""
        places = [mpf(0), mpf(1)] + self.turns
        return min(at(self.theta, x) for x in places), min(FASTEST[self.law]() - at(self.rate, x) for x in places)

    def v(self, x):
        rate = at(self.rate, x)
        u = exp(lambertw(-rate).real) if self.law == "slip" else sqrt(1 - 2 * rate)
        return u / at(self.theta, x)

    def friction(self, x):
        return 1 + self.a * log(self.v(x)) + self.b * log(at(self.theta, x))

    def decades(self):
        places = {mpf(0), mpf(1), *self.turns}
        # Zeros of theta and of the distance of theta' from its bound are no closer than their least values, relatively.
        theta, rate = self.slack()
        depth = 2 - int(mp.log10(min(theta / sum(map(abs, self.theta)), rate, 1)))
        near = {x + s * mpf(10) ** -j for x in places for s in (-1, 1) for j in range(1, min(depth, 9))}
        return sorted(places | {x for x in near if 0 < x < 1})

    def least(self, f):
        """The least value of a function of x, a stationary one to all digits."""
        grid = sorted({mpf(i) / 200 for i in range(201)} | set(self.decades()))
        values = [f(x) for x in grid]
        i = min(range(len(grid)), key=lambda i: values[i])
        if 0 < i < len(grid) - 1:
            low, high = grid[i - 1], grid[i + 1]
            for _ in range(120):
                x, y = low + (high - low) * mpf("0.382"), low + (high - low) * mpf("0.618")
                low, high = (low, y) if f(x) < f(y) else (x, high)
            return f((low + high) / 2)
        return values[i]

    def work(self):
        knots = self.decades()
        value, error = quad(lambda x: self.friction(x) * self.v(x), knots, error=True)
        assert error < mpf(10) ** -22 * abs(value), error
        return self.t_f * value


def log_uniform(rng, low, high):
    return float("%.6g" % (low * (high / low) ** rng.random()))


def draw(rng, law):
    a = log_uniform(rng, 1e-3, 0.2)
    b = float("%.6g" % (a * rng.choice([0, 0.5, 1, 1.5, 3])))
    v_i, v_f = (log_uniform(rng, 1.1, 10 ** rng.choice([1, 2, 4])) for _ in range(2))
    v_ceiling = float("%.6g" % (max(v_i, v_f) * log_uniform(rng, 1.5, 1e3)))
    c = FASTEST[law]()
    rise = 1 / v_f - 1 / v_i
    t_f = float("%.6g" % (max(rise / c, 0) * (1 + log_uniform(rng, 1e-2, 10)) + log_uniform(rng, 1e-1, 1e3) / max(v_i, v_f)))
    size = max(1 / v_i, 1 / v_f) + t_f * float(c)
    a_2, a_3 = (float("%.6g" % (size * rng.uniform(-1, 1))) for _ in range(2))
    return t_f, a, b, v_i, v_f, v_ceiling, a_2, a_3


def to_border(rng, law, case):
    """The case on its ray from the straight line, close to the border."""
    t_f, a, b, v_i, v_f, v_ceiling, a_2, a_3 = case
    rise = 1 / v_f - 1 / v_i
    place = lambda s: (float(rise + s * (a_2 - rise)), float(s * a_3))
    slack = lambda s: min(x / y for x, y in zip(Shortcut(law, t_f, a, b, v_i, v_f, *place(s)).slack(), first))
    first = Shortcut(law, t_f, a, b, v_i, v_f, *place(0)).slack()
    if min(first) <= 0:
        return None
    target = mpf(10) ** -rng.uniform(3, 11)
    low, high = mpf(0), mpf(1)
    while slack(high) > target:
        high *= 2
    for _ in range(200):
        s = (low + high) / 2
        low, high = (s, high) if slack(s) > target else (low, s)
    return (t_f, a, b, v_i, v_f, v_ceiling, *place(low))


def rows(law):
    rng = random.Random(20 if law == "slip" else 21)
    made = {regime: 0 for regime in COUNT}
    first = (0.4, 0.03, 0.05, 4.0, 80.0, 600.0, 0.1, -0.5)
    while made != COUNT:
        case, first = first or draw(rng, law), None
        border = made["inside"] == COUNT["inside"] and made["border"] < COUNT["border"]
        case = to_border(rng, law, case) if border else case
        if case is None:
            continue
        t_f, a, b, v_i, v_f, v_ceiling, a_2, a_3 = case
        shortcut = Shortcut(law, t_f, a, b, v_i, v_f, a_2, a_3)
        slack = min(shortcut.slack())
        regime = "infeasible" if slack <= 0 else "border" if border else "inside"
        if made[regime] == COUNT[regime] or 0 < slack < mpf(10) ** -14:
            continue
        numbers = [None] * 5
        if slack > 0:
            friction = shortcut.least(shortcut.friction)
            if abs(friction) < mpf("1e-6"):
                continue
            mp.dps = 30
            try:
                optimum = relaxed.solve(law, a, b, v_i, v_f, t_f, v_ceiling)
            except (AssertionError, ZeroDivisionError):  # no proof, or closer to steady sliding than the digits show
                continue
            finally:
                mp.dps = 40
            if "work" not in optimum:
                continue
            numbers = [shortcut.work(), shortcut.least(shortcut.v), optimum["work"], friction, -shortcut.least(lambda x: -shortcut.v(x))]
        made[regime] += 1
        text = ["" if x is None else nstr(x, 25) for x in numbers]
        v_min, friction = numbers[1], numbers[3]
        status = "infeasible" if slack <= 0 else "negative_friction" if friction < 0 else "below_bound" if v_min < 1 else "ok"
        yield [law, regime] + [repr(x) for x in case] + text[:3] + [status, text[4]]


if __name__ == "__main__":
    mp.dps = 40
    print("# made by landscape_laws.py, mpmath at 40 digits, W* at 30")
    print("law,regime,t_f,a,b,v_i,v_f,v_ceiling,a_2,a_3,work,v_min,work_optimal,status,v_max")
    for law in sys.argv[1:] or FASTEST:
        for row in rows(law):
            print(",".join(row), flush=True)
