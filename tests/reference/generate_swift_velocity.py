#!/usr/bin/env python3
"""Reference table of the families step, cubic and bounded_velocity.

    venv/bin/python generate_swift_velocity.py          # or name the families; about an hour

Arithmetic: 40 digits and more where differences cancel; work and friction of bounded_velocity are good to 16. step and cubic are tanh-sinh
quadratures of their formulas. The slip of bounded_velocity is in closed form (error functions, Dawson's integral), theta a Gauss quadrature, 96
nodes a cut, of the solution of theta' = 1 - theta v, its parameter a bracketed root. Work is a quadrature of 48 nodes over such quadratures, cut
where the velocity or theta changes; a row in which 24 nodes disagree is left out. Extrema: the greatest of a grid, then a root of the derivative.
No collocation, no dilogarithm. Inputs are doubles, written by repr and used exactly; a time near t_min counts as the double that it is.
"""
import csv, math, random, sys
from mpmath.calculus.quadrature import GaussLegendre
from mpmath import erf, erfc, erfi, exp, findroot, log, log1p, mp, mpf, nstr, pi, quad, sqrt

DIGITS = 40
# Of theta, work and friction of bounded_velocity; the arguments of their exponentials have more.
DECIMALS = 18
HEADER = ["family", "a", "b", "v_i", "v_f", "t_f", "alpha", "work", "v_min", "v_max", "friction_max", "miss", "status"]


def show(x):
    return "" if x is None else nstr(x, 25, strip_zeros=False)


def greatest(f, places):
    """The greatest value of f, from samples at rising places and golden sections about the best of them."""
    values = [f(x) for x in places]
    order = sorted(range(len(places)), key=lambda i: -values[i])
    best = values[order[0]]
    for i in order[:2]:
        low, high = places[max(i - 1, 0)], places[min(i + 1, len(places) - 1)]
        ratio = (sqrt(5) - 1) / 2
        x1, x2 = high - ratio * (high - low), low + ratio * (high - low)
        f1, f2 = f(x1), f(x2)
        for _ in range(75):
            if f1 > f2:
                high, x2, f2 = x2, x1, f1
                x1 = high - ratio * (high - low)
                f1 = f(x1)
            else:
                low, x1, f1 = x1, x2, f2
                x2 = low + ratio * (high - low)
                f2 = f(x2)
        best = max(best, f1, f2)
    return best


def both_ends(depth, count):
    """Cuts of [0, 1] that crowd at both ends, to 10^-depth, as pairs of exact distances."""
    steps = [mpf(10) ** (-depth + mpf(i) * depth / count) / 2 for i in range(count + 1)]
    return [mpf(0)] + steps + [1 - s for s in reversed(steps[:-1])] + [mpf(1)]


def step(a, b, v_i, v_f, t_f):
    theta = lambda t: 1 / v_f + (1 / v_i - 1 / v_f) * exp(-v_f * t)
    tau = lambda t: 1 + a * log(v_f) + b * log(theta(t))
    end = v_f * t_f
    cuts = [mpf(0)] + [c for c in (mpf(10) ** i for i in range(-12, 0)) if c < end / 2]
    cuts += [c for c in (1, 2, 4, 7, 10, 14, 18, 22, 28, 36, 50, 80, 160, 400, 1000, 10**4) if c < end * 0.9] + [end]
    # Beyond that theta has arrived to more than the digits wanted.
    work = quad(lambda p: tau(p / v_f), [c for c in cuts if c <= 160 or c == end] if end <= 160 else [c for c in cuts if c <= 160])
    if end > 160:
        work += (end - 160) * (1 + (a - b) * log(v_f))
    return None, work, v_f, v_f, max(tau(mpf(0)), tau(t_f)), (v_f / v_i - 1) * exp(-end), "ok"


