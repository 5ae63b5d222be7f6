"""Optimal protocols under ceilings of velocity and friction, from the optimal control problem itself.

Least `int tau v dt` with `theta' = 1 - theta v`, `tau = 1 + a ln v + b ln theta`, `1 <= v <= v_ceiling` and `tau <= tau_ceiling`. On a leg
where theta is monotone the integrand of `int (tau v + C) dt` is minimised at each theta over the admissible velocities: with `u = theta v` and
`z = ln u`, the free minimiser solves `e^z - 1 - z = E`, `a E = 1 + (b - a) ln theta + C theta`, and the bounds clamp it. `C` is the unknown.

Arithmetic: gmpy2 at 54 digits. Quadrature: tanh-sinh in ln theta with bisection, split at every switch between arcs. Switches are roots of
the difference between bound and free minimiser, bracketed by its stationary point. No charts, no Gauss rules, no Lambert function, no
dilogarithm: nothing is shared with the library.
"""

import math
from functools import lru_cache

import gmpy2
from gmpy2 import exp, expm1, log, log1p, mpfr, sqrt

ROUGH, FULL = 100, 180  # bits


class Infeasible(Exception):
    """No admissible protocol reaches the end in this time."""


class Unphysical(Exception):
    """Friction falls to max(0, b - a) on the path: the extremal need not be the only one."""


def precision(bits):
    gmpy2.get_context().precision = bits


def digits():
    return int(gmpy2.get_context().precision * 0.30103)


@lru_cache(None)
def nodes(bits, level):
    """Abscissae from the nearer end (as fractions of the panel, sign of the end) and weights that `level` adds to the rule."""
    h = mpfr(1) / 2**level
    half_pi = gmpy2.const_pi() / 2
    found = [(mpfr(1) / 2, 0, half_pi / 2)] if level == 0 else []
    k = 1
    while True:
        t = k * h
        grown = exp(2 * half_pi * gmpy2.sinh(t))
        near = 1 / (1 + grown)
        weight = half_pi * gmpy2.cosh(t) * 2 * grown / (1 + grown) ** 2
        if weight < mpfr(2) ** (-bits - 20):
            return found
        found += [(near, -1, weight), (near, 1, weight)]
        k += 2 if level else 1


def panel(f, low, high, scale, depth=0):
    """The integral of the vector f over [low, high] to an absolute error of 10^-(3/4 digits) of scale."""
    bits = gmpy2.get_context().precision
    length = high - low
    total, last = None, None
    for level in range(0, 8):
        for near, side, weight in nodes(bits, level):
            x = low + length * near if side <= 0 else high - length * near
            y = f(x)
            total = [weight * value for value in y] if total is None else [t + weight * value for t, value in zip(total, y)]
        now = [t * length / 2**level for t in total]
        if not all(gmpy2.is_finite(n) for n in now):
            raise ArithmeticError("quadrature")
        if last is not None and level >= 3:
            # The error of a level is about the square of that of the level before.
            error = max(abs(n - l) for n, l in zip(now, last))
            if error <= scale * mpfr(10) ** -(0.42 * digits()):
                return now
            if level >= 6 and depth < 300:
                break
        last = now
    if depth >= 300:
        raise ArithmeticError("quadrature")
    middle = low + length / 2
    left = panel(f, low, middle, scale, depth + 1)
    right = panel(f, middle, high, scale, depth + 1)
    return [x + y for x, y in zip(left, right)]


def phi(z):
    """e^z - 1 - z."""
    if abs(z) > mpfr("1e-4"):
        return expm1(z) - z
    total = mpfr(0)
    for k in range(18, 1, -1):
        total = (total + 1) * z / k
    return total * z


