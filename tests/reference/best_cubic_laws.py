"""Cubic shortcuts of least work under the slip law and that of Perrin, Rice and Zheng.

    python best_cubic_laws.py > best_cubic_laws.csv      # mpmath, numpy, scipy; half an hour; a law as argument for its rows alone

A shortcut has the slopes p and q of theta at both ends. For each q the admissible p are an interval, by bisection. Samples of the whole set, and then
finer and finer ones around the least work, find the minimum in double precision, and the places where v = 1 (or theta' is the fastest rise) there. The
equations of these places are solved again at 30 digits; where only one is active, differences along it locate the minimum. Works are those of
landscape_laws.py, least works those of relaxed.py.
"""

import random
import sys

import numpy as np
from mpmath import e, exp, findroot, log, mp, mpf, nstr, quad
from scipy.special import lambertw

import landscape_laws
import relaxed

# Rows of the slip law cost most.
COUNT = {"slip": 9, "prz": 28}
FASTEST = {"slip": float(np.exp(-1)), "prz": 0.5}

# Tanh-sinh nodes.
STEPS = np.linspace(-2.7, 2.7, 161)
NODES = 0.5 + 0.5 * np.tanh(np.pi / 2 * np.sinh(STEPS))
WEIGHTS = (STEPS[1] - STEPS[0]) * np.pi / 4 * np.cosh(STEPS) / np.cosh(np.pi / 2 * np.sinh(STEPS)) ** 2
PLACES = np.linspace(0, 1, 401)


def lack(law, theta):
    """The least 1 - theta'/c at which v >= 1."""
    if law == "prz":
        return theta * theta
    e_u = np.maximum(np.e * theta, 1)
    return e_u * np.log(e_u) - e_u + 1


