"""Regularised friction with the ageing law: optima, works of cubic shortcuts and eigenvalues, from the definitions.

    python arcsinh.py optimal > arcsinh_optimal.csv      # mpmath, gmpy2
    python arcsinh.py gap > arcsinh_gap.csv
    python arcsinh.py stability > arcsinh_stability.csv

tau = a asinh(v/2 exp((1 + b ln theta)/a)). Optima: the Euler-Lagrange equation of tau v dt with v = (1 - theta')/theta conserves H, and theta H = tau + v
dtau/dv (1 - u). The velocity is a root of it at each theta; time, work and derivatives are integrals over theta by Gauss rules with 48 nodes, checked
by 24; H is a root of the duration. Works of shortcuts: an integral over time. Eigenvalues: the characteristic polynomial of the Jacobian.
All with 50 digits.
"""

import random
import sys

import gmpy2
from gmpy2 import asinh, exp, log, mpfr, sqrt
from mpmath import mp
from mpmath.calculus.quadrature import GaussLegendre

gmpy2.get_context().precision = 170
mp.prec = 170


def nodes(degree):
    """Nodes and weights on [0, 1], 3 2^(degree - 1) of them."""
    rule = GaussLegendre(mp).calc_nodes(degree, mp.prec)
    number = lambda x: mpfr(mp.nstr(x, 52))
    return [(number((1 + x) / 2), number(w / 2)) for x, w in rule]


COARSE, FINE = nodes(4), nodes(5)


def integrals(f, cuts):
    """Of the tuple f over the panels between cuts; ArithmeticError if both rules differ by more than 1e-20."""
    total = check = None
    for low, high in zip(cuts, cuts[1:]):
        for rule, which in ((COARSE, 0), (FINE, 1)):
            sums = None
            for x, w in rule:
                terms = [w * (high - low) * y for y in f(low + (high - low) * x)]
                sums = terms if sums is None else [p + q for p, q in zip(sums, terms)]
            if which:
                total = sums if total is None else [p + q for p, q in zip(total, sums)]
            else:
                check = sums if check is None else [p + q for p, q in zip(check, sums)]
    error = max(abs(x - y) / abs(x) for x, y in zip(total[:3], check[:3]))
    # Twice the nodes square the error.
    if error > 1e-11:
        raise ArithmeticError("quadrature: %s" % mp.nstr(float(error), 3))
    return total


class Law:
    def __init__(self, a, b):
        self.a, self.b = mpfr(a), mpfr(b)

    def z(self, v, theta):
        return v / 2 * exp((1 + self.b * log(theta)) / self.a)

    def tau(self, v, theta):
        return self.a * asinh(self.z(v, theta))

    def creep(self, v, theta):
        """v dtau/dv."""
        z = self.z(v, theta)
        return self.a * z / sqrt(1 + z * z)

    def steady(self, theta):
        return self.tau(1 / theta, theta)

    def conserved(self, u, theta):
        """theta H."""
        z = self.z(u / theta, theta)
        return self.a * (asinh(z) + (1 - u) * z / sqrt(1 + z * z))

    def velocity(self, h, theta, rises):
        """ln u of the root of theta H = h theta with u < 1 or u > 1."""
        target = h * theta
        z_1 = self.z(1 / theta, theta)
        sign = -1 if rises else 1
        low, high = mpfr(0), mpfr(sign)
        p = high
        is_open = True
        for _ in range(300):
            u = exp(p)
            z = u * z_1
            f = z / sqrt(1 + z * z)
            value = self.a * (asinh(z) + (1 - u) * f) - target
            if value > 0:
                low = p
                if is_open:
                    p = 2 * p
                    high = p
                    continue
            else:
                high, is_open = p, False
            # The derivative by ln u is a (1 - u) f (2 - f^2).
            next_p = p - value / (self.a * (1 - u) * f * (2 - f * f))
            if not min(low, high) < next_p < max(low, high):
                next_p = (low + high) / 2
            if abs(next_p - p) < mpfr(10) ** -24 * abs(p):
                return next_p
            p = next_p
        raise ArithmeticError("no velocity")