def rough_z(e, side):
    """The solution in doubles."""
    if e < 1e-3:
        w = side * math.sqrt(2 * e)
        return w - w**2 / 6 + w**3 / 36 - w**4 / 270
    z = math.log(1 + e + math.log(1 + e) + min(1.5, math.sqrt(e))) if side > 0 else -(1 + e)
    if side < 0 and e < 3:
        z = -math.sqrt(2 * e) - e / 3
    for _ in range(40):
        step = (math.expm1(z) - z - e) / math.expm1(z)
        z -= step
        if abs(step) < 1e-14 * abs(z):
            break
    return z


def free_z(e, side):
    """The solution z of e^z - 1 - z = e with the sign of side; 0 where e <= 0."""
    if e <= 0:
        return mpfr(0)
    if e < mpfr("1e-10"):
        w = side * sqrt(2 * e)
        z = w - w**2 / 6 + w**3 / 36 - w**4 / 270 + w**5 / 4320
    else:
        z = mpfr(rough_z(float(e), side))
    for _ in range(2):
        slope = expm1(z)
        f = phi(z) - e
        z -= f * slope / (slope * slope - f * (slope + 1) / 2)
    return z


def bisect(f, low, high, steps=70):
    """A root of f between low and high, where it changes sign: bisection, then secants."""
    f_low = f(low)
    if f_low == 0:
        return low
    for _ in range(steps):
        middle = (low + high) / 2
        f_middle = f(middle)
        if (f_middle > 0) == (f_low > 0):
            low, f_low = middle, f_middle
        else:
            high = middle
    x_0, x_1 = low, high
    f_0, f_1 = f(x_0), f(x_1)
    for _ in range(8):
        if f_1 == f_0 or f_1 == 0:
            break
        x_2 = x_1 - f_1 * (x_1 - x_0) / (f_1 - f_0)
        if not (low <= x_2 <= high):
            x_2 = (low + high) / 2
        x_0, f_0, x_1, f_1 = x_1, f_1, x_2, f(x_2)
        if (f_1 > 0) == (f_low > 0):
            low = max(low, x_1)
        else:
            high = min(high, x_1)
    return x_1


class Problem:
    """Inputs are exact: doubles, or numbers of full precision. A ceiling of None is absent."""

    def __init__(self, a, b, theta_0, theta_1, v_ceiling=None, tau_ceiling=None, floor=True, v_i=None, v_f=None):
        self.a, self.b, self.theta_0, self.theta_1 = a, b, theta_0, theta_1
        self.v_ceiling, self.tau_ceiling, self.floor = v_ceiling, tau_ceiling, floor
        self.l_0, self.l_1 = log(theta_0), log(theta_1)

    def tau_ss(self, l):
        return 1 + (self.b - self.a) * l

    def caps(self, l):
        found = []
        if self.v_ceiling is not None:
            found.append((log(self.v_ceiling) + l, "v"))
        if self.tau_ceiling is not None:
            found.append(((self.tau_ceiling - self.tau_ss(l)) / self.a, "tau"))
        return found

    def cap(self, l):
        found = self.caps(l)
        return min(found) if found else (None, None)

    def zero_of_caps(self):
        """The values of ln theta where a ceiling is steady sliding."""
        found = []
        if self.v_ceiling is not None:
            found.append(-log(self.v_ceiling))
        if self.tau_ceiling is not None and self.a != self.b:
            found.append((self.tau_ceiling - 1) / (self.b - self.a))
        return found

    def highest_turn(self):
        """The least ln theta above both ends where theta cannot turn under the bounds; None if it can everywhere."""
        top = max(self.l_0, self.l_1)
        found = [l for l in self.zero_of_caps() if l > top] + ([mpfr(0)] if self.floor else [])
        return min(found) if found else None

    def c_at(self, l):
        """The C of an extremal that is steady at this ln theta."""
        return -self.tau_ss(l) / exp(l)

    def least_time(self):
        """Accelerations: everything on the ceiling. Decelerations: everything on the floor, or standing still."""
        if self.l_1 > self.l_0:
            return -log1p(-(self.theta_1 - self.theta_0) / (1 - self.theta_0)) if self.floor else self.theta_1 - self.theta_0
        if self.l_1 == self.l_0 or not self.caps(self.l_0):
            return mpfr(0)
        return self.on_ceiling()

    def on_ceiling(self):
        """The time if everything is on the ceiling."""
        low, high = min(self.l_0, self.l_1), max(self.l_0, self.l_1)
        cuts = [low, high]
        if self.v_ceiling is not None and self.tau_ceiling is not None and self.b > 0:
            cross = (self.tau_ceiling - 1 - self.a * log(self.v_ceiling)) / self.b
            if low < cross < high:
                cuts.insert(1, cross)
        total = mpfr(0)
        for x, y in zip(cuts, cuts[1:]):
            name = self.cap((x + y) / 2)[1]
            total += self.time_on(name, x, y)
        return total

    def time_on(self, name, low, high):
        """The time of a motion on one ceiling between two values of ln theta."""
        return self.sum_on(name, low, high, lambda l, z: [exp(l) / abs(expm1(z))], min(mpfr(1), high - low) * exp(high))[0]

    def sum_on(self, name, low, high, f, scale):
        """The integral of f(l, z) over a ceiling. Near steady sliding in ln |z|: z is linear in l, and f is about 1/z."""
        z_of = lambda l: dict((name, z) for z, name in self.caps(l))[name]
        ends = [z_of(low), z_of(high)]
        if abs(log(ends[0] / ends[1])) < 1:
            return panel(lambda l: f(l, z_of(l)), low, high, scale)
        slope = mpfr(1) if name == "v" else 1 - self.b / self.a
        sign = 1 if ends[0] > 0 else -1
        nearest = 0 if abs(ends[0]) < abs(ends[1]) else 1
        base = (low, high)[nearest]
        start = log(abs(ends[nearest]))

        def in_ln_z(x):
            z = sign * exp(x)
            l = base + sign * exp(start) * expm1(x - start) / slope
            return [value * abs(z / slope) for value in f(l, z)]

        return panel(in_ln_z, start, log(abs(ends[1 - nearest])), scale)