class Sampled:
    """Shortcuts of one transition in double precision, by the slopes of theta at both ends."""

    def __init__(self, law, t_f, a, b, v_i, v_f):
        self.case = law, t_f, a, b, v_i, v_f
        self.rise, self.time = 1 / v_f - 1 / v_i, FASTEST[law] * t_f

    def cubic(self, p, q):
        return 1 / self.case[4], p, 3 * self.rise - 2 * p - q, p + q - 2 * self.rise

    def theta(self, p, q, x):
        c = self.cubic(p, q)
        return c[0] + x * (c[1] + x * (c[2] + x * c[3])), c[1] + x * (2 * c[2] + x * 3 * c[3])

    def excess(self, p, q, x=PLACES):
        theta, slope = self.theta(p, q, x)
        return np.where(theta > 0, 1 - slope / self.time - lack(self.case[0], np.maximum(theta, 0)), -1 + np.minimum(theta, 0))

    def least(self, p, q):
        """The place of the least excess, by a parabola between samples, and the excess there."""
        excess = self.excess(p, q)
        i = np.argmin(excess)
        if 0 < i < len(excess) - 1:
            low, middle, high = excess[i - 1 : i + 2]
            bend = low - 2 * middle + high
            if bend > 0:
                x = PLACES[i] + 0.5 * (low - high) / bend * (PLACES[1] - PLACES[0])
                return x, min(float(self.excess(p, q, x)), middle)
        return PLACES[i], excess[i]

    def admits(self, p, q):
        return self.least(p, q)[1] >= 0

    def work(self, p, q):
        law, t_f, a, b, v_i, v_f = self.case
        theta, slope = self.theta(p, q, NODES)
        d = np.maximum(1 - slope / self.time, 1e-300)
        u = np.sqrt(d) if law == "prz" else np.exp(lambertw((d - 1) / np.e).real)
        with np.errstate(all="ignore"):
            work = t_f * np.sum(WEIGHTS * (1 + a * np.log(u / theta) + b * np.log(theta)) * u / theta)
        return work if np.isfinite(work) else np.inf

    def cheapest_of_random(self, p, q, count=6000):
        """The least work of random admissible points, half of them near p and q. 1 - theta'/c is a quadratic, not negative, so at both ends it is at most four times its mean."""
        rng, size = random.Random(1), self.time - self.rise
        points = [[self.time - 4 * size * rng.random() for _ in range(2)] for _ in range(count)]
        points += [[y + 0.02 * size * rng.uniform(-1, 1) for y in (p, q)] for _ in range(count)]
        return min((self.work(*point) for point in points if self.admits(*point)), default=np.inf)

    def inside(self):
        """An admissible point: the largest least excess, by a simplex; None if it is not positive."""
        from scipy.optimize import minimize

        size = self.time - self.rise
        best = None
        for start in ([0, 0], [size / 2, -size / 2], [-size / 2, size / 2], [-size, -size]):
            point = self.rise + np.array(start)
            found = minimize(lambda y: -self.excess(*y).min(), point, method="Nelder-Mead", options={"maxiter": 800, "xatol": 1e-9 * size, "fatol": 1e-12})
            best = found if best is None or found.fun < best.fun else best
        return best.x if best.fun < -1e-6 else None

    def end(self, at, low, high):
        """Where at(s), admissible at low, stops to be admissible: the least excess is concave in s, so Newton's method comes from beyond."""
        s = high
        while self.admits(*at(s)):
            s = low + 2 * (s - low)
        for _ in range(60):
            (x, excess), h = self.least(*at(s)), 1e-6 * (s - low)
            slope = (self.excess(*at(s + h), x) - self.excess(*at(s - h), x)) / (2 * h)
            step = -excess / slope if slope else 0
            if not abs(step) > 1e-14 * abs(s - low):
                break
            s += step
        inwards = 1e-14
        while not self.admits(*at(s)) and inwards < 1:
            s = low + (s - low) * (1 - inwards)
            inwards *= 2
        return s

    def minimum(self):
        """The least work, with p and q."""
        inside = self.inside()
        if inside is None:
            return None
        size = self.time - self.rise
        # A line of admissible points from the least to the greatest q: p is linear in q between the middles of the set.
        interval = lambda q, p: [self.end(lambda s: (s, q), p, p + sign * size) for sign in (-1, 1)]
        p, q = inside
        spine = [(q, p)]
        for sign in (-1, 1):
            p, q = inside
            for _ in range(60):
                low, high = interval(q, p)
                p = (low + high) / 2
                reach = self.end(lambda s: (p, s), q, q + sign * size)
                spine.append((reach, p))
                if abs(reach - q) < 1e-7 * size:
                    break
                q = q + 0.7 * (reach - q)
                spine.append((q, p))
        spine = sorted(spine)
        qs, ps = np.array(spine).T

        def sample(q, fraction):
            q = min(max(q, qs[0]), qs[-1])
            p = np.interp(q, qs, ps)
            if not self.admits(p, q):
                return np.inf, p, q
            low, high = interval(q, p)
            p = low + fraction * (high - low)
            return self.work(p, q), p, q

        middle, width = [0.5 * (qs[0] + qs[-1]), 0.5], [0.5 * (qs[-1] - qs[0]), 0.5]
        count = 33
        best = (np.inf, None, None)
        while width[0] > 1e-6 * (qs[-1] - qs[0]):
            rows = []
            for q in middle[0] + width[0] * np.cos(np.pi * np.arange(count) / (count - 1)):
                for fraction in np.clip(middle[1] + width[1] * np.cos(np.pi * np.arange(count) / (count - 1)), 0, 1):
                    rows.append((*sample(q, fraction), fraction))
            least = min(rows, key=lambda row: row[0])
            best = min(best, least[:3], key=lambda row: row[0])
            middle = [least[2], least[3]]
            width = [w * (0.2 if count == 33 else 0.45) for w in width]
            count = 9
        return best


def exact_lack(law, theta):
    if law == "prz":
        return theta * theta, 2 * theta
    e_u = e * theta
    return (e_u * log(e_u) - e_u + 1, e * log(e_u)) if e_u > 1 else (mpf(0), mpf(0))