def optimum(law, ends, h, top):
    """Time, int u dt, work, and its derivatives by a and b, of the extremal of Hamiltonian h that turns at top, if there is one."""

    def branch(low, high, rises, turns):
        def terms(s):
            # theta = high - (high - low) s^2 at a branch point of the root, else in the logarithm.
            if turns:
                theta, way = high - (high - low) * s * s, 2 * (high - low) * s
            else:
                theta = high * (low / high) ** s
                way = theta * log(high / low)
            u = exp(law.velocity(h, theta, rises))
            dt, v = way / abs(1 - u), u / theta
            e = mpfr(10) ** -17 * law.a
            da = (Law(law.a + e, law.b).tau(v, theta) - Law(law.a - e, law.b).tau(v, theta)) / (2 * e)
            return dt, u * dt, law.tau(v, theta) * v * dt, da * v * dt, law.creep(v, theta) / law.a * log(theta) * v * dt

        # The velocity changes where theta is within a few a of the turning point; far from it, theta over decades.
        cuts = [mpfr(0), mpfr(1)]
        if turns:
            grid = [sqrt(law.a) * mpfr(2) ** k / 8 for k in range(12)]
            last = 1 - low / high
            grid += [sqrt(max(1 - mpfr(4) ** -k, 0) / last) for k in range(1, 40)]
            cuts = sorted(set(cuts + [c for c in grid if 0 < c < 1]))
        else:
            count = 4 + int(log(high / low))
            # The greater theta may be near a branch point.
            cuts = sorted(set([mpfr(k) / count for k in range(count + 1)] + [mpfr(2) ** -k / count for k in range(1, 24)]))
        return integrals(terms, cuts)

    start, end = ends
    if top is None:
        return branch(min(ends), max(ends), end > start, False)
    return [x + y for x, y in zip(branch(start, top, True, True), branch(end, top, False, True))]


def solve(law, v_i, v_f, kind, parameter):
    """The row of an optimum. `parameter` is ln(theta_h/theta) for kind turn, ln u at the greater theta for kind direct."""
    ends = theta_0, theta_1 = 1 / mpfr(v_i), 1 / mpfr(v_f)
    greater, rises = max(ends), theta_1 > theta_0

    def member(x):
        if kind == "turn":
            top = greater * exp(x)
            return law.steady(top) / top, top
        return law.conserved(exp(x), greater) / greater, None

    x = mpfr(parameter)
    sums = optimum(law, ends, *member(x))
    t_f = mpfr(float(sums[0]))
    # A double for t_f, then the parameter of that duration by the secant method.
    least = theta_1 - theta_0 if rises else mpfr(0)
    target = t_f - least
    if target < 1e-6 * t_f:
        raise ArithmeticError("rounding of t_f")
    measure = lambda sums: sums[1] if rises else sums[0]
    before = x * (1 + mpfr(10) ** -15)
    value_before, value = measure(optimum(law, ends, *member(before))) - target, measure(sums) - target
    for _ in range(6):
        if abs(value) < mpfr(10) ** -22 * target:
            break
        x, before = x - value * (x - before) / (value - value_before), x
        sums = optimum(law, ends, *member(x))
        value, value_before = measure(sums) - target, value
    else:
        raise ArithmeticError("no duration")
    h, top = member(x)
    sides = (rises or kind == "turn", rises and kind == "direct")
    v = [exp(law.velocity(h, theta, side)) / theta for theta, side in zip(ends, sides)]
    prices = [(law.tau(v, theta) + law.creep(v, theta)) / theta for v, theta in zip(v, ends)]
    return {
        "kind": kind, "t_f": t_f, "a": law.a, "b": law.b, "v_i": v_i, "v_f": v_f, "work": sums[2], "v_start": v[0], "v_end": v[1],
        "hamiltonian": h, "theta_max": top or greater, "t_least": least, "dwork_da": sums[3], "dwork_db": sums[4],
        "dwork_dv_i": -prices[0] / mpfr(v_i) ** 2, "dwork_dv_f": prices[1] / mpfr(v_f) ** 2,
    }


INPUTS = ("t_f", "a", "b", "v_i", "v_f", "a_2", "a_3", "k", "m", "v")


def show(rows):
    for place, row in enumerate(rows):
        if place == 0:
            print(",".join(row))
        cell = lambda k, x: x if isinstance(x, str) else repr(float(x)) if k in INPUTS else "{0:.22g}".format(mpfr(x))
        print(",".join(cell(k, x) for k, x in row.items()), flush=True)