class Path:
    """The clamped extremal of C: with `turn`, theta first rises to theta_h = e^turn."""

    def __init__(self, problem, c, turn=None):
        self.p, self.c, self.turn = problem, c, turn
        p = problem
        self.pieces = []  # (label, side, start, end) in ln theta
        if turn is not None:
            if turn > p.l_0:
                self.leg(p.l_0, turn, -1)
            if turn > p.l_1:
                self.leg(turn, p.l_1, 1)
        else:
            self.leg(p.l_0, p.l_1, 1 if p.l_0 > p.l_1 else -1)
        self.lowest = mpfr(10) ** 9
        self.time, self.work = self.sums()

    def e(self, l, d=None):
        """E; d is ln theta less that of the turning point, if it is known better than l."""
        p = self.p
        if self.turn is not None:
            d = l - self.turn if d is None else d
            return ((p.b - p.a) * d + self.c * exp(self.turn) * expm1(d)) / p.a
        return (1 + (p.b - p.a) * l + self.c * exp(l)) / p.a

    def clamped(self, l, side):
        """ln u and the arc that it is on."""
        p = self.p
        z, label = free_z(self.e(l), side), "free"
        if side < 0 and p.floor and l > z:
            z, label = l, "floor"
        cap, name = p.cap(l)
        if cap is not None and cap < z:
            z, label = cap, name
        return z, label

    def switches(self, low, high, side):
        """Where the arc may change between low and high."""
        p, c = self.p, self.c
        found = list(p.zero_of_caps())
        functions = []  # a (phi(bound) - E) as a function of l, and its stationary point
        if p.v_ceiling is not None:
            v = p.v_ceiling
            functions.append((lambda l: p.a * (v * exp(l) - 1 - log(v) - l) - p.a * self.e(l), p.b / (p.a * v - c)))
        if side < 0 and p.floor:
            functions.append((lambda l: p.a * (expm1(l) - l) - p.a * self.e(l), p.b / (p.a - c)))
            found.append(mpfr(0))
        if p.tau_ceiling is not None:
            kappa = 1 - p.b / p.a
            k = exp((p.tau_ceiling - 1) / p.a)

            def g(l):
                z = (p.tau_ceiling - p.tau_ss(l)) / p.a
                return p.a * (exp(z) - 1 - z) - p.a * self.e(l)

            still = None
            if kappa not in (0, 1) and c / (p.a * k * kappa) > 0:
                still = exp(log(c / (p.a * k * kappa)) / (kappa - 1))
            functions.append((g, still))
            if p.v_ceiling is not None and p.b > 0:
                found.append((p.tau_ceiling - 1 - p.a * log(p.v_ceiling)) / p.b)
        for g, still in functions:
            cuts = [low, high]
            if still is not None and still > 0 and low < log(still) < high:
                cuts.insert(1, log(still))
            for x, y in zip(cuts, cuts[1:]):
                # At a turning point E = 0 and the bound is not.
                if g(x) * g(y) < 0:
                    found.append(bisect(g, x, y))
        return sorted(l for l in found if low < l < high)

    def leg(self, start, end, side):
        low, high = min(start, end), max(start, end)
        cuts = [low, *self.switches(low, high, side), high]
        pieces = []
        for x, y in zip(cuts, cuts[1:]):
            label = self.clamped((x + y) / 2, side)[1]
            pieces.append((label, side, y, x) if side > 0 else (label, side, x, y))
        self.pieces += pieces[::-1] if side > 0 else pieces

    def merged(self):
        """Pieces of one arc joined."""
        found = []
        for label, side, start, end in self.pieces:
            if found and found[-1][0] == label and found[-1][1] == side:
                found[-1] = (label, side, found[-1][2], end)
            else:
                found.append((label, side, start, end))
        return found

    def arcs(self):
        words, last = [], None
        for label, side, *_ in self.merged():
            if last is not None and side != last:
                words.append("turn")
            words.append(label)
            last = side
        return words

    def integrate(self, label, side, start, end, f):
        """The integral of f(l, z) over a piece; |d ln theta| is the measure."""
        length = abs(end - start)
        if self.turn in (start, end) and self.turn is not None:
            # ln theta = turn - s^2 removes the inverse square root.
            edge = sqrt(length)
            g = lambda s: [2 * s * value for value in self.node(self.turn - s * s, label, side, f, -s * s)]
            return panel(g, mpfr(0), edge, self.scale)
        if label in ("v", "tau"):
            p = self.p
            for l in (start, end):
                self.lowest = min(self.lowest, p.tau_ss(l) + p.a * dict((name, z) for z, name in p.caps(l))[label])
            return p.sum_on(label, min(start, end), max(start, end), f, self.scale)
        return panel(lambda l: self.node(l, label, side, f), min(start, end), max(start, end), self.scale)

    def node(self, l, label, side, f, d=None):
        p = self.p
        if label == "free":
            z = free_z(self.e(l, d), side)
        else:
            z = l
        self.lowest = min(self.lowest, p.tau_ss(l) + p.a * z)
        return f(l, z)

    @property
    def scale(self):
        return min(mpfr(1), abs(self.p.l_1 - self.p.l_0) if self.p.l_1 != self.p.l_0 else abs(self.turn - self.p.l_0)) * self.p.theta_1

    def sums(self):
        """Time and work, constant velocities by their time."""
        p = self.p

        def f(l, z):
            rate = 1 / abs(expm1(z))
            return [exp(l) * rate, (p.tau_ss(l) + p.a * z) * exp(z) * rate]

        self.times = {"floor": mpfr(0), "v": mpfr(0), "tau": mpfr(0), "free": mpfr(0)}
        work = mpfr(0)
        for label, side, start, end in self.merged():
            if label in ("floor", "v"):
                v = mpfr(1) if label == "floor" else p.v_ceiling
                x_s, x_e = v * exp(start) - 1, v * exp(end) - 1
                t = log(x_s / x_e) / v
                # The work is the integral over time; its layer at the start is cut by bisection.
                w = panel(lambda s: [v * (1 + p.a * log(v) + p.b * log((1 + x_s * exp(-v * s)) / v))], mpfr(0), t, min(t, mpfr(1)))[0]
                for l in (start, end):
                    self.lowest = min(self.lowest, 1 + p.a * log(v) + p.b * l)
            else:
                t, w = self.integrate(label, side, start, end, f)
            self.times[label] += t
            work += w
        return sum(self.times.values(), mpfr(0)), work

    def ends(self):
        """ln u at both ends with their arcs."""
        _, side_0, start, _ = self.pieces[0]
        _, side_1, _, end = self.pieces[-1]
        return self.clamped(start, side_0)[0], self.clamped(end, side_1)[0]

    def slopes(self):
        """Derivatives of the least work by the multipliers of the bounds, in one pass over the path."""
        p = self.p

        def f(l, z):
            rate = exp(l) / abs(expm1(z))
            v, ln_v = exp(z - l), z - l
            return [rate * x for x in (1, (p.tau_ss(l) + p.a * z) * v, v * ln_v, v * l)]

        def multiplier(l, z):
            v = exp(z - l)
            rate = exp(l) / abs(expm1(z))
            factor = (self.e(l) - phi(z)) / expm1(z) * rate
            return [p.a * factor, v * factor, v * factor * (z - l), v * factor * l]

        names = ["time", "work", "a", "b", "v_ceiling", "tau_ceiling"]
        found = dict.fromkeys(names, mpfr(0))
        for label, side, start, end in self.pieces:
            t, w, s_a, s_b = self.integrate(label, side, start, end, f)
            found["time"] += t
            found["work"] += w
            found["a"] += s_a
            found["b"] += s_b
            if label in ("v", "tau"):
                n, m, m_a, m_b = self.integrate(label, side, start, end, multiplier)
                if label == "v":
                    found["v_ceiling"] -= n
                else:
                    found["tau_ceiling"] -= m
                    found["a"] += m_a
                    found["b"] += m_b
        z_0, z_1 = self.ends()
        price = lambda l, z: ((p.tau_ss(l) + p.a * z) * exp(z - l) + self.c) / expm1(z) if z else (p.tau_ss(l) + p.a) / exp(l)
        found["p_0"], found["p_1"] = price(p.l_0, z_0), price(p.l_1, z_1)
        return found