def cubic(a, b, v_i, v_f, t_f):
    d = v_f - v_i
    theta = lambda x: (v_f - 3 * d * x**2 + 2 * d * x**3) / (v_i * v_f)
    slope = lambda x: (-6 * d * x + 6 * d * x**2) / (v_i * v_f * t_f)
    v = lambda x: (1 - slope(x)) / theta(x)
    if slope(mpf(1) / 2) >= 1:
        return (None,) * 6 + ("infeasible",)
    tau = lambda x: 1 + a * log(v(x)) + b * log(theta(x))
    cuts = both_ends(20, 24)
    fine = sorted(set(both_ends(20, 120) + [mpf(i) / 100 for i in range(1, 100)]))
    work = t_f * quad(lambda x: tau(x) * v(x), cuts)
    v_min, v_max = -greatest(lambda x: -v(x), fine), greatest(v, fine)
    return None, work, v_min, v_max, greatest(tau, fine), mpf(0), "ok" if v_min >= 1 else "below_bound"


class Bounded:
    """v = 1 + w_i exp(L x - c x (1 - x))."""

    def __init__(self, v_i, v_f, t_f, c):
        self.v_i, self.v_f, self.t_f, self.c = v_i, v_f, t_f, c
        self.l = log((v_f - 1) / (v_i - 1))
        self.top, self.root = (self.l - c) / (2 * c), sqrt(abs(c))
        self.peak = (v_i - 1) * exp(-c * self.top**2) * sqrt(pi) / (2 * self.root) if c < 0 else None

    def w(self, x):
        return (self.v_f - 1) * exp(-(1 - x) * (self.l + self.c * x))

    def area(self, x, y):
        """int_x^y w dx in closed form: error functions for c < 0, Dawson's integral for c > 0."""
        root, peak = self.root, self.peak
        p, q = root * (x + self.top), root * (y + self.top)
        if self.c > 0:
            return (self.w(y) * dawson(q) - self.w(x) * dawson(p)) / root
        if p > 0:
            return peak * (erfc(p) - erfc(q))
        return peak * (erfc(-q) - erfc(-p) if q < 0 else erf(q) - erf(p))

    def slip(self, x, y):
        return self.t_f * (y - x + self.area(x, y))

    def theta(self, x, coarse=None, start=None):
        """Solution of theta' = 1 - theta v at x from a start, cut at a few slips before x; more than 60 before leaves nothing."""
        first, before = start or (mpf(0), 1 / self.v_i)
        if x == first:
            return before
        whole = self.slip(first, x)
        cuts, least = [x], first
        for target in (60, 20, 6, 2):
            if whole > target:
                low, high = least, x
                guess = max(low, x - target / (self.t_f * (1 + self.w(x))))
                for k in range(40):
                    middle = guess if k == 0 and low < guess < high else (low + high) / 2
                    slip = self.slip(middle, x)
                    low, high = (middle, high) if slip > target else (low, middle)
                    if target <= self.slip(low, x) < 1.3 * target:
                        break
                if target == 60:
                    least = low
                cuts.append(low)
        cuts += [least] + [c for c in self.layers() if least < c < x]
        # In the distance before x, which may be tiny: only the slip needs all digits.
        digits = mp.dps

        def share(r):
            with mp.workdps(digits):
                return exp(-self.slip(x - r, x))

        with mp.workdps(coarse or digits):
            places = sorted(x - c for c in set(cuts))
            value = self.t_f * gauss(share, places, 5 if coarse else 6)
        return value + (exp(-whole) * before if least == first else 0)

    def layers(self):
        """Where the exponent of w has risen from its ends and vertex by a few, and nine places between."""
        c, places = self.c, {mpf(i) / 10 for i in range(1, 10)}
        first, last = abs(self.l - c), abs(self.l + c)
        for k in (2, 10, 40):
            for x in (k / first, 1 - k / last):
                if 0 < x < 1:
                    places.add(x)
        top = mpf(1) / 2 - self.l / (2 * c)
        if 0 < top < 1 and c < 0:
            for k in (0, 1, 3, 6, 9):
                places.update(x for x in (top - k / sqrt(-c), top + k / sqrt(-c)) if 0 < x < 1)
        return sorted(places)