def optimal():
    rng = random.Random(1)
    between = lambda low, high: low * (high / low) ** rng.random()
    yield solve(Law(0.1, 0.12), 50.0, 200.0, "turn", log(mpfr("0.3787805058268") * 50))
    count = 0
    while count < 120:
        a = between(1e-3, 0.3)
        b = min(a * rng.choice([0.0, 0.5, 1.0, 1.3, 2.0, 4.0]), 0.5)
        v_i, v_f = [between(1.01, rng.choice([10.0, 1e3, 1e6])) for _ in range(2)]
        law = Law(a, b)
        kind = rng.choice(["turn", "turn", "direct"])
        x = between(1e-4, 3.0)
        if kind == "direct":
            x = between(0.01, 30.0) if v_f > v_i else -between(0.01, 0.3 / a)
        # Several extremals may exist below.
        if law.steady(1 / mpfr(max(v_i, v_f))) <= law.b - law.a + law.a / 10:
            continue
        try:
            yield solve(law, v_i, v_f, kind, x)
            count += 1
        except ArithmeticError as error:
            print(a, b, v_i, v_f, kind, x, error, file=sys.stderr)


def cubic(t_f, v_i, v_f, a_2, a_3):
    """theta and t_f (1 - theta') over x = t/t_f."""
    theta_0, rise = 1 / mpfr(v_i), 1 / mpfr(v_f) - 1 / mpfr(v_i)
    a_4 = rise - a_2 - a_3
    theta = lambda x: theta_0 + x * (a_2 + x * (a_3 + x * a_4))
    n = lambda x: t_f - a_2 - x * (2 * a_3 + 3 * x * a_4)
    return theta, n


def least(f):
    """The least value on [0, 1] and its place, by a grid and golden sections."""
    _, k = min((f(mpfr(k) / 200), k) for k in range(201))
    low, high = mpfr(max(k - 1, 0)) / 200, mpfr(min(k + 1, 200)) / 200
    ratio = (sqrt(mpfr(5)) - 1) / 2
    for _ in range(120):
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        if f(left) < f(right):
            high = right
        else:
            low = left
    return min((f(x), x) for x in (mpfr(0), mpfr(1), (low + high) / 2))


def work(law, t_f, v_i, v_f, a_2, a_3):
    theta, n = cubic(t_f, v_i, v_f, a_2, a_3)

    def terms(x):
        slip = n(x) / theta(x)
        return [law.tau(slip / t_f, theta(x)) * slip]

    # Graded towards the ends and towards the least theta and the least n.
    places = {mpfr(0), mpfr(1), least(theta)[1], least(n)[1]}
    cuts = {place + sign * mpfr(2) ** -k for place in places for sign in (-1, 1) for k in range(1, 30)} | places
    return integrals(terms, sorted(c for c in cuts if 0 <= c <= 1))[0]


def gap():
    """Shortcuts of the transitions of arcsinh_optimal.csv, a third of them close to rest somewhere."""
    rng = random.Random(2)
    lines = [line.strip().split(",") for line in open(__file__.replace("arcsinh.py", "arcsinh_optimal.csv")) if line[0] != "#"]
    for place, cells in enumerate(lines[1:]):
        row = dict(zip(lines[0], cells))
        t_f, a, b, v_i, v_f = (float(row[name]) for name in ("t_f", "a", "b", "v_i", "v_f"))
        is_feasible = lambda a_2, a_3: all(least(f)[0] > 0 for f in cubic(mpfr(t_f), v_i, v_f, mpfr(a_2), mpfr(a_3)))
        for _ in range(1000):
            scale = min(t_f, max(1 / v_i, 1 / v_f)) * 10 ** -rng.uniform(0, 2)
            line = 1 / v_f - 1 / v_i
            a_2, a_3 = line + scale * rng.uniform(-2, 2), scale * rng.uniform(-2, 2)
            if is_feasible(a_2, a_3):
                break
        else:
            continue
        if place % 3 == 0:
            # Along a ray to the border.
            low, high = 1.0, 2.0
            while is_feasible(line + high * (a_2 - line), high * a_3):
                low, high = high, 2 * high
            for _ in range(40):
                middle = (low + high) / 2
                if is_feasible(line + middle * (a_2 - line), middle * a_3):
                    low = middle
                else:
                    high = middle
            low = low * (1 - 10 ** -rng.uniform(1, 4))
            a_2, a_3 = line + low * (a_2 - line), low * a_3
        try:
            found = work(Law(a, b), mpfr(t_f), v_i, v_f, mpfr(a_2), mpfr(a_3))
        except ArithmeticError as error:
            print(row, a_2, a_3, error, file=sys.stderr)
            continue
        theta, n = cubic(mpfr(t_f), v_i, v_f, mpfr(a_2), mpfr(a_3))
        optimal = mpfr(row["work"])
        yield {
            "t_f": t_f, "a": a, "b": b, "v_i": v_i, "v_f": v_f, "a_2": a_2, "a_3": a_3, "work": found, "work_optimal": optimal,
            "gap": (found - optimal) / optimal, "v_min": least(lambda x: n(x) / theta(x))[0] / mpfr(t_f),
        }