class Family:
    """Extremals of one problem with a time monotone in x; `least` and `most` are the limits of the time."""

    def __init__(self, problem, t_f):
        self.p, self.t_f = problem, t_f
        p = self.p
        rising = p.theta_1 > p.theta_0
        cap_0, cap_1 = (p.cap(l)[0] for l in (p.l_0, p.l_1))
        blocked = lambda cap: cap is not None and cap <= 0
        self.least, self.most, self.sitting = mpfr(0), None, False
        if p.l_1 < p.l_0:
            if blocked(cap_0) or blocked(cap_1):
                raise Infeasible
            self.least = p.least_time()
            if t_f < self.least:
                raise Infeasible
            self.kind, self.limit = "fall", p.l_0
        elif p.l_1 == p.l_0:
            if cap_0 is not None and cap_0 < 0:
                raise Infeasible
            self.sitting = cap_0 is not None and cap_0 == 0
            self.kind, self.limit = "turn", p.l_0
            return
        else:
            self.least = p.least_time()
            if t_f < self.least:
                raise Infeasible
            if p.floor and ((p.v_ceiling is not None and p.v_ceiling < 1) or (p.tau_ceiling is not None and p.tau_ceiling < 1 + p.b * p.l_1)):
                raise Infeasible
            self.kind, self.limit = "rise", p.l_1
            if cap_1 is not None and cap_1 < 0:
                inside = [l for l in p.zero_of_caps() if p.l_0 < l < p.l_1 and p.cap(l + (p.l_0 - l) / 1000)[0] > 0]
                if inside:
                    self.limit = min(inside)
                else:
                    self.limit = p.l_0
                    self.most = p.on_ceiling()
                    if t_f > self.most:
                        raise Infeasible
                return
            self.sitting = cap_1 is not None and cap_1 == 0
        # Where the family without a turn ends.
        border = Path(p, p.c_at(self.limit), self.limit)
        if border.time < t_f:
            if self.sitting:
                self.kind = "sit"
            else:
                self.kind = "turn"
                self.least = border.time
                self.border = border

    def member(self, x):
        p = self.p
        if self.kind == "turn":
            top = p.highest_turn()
            bottom = exp(self.limit)
            theta_h = bottom * (1 + exp(x)) if top is None else bottom + (exp(top) - bottom) / (1 + exp(-x))
            l_h = log(theta_h)
            return Path(p, p.c_at(l_h), l_h)
        return Path(p, p.c_at(self.limit) * (1 - exp(x)) if p.c_at(self.limit) < 0 else p.c_at(self.limit) + exp(x))

    def miss(self, path):
        """Increasing in the time, near linear close to its limits."""
        least = self.least
        late = sqrt(max(path.time - least, mpfr(0))) - sqrt(self.t_f - least)
        if self.most is not None:
            late = sqrt(self.most - self.t_f) - sqrt(max(self.most - path.time, mpfr(0)))
        return late / sqrt(self.t_f)