class Touching(landscape_laws.Shortcut):
    """A shortcut whose rate may touch the fastest rise, up to rounding."""

    def slack(self):
        theta, rate = super().slack()
        return theta, max(rate, mpf(10) ** -9)

    def work(self):
        value, error = quad(lambda x: self.friction(x) * self.v(x), self.decades(), error=True)
        assert error < mpf(10) ** -13 * abs(value), error
        return self.t_f * value

    def v(self, x):
        if self.law == "slip" and landscape_laws.at(self.rate, x) > exp(-1):
            return exp(-1) / landscape_laws.at(self.theta, x)
        return super().v(x)


class Exact:
    """Shortcuts of one transition at the precision of mpmath, by the slopes of theta at both ends."""

    def __init__(self, law, t_f, a, b, v_i, v_f):
        self.case = law, t_f, a, b, v_i, v_f
        self.rise = 1 / mpf(v_f) - 1 / mpf(v_i)
        self.time = mpf(t_f) * (exp(-1) if law == "slip" else mpf(1) / 2)

    def coefficients(self, p, q):
        return p, 3 * self.rise - 2 * p - q

    def excess(self, p, q, x):
        """The excess and its derivative by x."""
        c = [1 / mpf(self.case[4]), p, 3 * self.rise - 2 * p - q, p + q - 2 * self.rise]
        theta, slope = c[0] + x * (c[1] + x * (c[2] + x * c[3])), c[1] + x * (2 * c[2] + x * 3 * c[3])
        least, rate = exact_lack(self.case[0], theta)
        return 1 - slope / self.time - least, -(2 * c[2] + 6 * c[3] * x) / self.time - rate * slope

    def work(self, p, q):
        law, t_f, a, b, v_i, v_f = self.case
        return Touching(law, t_f, a, b, v_i, v_f, *self.coefficients(p, q)).work()

    def equations(self, active, p, q, inner):
        """The conditions of the active places; inner ones are touched."""
        inner, values = list(inner), []
        for x in active:
            if x in (0, 1):
                values.append(self.excess(p, q, mpf(x))[0])
            else:
                values += self.excess(p, q, inner.pop(0))
        return values

    def corner(self, active, p, q):
        inner = [mpf(x) for x in active if x not in (0, 1)]
        found = findroot(lambda *y: self.equations(active, y[0], y[1], y[2:]), (mpf(p), mpf(q), *inner), tol=mpf(10) ** -45)
        return found[0], found[1]

    def edge(self, active, p, q, size):
        """The minimum along one active condition, and whether it is one."""
        inner = [mpf(x) for x in active if x not in (0, 1)]
        x = mpf(active[0])
        p, q = mpf(p), mpf(q)
        # A direction along the condition, by differences at its place.
        h = mpf(10) ** -12 * size
        across = [(self.excess(p + h, q, x)[0] - self.excess(p - h, q, x)[0]), (self.excess(p, q + h, x)[0] - self.excess(p, q - h, x)[0])]
        length = mp.sqrt(across[0] ** 2 + across[1] ** 2)
        across = [k / length for k in across]
        along = [-across[1], across[0]]

        def at(s):
            to = lambda *y: self.equations(active, p + s * along[0] + y[0] * across[0], q + s * along[1] + y[0] * across[1], y[1:])
            y = findroot(to, (mpf(0), *inner), tol=mpf(10) ** -45) if inner else [findroot(lambda y: to(y)[0], mpf(0), tol=mpf(10) ** -45)]
            return p + s * along[0] + y[0] * across[0], q + s * along[1] + y[0] * across[1]

        h = mpf(10) ** -3 * size
        works = [self.work(*at(k * h)) for k in (-2, -1, 0, 1, 2)]
        slope = (works[0] - 8 * works[1] + 8 * works[3] - works[4]) / 12
        bend = (16 * (works[1] + works[3]) - works[0] - works[4] - 30 * works[2]) / 12
        return at(-slope / bend * h), bend > 0 and abs(slope / bend) < 1e-2