def gauss(f, places, degree=5):
    """Gauss-Legendre with 3 2^(degree - 1) nodes between each two places."""
    if (degree, mp.prec) not in RULES:
        RULES[degree, mp.prec] = GaussLegendre(mp).calc_nodes(degree, mp.prec + 20)
    total = mpf(0)
    for low, high in zip(places, places[1:]):
        half, middle = (high - low) / 2, (high + low) / 2
        total += half * sum(w * f(middle + half * x) for x, w in RULES[degree, mp.prec])
    return total


RULES = {}


def dawson(q):
    """exp(-q^2) int_0^q exp(s^2) ds."""
    if abs(q) < 12:
        return sqrt(pi) / 2 * exp(-q * q) * erfi(q)
    term, total, k = 1 / (2 * q), mpf(0), 0
    while abs(term) > abs(total) * mpf(10) ** (-mp.dps - 2):
        total += term
        k += 1
        term *= (2 * k - 1) / (2 * q * q)
    return total


def bounded_velocity(a, b, v_i, v_f, t_f):
    t_min = log(v_f / v_i) + log((v_i - 1) / (v_f - 1))
    if t_f <= t_min:
        return (None,) * 6 + ("infeasible",)
    spare = t_f - t_min
    l = log((v_f - 1) / (v_i - 1))
    # Digits that the layers and the slip cost.
    layer = max(log(t_f / spare) / log(10), 0)
    lost = max(log((v_i + v_f) * t_f) / log(10), 0)
    mp.dps = int(24 + 2 * layer + 2 * lost)

    # How much less than along v = 1 theta is at the end, as an exponent; nearly exponential or inverse in c.
    free = 1 - (1 - 1 / v_i) * exp(-t_f)
    required = log(free * v_f)

    def miss(c):
        return -log(-log(Bounded(v_i, v_f, t_f, c).theta(mpf(1)) / free) / required)

    # theta(t_f) rises with c: a bracket, a few bisections of c or its logarithm, then the Illinois method.
    low, high = -max(abs(l), mpf(1)) / 2, max(abs(l), mpf(1)) / 2 + mpf("0.01")
    if spare < t_f / 100:
        low, high = t_f / spare / 2, 8 * t_f / spare
    f_low, f_high = miss(low), miss(high)
    while f_low > 0:
        low *= mpf("1.7")
        f_low = miss(low)
    while f_high < 0:
        high *= mpf("1.7")
        f_high = miss(high)
    side = 0
    for step in range(80):
        x = (low * f_high - high * f_low) / (f_high - f_low) if step > 2 else (low + high) / 2
        f = miss(x)
        if f < 0:
            change = x - low
            low, f_low = x, f
            f_high /= 2 if side < 0 else 1
            side = -1
        else:
            change = high - x
            high, f_high = x, f
            f_low /= 2 if side > 0 else 1
            side = 1
        if f == 0 or high - low <= abs(x) * mpf(10) ** -19 or abs(change) <= abs(x) * mpf(10) ** -20:
            break
    else:
        raise ArithmeticError("no root")
    c = x
    curve = Bounded(v_i, v_f, t_f, c)
    mp.dps = int(20 + 2 * layer + lost)
    v = lambda x: 1 + curve.w(x)

    fine = mp.dps

    def tau(x, start=None):
        with mp.workdps(fine):
            return 1 + a * log(v(x)) + b * log(curve.theta(x, DECIMALS, start))

    def rise(x):
        w, theta = curve.w(x), curve.theta(x, DECIMALS)
        return a * (l - c + 2 * c * x) * w / (1 + w) / t_f + b * (1 / theta - 1 - w)

    cuts = {mpf(0), mpf(1), *curve.layers()}
    # The relaxation of theta at the start; at v = 1 theta grows from 1/v_i by itself, and ln theta like a logarithm.
    for slip in [mpf("0.3"), 3, 12, 30] + [4**k for k in range(3, 20) if spare < t_f / 2]:
        x = slip / (v_i * t_f)
        if x < mpf("0.1"):
            cuts.add(x)
    def work_between(low, high, degree):
        start = (low, curve.theta(low, DECIMALS))

        def power(x):
            with mp.workdps(fine):
                return tau(x, start) * v(x)

        def power_before_end(z):
            with mp.workdps(fine):
                return power(1 - z)

        # Layers at the end are narrow beside x: in the distance from the nearer end.
        late = high > mpf(1) / 2
        ends = (1 - high, 1 - low) if late else (low, high)
        with mp.workdps(DECIMALS):
            return t_f * gauss(power_before_end if late else power, ends, degree)

    cuts = sorted(cuts)
    rough, work = (sum(work_between(low, high, degree) for low, high in zip(cuts, cuts[1:])) for degree in (4, 5))
    assert abs(rough - work) < mpf(10) ** -10 * abs(work), (rough, work)
    places = sorted(set(cuts) | {mpf(i) / 20 for i in range(21)})
    values = [tau(x) for x in places]
    best = max(range(len(places)), key=lambda i: values[i])
    friction_max = values[best]
    left = rise(places[best]) < 0
    if 0 < best < len(places) - 1 or (best == 0) != left:
        low, high = (places[best - 1], places[best]) if left else (places[best], places[best + 1])
        if rise(low) > 0 > rise(high):
            x = findroot(rise, (low, high), solver="anderson", tol=mpf(10) ** -24, verify=False)
            friction_max = max(friction_max, tau(x))
    top = mpf(1) / 2 - l / (2 * c)
    velocities = [v_i, v_f] + ([v(top)] if 0 < top < 1 else [])
    return c / t_f**2, work, min(velocities), max(velocities), friction_max, mpf(0), "ok"