def solve(make, t_f):
    """The optimal path; `make` returns the problem at the current precision."""
    precision(ROUGH)
    p = make()
    family = Family(p, mpfr(t_f))
    if family.kind == "sit" or (family.kind == "turn" and family.sitting):
        precision(FULL)
        p = make()
        family = Family(p, mpfr(t_f))
        return family, None if p.l_0 == p.l_1 else Path(p, p.c_at(p.l_1), p.l_1)
    sign = 1 if family.kind == "turn" else -1

    def f(x):
        try:
            return sign * family.miss(family.member(x))
        except ArithmeticError:
            # So near a steady state that no quadrature takes the time: it is too long.
            return mpfr(sign)

    low = high = mpfr(0)
    step = mpfr(1)
    f_low = f_high = f(low)
    while f_high <= 0:
        low, f_low = high, f_high
        high += step
        f_high = f(high)
        step *= mpfr("1.6")
        if step > 500:
            raise Unphysical
    step = mpfr(1)
    while f_low > 0:
        high, f_high = low, f_low
        low -= step
        f_low = f(low)
        step *= mpfr("1.6")
        if step > 500:
            raise Unphysical
    for i in range(80):
        fraction = f_low / (f_low - f_high)
        if i % 3 == 2 or not (mpfr("0.001") < fraction < mpfr("0.999")):
            fraction = min(max(fraction, mpfr("0.001")), mpfr("0.999")) if i % 2 else mpfr("0.5")
        x = low + fraction * (high - low)
        value = f(x)
        if value > 0:
            high, f_high = x, value
        else:
            low, f_low = x, value
        if high - low < mpfr("1e-9") or abs(value) < mpfr("1e-12"):
            break
    precision(FULL)
    p = make()
    family = Family(p, mpfr(t_f))
    x_0 = mpfr(low)
    x_1 = mpfr(high)
    if high - low > mpfr("1e-7"):
        x_0, x_1 = mpfr(x), mpfr(x) + mpfr("1e-10")
    path = None
    f_0 = family.miss(family.member(x_0))
    for _ in range(14):
        path = family.member(x_1)
        f_1 = family.miss(path)
        if abs(path.time - t_f) <= mpfr("1e-42") * min(mpfr(t_f), mpfr(t_f) - family.least) or f_1 == f_0:
            break
        x_0, f_0, x_1 = x_1, f_1, x_1 - f_1 * (x_1 - x_0) / (f_1 - f_0)
    late = abs(path.time - t_f) / (mpfr(t_f) - family.least)
    assert late < mpfr("1e-34"), (float(late), family.kind)
    return family, path