def active_places(sampled, p, q):
    """The places where the excess vanishes at the minimum in double precision: 0, 1 and local minima inside."""
    x = np.linspace(0, 1, 20001)
    excess = sampled.excess(p, q, x)
    scale = np.abs(excess).max()
    near = lambda value: value < 1e-5 * scale
    inner = [x[i] for i in range(1, len(x) - 1) if excess[i] <= excess[i - 1] and excess[i] < excess[i + 1] and near(excess[i])]
    return [0] * bool(near(excess[0])) + [k for k in inner if 1e-4 < k < 1 - 1e-4] + [1] * bool(near(excess[-1]))


def solve(law, t_f, a, b, v_i, v_f):
    """The minimum with its place; None where there is none, or where it is not clear."""
    sampled = Sampled(law, t_f, a, b, v_i, v_f)
    found = sampled.minimum()
    if found is None:
        return None
    least, p, q = found
    if not np.isfinite(least) or least <= 0:
        return None
    size = mpf(sampled.time - sampled.rise)
    active, exact = active_places(sampled, p, q), Exact(law, t_f, a, b, v_i, v_f)
    try:
        if len(active) == 2:
            p, q = exact.corner(active, p, q)
        elif len(active) == 1:
            (p, q), is_minimum = exact.edge(active, p, q, size)
            if not is_minimum:
                return None
        else:
            return None
    except (ValueError, ZeroDivisionError, AssertionError) as error:
        print(law, t_f, a, b, v_i, v_f, active, repr(error)[:200], file=sys.stderr)
        return None
    work = exact.work(p, q)
    # The samples are neither better nor worse.
    if not abs(mpf(least) - work) < mpf(1e-5) * work:
        print(law, t_f, a, b, v_i, v_f, "samples", least, "exact", nstr(work, 12), active, file=sys.stderr)
        return None
    # The line through the middles may miss a part of the set: then a random point costs less.
    if sampled.cheapest_of_random(float(p), float(q)) < work * (1 - mpf(10) ** -9):
        return None
    return exact.coefficients(p, q), work, active


def rows(law):
    rng = random.Random(22 if law == "slip" else 23)
    made, first = 0, (0.1, 0.03, 0.05, 4.0, 80.0, 600.0, 0, 0)
    while made < COUNT[law]:
        case, first = first or landscape_laws.draw(rng, law), None
        t_f, a, b, v_i, v_f, v_ceiling = case[:6]
        try:
            optimum = relaxed.solve(law, a, b, v_i, v_f, t_f, v_ceiling)
        except (AssertionError, ZeroDivisionError):
            continue
        if "work" not in optimum:
            continue
        found = solve(law, t_f, a, b, v_i, v_f)
        if found is None:
            continue
        (a_2, a_3), work, active = found
        shortcut = Touching(law, t_f, a, b, v_i, v_f, a_2, a_3)
        if shortcut.least(shortcut.friction) <= 0:
            continue
        v_min = mpf(1) if any(abs(shortcut.v(mpf(x)) - 1) < 1e-3 for x in active) else shortcut.least(shortcut.v)
        made += 1
        regime = "corner" if len(active) == 2 else "edge"
        v_max = -shortcut.least(lambda x: -shortcut.v(x))
        numbers = [a_2, a_3, work, optimum["work"], (work - optimum["work"]) / optimum["work"], v_min, v_max]
        yield [law, regime] + [repr(x) for x in case[:6]] + [nstr(x, 25) for x in numbers]


if __name__ == "__main__":
    mp.dps = 30
    print("# made by best_cubic_laws.py, mpmath at 30 digits")
    print("law,regime,t_f,a,b,v_i,v_f,v_ceiling,a_2,a_3,work,work_optimal,gap,v_min,v_max")
    for law in sys.argv[1:] or FASTEST:
        for row in rows(law):
            print(",".join(row), flush=True)