def sensitivities(law, v):
    """v dtau/dv and theta dtau/dtheta at steady sliding, by central differences."""
    e, theta = mpfr(10) ** -17, 1 / mpfr(v)
    by_v = (law.tau(v * (1 + e), theta) - law.tau(v * (1 - e), theta)) / (2 * e)
    by_theta = (law.tau(v, theta * (1 + e)) - law.tau(v, theta * (1 - e))) / (2 * e)
    return by_v, by_theta


def stability():
    """Eigenvalues of the Jacobian in spring force, velocity and theta."""
    rng = random.Random(3)
    between = lambda low, high: low * (high / low) ** rng.random()
    for place in range(80):
        a = between(1e-3, 0.3) if place % 2 else between(0.05, 0.3)
        b = min(a * rng.choice([0.5, 1.5, 3.0, 6.0]), 0.5)
        v = between(1.01, rng.choice([1e3, 1e6, 1e10]))
        law, v_i = Law(a, b), 1.5 * v
        creep, evolution = sensitivities(law, mpfr(v))
        creep_i, evolution_i = sensitivities(law, mpfr(v_i))
        mu = 0.0 if place % 8 == 7 else between(1e-4, 1e2)
        m = mu * a / v**2
        critical = lambda creep, evolution, v: (evolution - creep) * (1 + mpfr(m) * mpfr(v) ** 2 / creep)
        k = float(abs(critical(creep, evolution, v)) * mpfr(rng.choice([0.3, 0.99, 1.01, 3.0])))
        number = lambda x: mp.mpf("{0:.45g}".format(mpfr(x)))
        by_v, by_theta = creep / mpfr(v), evolution * mpfr(v)
        if m:
            jacobian = [[0, -k, 0], [1 / mpfr(m), -by_v / mpfr(m), -by_theta / mpfr(m)], [0, -1 / mpfr(v), -v]]
        else:
            # tau = force: v follows it.
            dv = [1 / by_v, -by_theta / by_v]
            jacobian = [[-k * dv[0], -k * dv[1]], [-dv[0] / mpfr(v), -mpfr(v) - dv[1] / mpfr(v)]]
        roots = mp.eig(mp.matrix([[number(x) for x in row] for row in jacobian]), left=False, right=False)
        is_real = lambda root: abs(root.imag) < mp.mpf(10) ** -20 * abs(root)
        pair = [root for root in roots if not is_real(root)]
        reals = sorted(root.real for root in roots if is_real(root))
        growth, frequency = (pair[0].real, abs(pair[0].imag)) if pair else (reals[-1], mp.mpf(0))
        yield {
            "a": a, "b": b, "v_i": v_i, "v": v, "k": k, "m": m, "k_od": evolution - creep,
            "k_c_i": critical(creep_i, evolution_i, v_i), "k_c_f": critical(creep, evolution, v),
            "growth_rate": mpfr(mp.nstr(growth, 30)), "frequency": mpfr(mp.nstr(frequency, 30)),
            "decay_rate": mpfr(mp.nstr(reals[0], 30)) if m else "", "v_crit": critical_velocity(law, k, m),
        }


def critical_velocity(law, k, m):
    """The greatest velocity at which k is critical, from a scan of ln v; empty if there is none."""
    if not (law.b > law.a and m):
        return ""

    def value(x):
        v = exp(mpfr(x))
        creep, evolution = sensitivities(law, v)
        return (evolution - creep) * (1 + mpfr(m) * v * v / creep) - mpfr(k)

    high = log(law.a * mpfr(k) / (law.b - law.a) / mpfr(m)) / 2 + mpfr(1) / 1000
    for _ in range(6000):
        low = high - mpfr(1) / 100
        if value(low) < 0:
            for _ in range(130):
                middle = (low + high) / 2
                if value(middle) < 0:
                    low = middle
                else:
                    high = middle
            return exp(low)
        high = low
    return ""


if __name__ == "__main__":
    print("# Made by `python arcsinh.py %s`: see there." % sys.argv[1])
    show({"optimal": optimal, "gap": gap, "stability": stability}[sys.argv[1]]())