FAMILIES = {"step": step, "cubic": cubic, "bounded_velocity": bounded_velocity}


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def cases(family, rng, random_rows):
    paper = [(0.03, 0.05, 3.0, 100.0, t) for t in (0.02, 0.037, 0.049)]
    yield from paper
    yield from [(0.03, 0.05, 100.0, 3.0, 0.5)]
    ends = [(1.001, 1e8), (1e8, 1.001), (1e8, 1e7), (1e7, 1e8), (1.001, 1.01), (1.01, 1.001), (3.0, 3.000003), (3.000003, 3.0)]
    for v_i, v_f in ends:
        for share in (1e-6, 1.0, 1e3):
            yield (0.03, 0.05, v_i, v_f, share / v_f)
    if family == "bounded_velocity":
        for v_i, v_f in ((100.0, 3.0), (1e8, 1e7), (1.01, 1.001), (3.000003, 3.0)):
            t_min = float(log1p((mpf(v_i) - mpf(v_f)) / (mpf(v_i) * (mpf(v_f) - 1))))
            for excess in (1e-12, 1e-6, 1e-2, 1.0, 30.0):
                yield (0.03, 0.05, v_i, v_f, t_min * (1 + excess))
    for _ in range(random_rows):
        a = log_uniform(rng, 1e-4, 0.3)
        b = a * rng.choice([0.0, 1.0, log_uniform(rng, 0.1, 50)])
        v_i, v_f = (1 + log_uniform(rng, 1e-3, 1e4) for _ in range(2))
        yield (a, b, v_i, v_f, log_uniform(rng, 1e-6, 1e3) / v_f)


if __name__ == "__main__":
    mp.dps = DIGITS
    rng = random.Random(31)
    with open("swift_velocity.csv", "w", newline="") as file:
        file.write("# made by generate_swift_velocity.py, mpmath at 40 digits and more, quadrature over closed forms\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADER)
        for family, rows in (("step", 40), ("cubic", 40), ("bounded_velocity", 25)):
            for case in cases(family, rng, rows):
                if family not in (sys.argv[1:] or FAMILIES):
                    continue
                mp.dps = DIGITS
                try:
                    row = FAMILIES[family](*(mpf(x) for x in case))
                except (ArithmeticError, AssertionError) as error:
                    print("skipped", family, case, error, file=sys.stderr, flush=True)
                    continue
                mp.dps = DIGITS
                writer.writerow([family] + [repr(x) for x in case] + [show(x) for x in row[:-1]] + [row[-1]])
                file.flush()
                print(family, case, show(row[1]), row[-1], file=sys.stderr, flush=True)
