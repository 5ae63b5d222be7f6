#!/usr/bin/env python3
"""Reference tables for slipsweep, to 25 digits, by a route of their own.

    python3 -m venv venv && venv/bin/pip install mpmath gmpy2
    venv/bin/python generate.py turning crossover optimal landscape best

Arithmetic: 40 digits. Quadrature: tanh-sinh (mpmath.quad) in theta itself, split at the turning point; no charts, no Gauss rules, no
Lambert function. Roots: a bracket at 16 digits, then secants at 40. Inputs are doubles, written by repr and used exactly.
Each optimal row is checked before it is written: the time to 1e-26, and dW/dC = -C dT/dC (the Hamiltonian is the derivative of the work) to 1e-12.
"""
import csv, math, random, sys
from mpmath import mp, mpf, log, exp, sqrt, quad, log1p, expm1, nstr, sign

DIGITS = 40


def phi(z):
    """e^z - 1 - z."""
    return expm1(z) - z if abs(z) > mpf(10) ** -8 else z * z / 2 * (1 + z / 3 + z * z / 12 + z**3 / 60 + z**4 / 360)


def ln_u(e, side):
    """The solution z of e^z - 1 - z = e with the sign of side."""
    if e <= 0:
        return mpf(0)
    w = side * sqrt(2 * e)
    if abs(w) < mpf(10) ** -6:
        z = w - w**2 / 6 + w**3 / 36 - w**4 / 270
    else:
        z = mpf(float_ln_u(float(w)))
    for _ in range(8):
        step = (phi(z) - e) / expm1(z)
        z -= step
        if abs(step) <= abs(z) * mpf(10) ** (-mp.dps // 2 - 2):
            break
    return z


def float_ln_u(w):
    """`ln u` in double precision, as a start."""
    e = 0.5 * w * w
    if w > 0:
        z = math.log(1 + w + e - w * w / (6 + w))
    else:
        z = w - w * w / 6 + w**3 / 36 if w > -1.5 else math.exp(-(1 + e)) - (1 + e)
    for _ in range(4 if abs(w) > 1e-4 else 0):
        slope = math.expm1(z)
        z -= (slope - z - e) / slope
    return z


class Unphysical(Exception):
    pass


class Endless(Exception):
    """An arc on the floor that never leaves the bound."""


class Extremal:
    """An arc from theta_s to theta_1 with a given C, maybe through a turning point; time and work by quadrature in theta."""

    def __init__(self, a, b, c, theta_s, theta_1, rising_start, rising_end):
        self.a, self.b, self.c = a, b, c
        self.lowest = mpf("inf")
        self.theta_h = None
        legs = []
        top = max(theta_s, theta_1)
        if abs(self.g(top)) < mpf(10) ** (5 - mp.dps):
            # The arc starts or ends in its turning point.
            self.theta_h = top
        if rising_start and rising_end:
            legs.append((theta_s, theta_1, -1))
        elif not rising_start:
            legs.append((theta_s, theta_1, 1))
        else:
            self.theta_h = self.turn(max(theta_s, theta_1))
            legs += [(theta_s, self.theta_h, -1), (self.theta_h, theta_1, 1)]
        self.time = self.work = mpf(0)
        for start, end, side in legs:
            t, w = self.leg(start, end, side)
            self.time += t
            self.work += w

    def g(self, theta):
        return 1 + (self.b - self.a) * log(theta) + self.c * theta

    def turn(self, above):
        """The zero of g above a point where g >= 0."""
        low, high = above, above * 2
        while self.g(high) > 0:
            low, high = high, high * 2
            if high > mpf(10) ** 40:
                raise Unphysical
        if self.g(above) == 0:
            return above
        for _ in range(30):
            middle = (low + high) / 2
            low, high = (middle, high) if self.g(middle) > 0 else (low, middle)
        x = (low + high) / 2
        for _ in range(60):
            step = self.g(x) / ((self.b - self.a) / x + self.c)
            x -= step
            if abs(step) <= x * mpf(10) ** (2 - mp.dps):
                break
        return x

    def z(self, theta, side):
        return ln_u(self.g(theta) / self.a, side)

    def leg(self, start, end, side):
        """Time and work while theta runs from start to end; d is the distance from the end that is the turning point, if one is."""
        turning = self.theta_h in (start, end) and self.theta_h is not None
        base = self.theta_h if turning else start
        far = (start if end == base else end) if turning else end
        length = abs(far - base)
        direction = sign(far - base)
        if length == 0:
            return mpf(0), mpf(0)
        cache = {}

        def both(d):
            if d in cache:
                return cache[d]
            theta = base + direction * d
            if turning:
                e = ((self.b - self.a) * log1p(-d / base) - self.c * d) / self.a
            else:
                e = self.g(theta) / self.a
            if e <= 0:
                if turning and d == 0:
                    return mpf(0), mpf(0)
                raise Unphysical
            z = ln_u(e, side)
            u = exp(z)
            tau = 1 + self.a * z + (self.b - self.a) * log(theta)
            self.lowest = min(self.lowest, tau)
            rate = side / expm1(z) if abs(z) > 0 else mpf(0)
            cache[d] = (abs(rate), tau * u / theta * abs(rate))
            return cache[d]

        cuts = [mpf(0)]
        scale = length
        layer = self.a * base / 4
        marks = []
        x = layer
        while x < length / 2:
            marks.append(x)
            x *= 30
        if not turning or direction < 0:
            # theta may come close to 0 at the far end: cut geometrically towards it.
            x = far * 30
            while x < base / 3:
                marks.append(base - x)
                x *= 30
        cuts = sorted(set([mpf(0), length] + [m for m in marks if 0 < m < length]))
        degree = 5 if mp.dps < 20 else 7
        time = quad(lambda d: both(d)[0], cuts, maxdegree=degree)
        work = quad(lambda d: both(d)[1], cuts, maxdegree=degree) if mp.dps > 20 else mpf(0)
        return time, work


class Problem:
    def __init__(self, a, b, v_i, v_f, bounded):
        self.a, self.b, self.v_i, self.v_f = (mpf(x) for x in (a, b, v_i, v_f))
        self.theta_0, self.theta_1 = 1 / self.v_i, 1 / self.v_f
        self.bounded = bounded

    def c_of(self, z, theta):
        return (self.a * phi(z) - 1 - (self.b - self.a) * log(theta)) / theta

    def leaving(self, theta):
        return self.a - (1 + self.a + self.b * log(theta)) / theta

    def floor(self, time):
        """Contact lifetime after a time on the floor, and its work (by quadrature)."""
        theta = lambda t: 1 - (1 - self.theta_0) * exp(-t)
        cuts = [mpf(0), time]
        near = self.theta_0
        while near < time:
            cuts.append(near)
            near *= 20
        return theta(time), time + self.b * quad(lambda t: log(theta(t)), sorted(cuts))

    # Each family member: (C, time on the floor, extremal).
    def by_start(self, z_0):
        c = self.c_of(z_0, self.theta_0)
        return c, mpf(0), Extremal(self.a, self.b, c, self.theta_0, self.theta_1, z_0 < 0, False)

    def by_floor(self, t_1):
        theta = 1 - (1 - self.theta_0) * exp(-t_1)
        c = self.leaving(theta)
        return c, t_1, Extremal(self.a, self.b, c, theta, self.theta_1, True, False)

    def by_end(self, z_1):
        c = self.c_of(z_1, self.theta_1)
        t_1, theta = mpf(0), self.theta_0
        if self.bounded and c >= self.leaving(mpf(1)):
            raise Endless
        if self.bounded and c > self.leaving(self.theta_0):
            x = self.theta_1
            f = lambda y: self.leaving(exp(y)) - c
            low, high = log(self.theta_0), mpf(0)
            for _ in range(25):
                middle = (low + high) / 2
                low, high = (middle, high) if f(middle) < 0 else (low, middle)
            y = (low + high) / 2
            for _ in range(6):
                y -= f(y) / ((1 + self.a - self.b + self.b * y) * exp(-y))
            theta = exp(y)
            t_1 = log((1 - self.theta_0) / (1 - theta))
        return c, t_1, Extremal(self.a, self.b, c, theta, self.theta_1, True, z_1 < 0)

    def least_time(self):
        if self.v_f >= self.v_i:
            return mpf(0)
        if self.bounded:
            return log1p((self.v_i - self.v_f) / (self.v_i * (self.v_f - 1)))
        return self.theta_1 - self.theta_0


def precision(digits):
    mp.dps = digits


def solve(problem, t_f):
    """The member that takes t_f, its branch of the family and its parameter: bracketed at 16 digits, then secants at full precision."""
    precision(16)
    t_f = mpf(t_f)

    def total(make, x):
        try:
            member = make(x)
            return member[1] + member[2].time
        except Endless:
            return mpf(10) ** 30

    if problem.v_f >= problem.v_i:
        if problem.bounded and total(problem.by_start, -log(problem.v_i)) < t_f:
            make, low, high = problem.by_floor, mpf(0), t_f
        else:
            make, low, high = problem.by_start, -log(problem.v_i) if problem.bounded else mpf(-1), mpf(1)
            while total(make, high) > t_f:
                high *= 2
            while not problem.bounded and total(make, low) < t_f:
                low *= mpf("1.3")
    elif problem.bounded and total(problem.by_floor, problem.least_time()) < t_f:
        # Long enough to leave the bound beyond theta_1.
        make, low, high = problem.by_floor, problem.least_time(), t_f
    else:
        make, low, high = problem.by_end, -log(problem.v_f) if problem.bounded else mpf(-1), mpf("0.5")
        while total(make, high) < t_f:
            high += mpf("0.25")
        while not problem.bounded and total(make, low) > t_f:
            low *= mpf("1.5")
    least = problem.least_time()
    value = lambda x: log(max(total(make, x) - least, mpf(10) ** -30) / (t_f - least))
    f_low = mpf(-70) if make == problem.by_end and problem.bounded else value(low)
    f_high = value(high)
    if f_low * f_high > 0:
        raise Unphysical
    for i in range(60):
        x = (low * f_high - high * f_low) / (f_high - f_low) if i % 3 else (low + high) / 2
        f = value(x)
        if abs(f) < mpf(10) ** -7 or abs(high - low) < mpf(10) ** -12 * abs(x):
            break
        if f * f_low > 0:
            low, f_low = x, f
        else:
            high, f_high = x, f
    precision(DIGITS)
    least = problem.least_time()
    near = lambda x: log((total(make, x) - least) / (t_f - least))
    x_0, x_1 = x, x * (1 + mpf(10) ** -8) + mpf(10) ** -20
    f_0, f_1 = near(x_0), near(x_1)
    for _ in range(10):
        if f_1 == f_0 or abs(f_1) < mpf(10) ** -29:
            break
        x_0, f_0, x_1 = x_1, f_1, x_1 - f_1 * (x_1 - x_0) / (f_1 - f_0)
        f_1 = near(x_1)
    assert abs(f_1) < mpf(10) ** -26, f_1
    return make(x_1), make, x_1


def optimal_row(a, b, v_i, v_f, t_f, bounded):
    problem = Problem(a, b, v_i, v_f, bounded)
    (c, t_1, arc), make, x = solve(problem, t_f)
    floor_work = problem.floor(t_1)[1] if t_1 else mpf(0)
    work = floor_work + arc.work
    theta_s = 1 - (1 - problem.theta_0) * exp(-t_1) if t_1 else problem.theta_0
    z_end = ln_u(arc.g(problem.theta_1) / problem.a, -1 if (make == problem.by_end and x < 0) else 1)
    rising = make == problem.by_floor or (make == problem.by_start and x < 0) or make == problem.by_end
    z_start = ln_u(arc.g(theta_s) / problem.a, -1 if rising else 1)
    lowest = min([arc.lowest] + ([1 + problem.b * log(problem.theta_0)] if t_1 else []))
    if lowest <= max(mpf(0), problem.b - problem.a):
        raise Unphysical
    # The Hamiltonian as the derivative of the work, by a difference along the family.
    step = mpf(10) ** -16 * max(abs(x), mpf(10) ** -3)
    c_2, t_2, arc_2 = make(x + step)
    work_2 = (problem.floor(t_2)[1] if t_2 else mpf(0)) + arc_2.work
    slope = (work_2 - work) / (t_2 + arc_2.time - t_1 - arc.time)
    assert abs(slope + c) < mpf(10) ** -10 * abs(c) + mpf(10) ** -10, (slope, c)
    v_start = mpf(1) if t_1 else exp(z_start) * problem.v_i
    theta_max = arc.theta_h if arc.theta_h is not None else max(problem.theta_0, problem.theta_1)
    strategy = "floor" if t_1 else "speed_up" if v_start > problem.v_i else "slow_down"
    return [work, v_start, exp(z_end) * problem.v_f, t_1, -c, theta_max, strategy]


def show(x):
    return x if isinstance(x, str) else "" if x is None else nstr(x, 25, strip_zeros=False, min_fixed=-5, max_fixed=20)


def write(name, header, rows):
    with open(f"{name}.csv", "w", newline="") as file:
        file.write(f"# made by generate.py, mpmath at {DIGITS} digits, tanh-sinh in theta\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        count = 0
        for row in rows:
            out.writerow(row)
            count += 1
            file.flush()
    print(name, count, "rows")


def log_uniform(rng, low, high):
    return float(exp(log(mpf(low)) + log(mpf(high) / mpf(low)) * mpf(rng.random())))


def crossover_row(a, b, v_i, v_f):
    p = Problem(a, b, v_i, v_f, True)
    blank = [None] * 12
    tau = lambda theta: 1 + (p.b - p.a) * log(theta)
    low = max(mpf(0), p.b - p.a)

    def measure(member):
        c, t_1, arc = member
        if arc.lowest <= low:
            raise Unphysical
        return t_1 + arc.time, arc.work + (p.floor(t_1)[1] if t_1 else 0)

    if v_f > v_i:
        if min(tau(p.theta_0), tau(p.theta_1), 1 + p.b * log(p.theta_0)) <= low:
            raise Unphysical
        t_cross, w_cross = measure(p.by_start(mpf(0)))
        t_floor, w_floor = measure(p.by_start(log(p.theta_0)))
        t_cheap, w_cheap = measure(p.by_start(ln_u(tau(p.theta_0) / p.a, 1)))
        return [t_cross, t_floor, t_cheap, None, None, None, None, w_cross, w_floor, w_cheap, None, None]
    t_min = p.least_time()
    if min(tau(p.theta_1), 1 + p.b * log(p.theta_0)) <= low:
        raise Unphysical
    c, t_1, arc = p.by_end(mpf(0))
    t_turn, w_turn = measure((c, t_1, arc))
    free = [None, None]
    if not t_1:
        c = p.leaving(p.theta_0)
        z = [ln_u((1 + (p.b - p.a) * log(p.theta_1) + c * p.theta_1) / p.a, side) for side in (-1, 1)]
        free = [Extremal(p.a, p.b, c, p.theta_0, p.theta_1, True, side < 0).time for side in (-1, 1)]
    return [None, None, None, t_min, t_turn, *free, None, None, None, p.floor(t_min)[1], w_turn]


def crossover_rows():
    rng = random.Random(2)
    cases = [(0.03, 0.05, 3.0, 100.0), (0.03, 0.05, 100.0, 3.0), (0.03, 0.05, 3.0, 2.99)]
    while len(cases) < 240:
        a = log_uniform(rng, 1e-4, 0.3)
        b = rng.choice([0.0, a, a * rng.random(), min(a * log_uniform(rng, 1, 10), 0.4)])
        v = rng.choice([log_uniform(rng, 2, 100), 1 + log_uniform(rng, 1e-3, 1)])
        ratio = rng.choice([log_uniform(rng, 1.1, 1e6), 1 + log_uniform(rng, 1e-6, 0.1)])
        cases.append((a, b, v, v * ratio) if rng.random() < 0.6 else (a, b, v * ratio, v))
    for case in cases:
        try:
            yield [repr(x) for x in case] + [show(x) for x in crossover_row(*case)]
        except Unphysical:
            pass


def short_floor_cases():
    """Accelerations just after t_floor, where the time on the floor is a small fraction of t_f."""
    precision(DIGITS)
    cases = []
    for a, b, v_i, v_f in (
        (0.03, 0.05, 3.0, 100.0),
        (0.010435427807552387, 0.010435427807552387, 1.001, 1.001001001),
        (0.0001, 0.0003630315811683068, 3.0, 3.190125206417716),
        (0.02, 0.01, 1.05, 40.0),
        (0.1, 0.15, 1.001, 1e6),
        (0.001, 0.0, 50.0, 50.00005),
    ):
        t_floor = Problem(a, b, v_i, v_f, True).by_start(-log(mpf(v_i)))[2].time
        for excess in (1e-4, 1e-7, 1e-10):
            cases.append(("short_floor", a, b, v_i, v_f, float(t_floor * (1 + mpf(excess))), 1))
    return cases


def solved(cases):
    """The rows of optimal problems, each with a word on its kind first; those without a physical answer are skipped."""
    for kind, *case in cases:
        try:
            row = optimal_row(*case[:5], bool(case[5]))
        except (Unphysical, AssertionError, ZeroDivisionError, ValueError) as error:
            print("skipped", kind, case, repr(error)[:80], file=sys.stderr)
            mp.dps = DIGITS
            continue
        yield [kind] + [repr(x) for x in case] + [show(x) for x in row]


def optimal_rows():
    rng = random.Random(1)
    cases = []
    for t_f in (0.02, 0.037, 0.049, 0.0496, 0.5, 10.0):
        cases.append(("paper", 0.03, 0.05, 3.0, 100.0, t_f, 1))
    for t_f in (0.3954148, 0.396, 0.4, 0.40015, 0.5, 10.0):
        cases.append(("paper_deceleration", 0.03, 0.05, 100.0, 3.0, t_f, 1))
    for _ in range(330):
        a = log_uniform(rng, 1e-4, 0.3)
        b = rng.choice([0.0, a, a * rng.random(), min(a * log_uniform(rng, 1, 8), 0.3)])
        v = rng.choice([log_uniform(rng, 2, 100), 1 + log_uniform(rng, 1e-3, 1)])
        ratio = rng.choice([log_uniform(rng, 1.1, 1e4), log_uniform(rng, 1.1, 1e6), 1 + log_uniform(rng, 1e-6, 0.1)])
        bounded = int(rng.random() < 0.75)
        if rng.random() < 0.6:
            v_i, v_f = v, v * ratio
            p = Problem(a, b, v_i, v_f, True)
            try:
                precision(16)
                t_cross = p.by_start(mpf(0))[2].time
            except Unphysical:
                continue
            finally:
                precision(DIGITS)
            t_f = float(t_cross * mpf(rng.choice([log_uniform(rng, 1e-9, 1), log_uniform(rng, 0.1, 10), log_uniform(rng, 1, 1e3)])))
            kind = "acceleration"
        else:
            v_i, v_f = v * ratio, v
            least = Problem(a, b, v_i, v_f, bool(bounded)).least_time()
            t_f = float(least * (1 + mpf(log_uniform(rng, 1e-6, 1e2)))) if rng.random() < 0.5 else float(least + mpf(log_uniform(rng, 1e-4, 10)) * a / mpf(v_f))
            kind = "deceleration"
        if t_f > 1e3:
            continue
        cases.append((kind, a, b, v_i, v_f, t_f, bounded))
    cases += short_floor_cases()
    yield from solved(cases)


def turning_rows():
    rng = random.Random(3)
    values = [s * 10.0**k for s in (1, -1) for k in (-300, -100, -20, -10, -8, -6, -4, -3, -2, -1)] + [0.25 * i for i in range(-40, 41) if i]
    values += [rng.uniform(-7, 7) for _ in range(150)] + [s * log_uniform(rng, 7, 1e3) for s in (1, -1) for _ in range(25)]
    values += [0.9999999999999999, 1.0000000000000002, -0.9999999999999999, -1.0000000000000002]
    for w in values:
        exact = mpf(w)
        if abs(w) < 1e-12:
            z = exact - exact**2 / 6 + exact**3 / 36
        else:
            z = ln_u(exact**2 / 2, 1 if w > 0 else -1)
        yield [repr(w), show(z)]


def gauss_rows():
    for n in (1, 2, 3, 5, 8, 16, 24, 33, 64, 100, 400):
        for i in range((n + 1) // 2):
            t = mp.cos(mp.pi * (i + mpf(3) / 4) / (n + mpf(1) / 2)) if 2 * i + 1 < n else mpf(0)
            for _ in range(8):
                p_0, p_1 = mpf(1), t
                for k in range(2, n + 1):
                    p_0, p_1 = p_1, ((2 * k - 1) * t * p_1 - (k - 1) * p_0) / k
                slope = n * (p_0 - t * p_1) / (1 - t * t)
                t -= p_1 / slope if n > 1 else 0
            yield [n, n - 1 - i, show(t), show(2 / ((1 - t * t) * slope * slope))]


def elementary_rows():
    rng = random.Random(6)
    values = [s * 10.0**k for s in (1, -1) for k in (-300, -30, -16, -8, -4, -2, -1)] + [0.3465735902799726, -0.3465735902799727, 0.7071067811865475, 1.4142135623730951]
    values += [rng.uniform(-1, 2) for _ in range(120)] + [s * log_uniform(rng, 1e-12, 700) for s in (1, -1) for _ in range(80)]
    for x in values:
        y = mpf(x)
        yield [repr(x), show(log(y)) if x > 0 else "", show(log1p(y)) if x > -1 else "", show(exp(y)), show(expm1(y))]


def friction_min(a, b, t_f, theta):
    """The least friction of a path along which theta is this cubic of t/t_f, by rising powers: at an end or where its derivative is zero.

    tau = 1 + a ln v + b ln theta with v = n/(t_f theta), n = t_f - theta', so that tau' = 0 where a n' theta + (b - a) theta' n = 0.
    """
    times = lambda p, q: [sum((p[i] * q[j - i] for i in range(len(p)) if 0 <= j - i < len(q)), mpf(0)) for j in range(len(p) + len(q) - 1)]
    derived = lambda p: [i * c for i, c in enumerate(p)][1:]
    at = lambda p, x: sum(c * x**i for i, c in enumerate(p))
    rise = derived(theta)
    n = [t_f - rise[0]] + [-c for c in rise[1:]]
    first, second = times(derived(n), theta), times(rise, n)
    sums = [a * (first[i] if i < len(first) else 0) + (b - a) * (second[i] if i < len(second) else 0) for i in range(max(len(first), len(second)))]
    while sums and sums[-1] == 0:
        sums.pop()
    roots = mp.polyroots(sums[::-1], maxsteps=500, extraprec=300) if len(sums) > 1 else []
    # Where rounding makes two real roots a complex pair, friction is flat, so that their real part will do.
    places = [mpf(0), mpf(1)] + [r.real for r in roots if abs(r.imag) < mpf(10) ** -10 and 0 < r.real < 1]
    tau = lambda x: 1 + a * log(at(n, x) / t_f) + (b - a) * log(at(theta, x))
    return min(tau(x) for x in places)


def landscape_point(a, b, v_i, v_f, t_f, a_2, a_3):
    a, b, v_i, v_f, t_f, a_2, a_3 = (mpf(x) for x in (a, b, v_i, v_f, t_f, a_2, a_3))
    q0, q1 = 1 / v_i, 1 / v_f
    a_4 = q1 - q0 - a_2 - a_3
    theta = lambda x: q0 + x * (a_2 + x * (a_3 + x * a_4))
    n = lambda x: t_f - a_2 - x * (2 * a_3 + x * 3 * a_4)
    inner = lambda roots: [r.real for r in roots if abs(r.imag) < mpf(10) ** -30 and 0 < r.real < 1]
    stationary = lambda c: inner(mp.polyroots(c, maxsteps=500, extraprec=300)) if any(c[:-1]) else []
    places = stationary([3 * a_4, 2 * a_3, a_2])
    turns = stationary([6 * a_4, 2 * a_3])
    if min(theta(x) for x in [mpf(0), mpf(1)] + places) <= 0 or min(n(x) for x in [mpf(0), mpf(1)] + turns) <= 0:
        return None, None, None, "infeasible"
    # v' = 0: theta_x^2 - t_f theta_x - theta theta_xx = 0.
    quartic = [3 * a_4**2, 4 * a_3 * a_4, 2 * a_3**2 - 3 * t_f * a_4, 2 * a_2 * a_3 - 2 * t_f * a_3 - 6 * q0 * a_4, a_2**2 - t_f * a_2 - 2 * q0 * a_3]
    while quartic and quartic[0] == 0:
        quartic.pop(0)
    v = lambda x: n(x) / (t_f * theta(x))
    velocities = [v(x) for x in [mpf(0), mpf(1)] + stationary(quartic)]
    v_min, v_max = min(velocities), max(velocities)
    f = lambda x: (1 + a * log(n(x) / t_f) + (b - a) * log(theta(x))) * n(x) / theta(x)
    cuts = set([mpf(0), mpf(1)] + places + turns)
    # Zeros near the interval: cut geometrically towards their real parts.
    for c in ([a_4, a_3, a_2, q0], [-3 * a_4, -2 * a_3, t_f - a_2]):
        while c and c[0] == 0:
            c.pop(0)
        for r in mp.polyroots(c, maxsteps=500, extraprec=300) if len(c) > 1 else []:
            x = min(max(r.real, mpf(0)), mpf(1))
            gap = max(abs(r - x), mpf(10) ** -20)
            d = gap
            while d < 1:
                cuts |= {y for y in (x - d, x + d) if 0 < y < 1}
                d *= 8
            cuts.add(x)
    work = quad(f, sorted(cuts))
    if friction_min(a, b, t_f, [q0, a_2, a_3, a_4]) < 0:
        return work, v_min, v_max, "negative_friction"
    return work, v_min, v_max, "ok" if v_min >= 1 else "below_bound"


def landscape_rows():
    rng = random.Random(4)
    paper = [(0.03, 0.05, 3.0, 100.0, t) for t in (0.02, 0.037, 0.049)]
    cases = []
    for base, best in zip(paper, [(-0.1198296, -0.0664228), (-0.0536409, 0.2725815), (-0.0761757, 0.4910504)]):
        cases.append((*base, *best))
        for _ in range(60):
            cases.append((*base, rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)))
    while len(cases) < 330:
        a = log_uniform(rng, 1e-4, 0.3)
        b = rng.choice([0.0, a, a * log_uniform(rng, 0.1, 10)])
        v_i, v_f = (1 + log_uniform(rng, 1e-3, 1e3) for _ in range(2))
        t_f = log_uniform(rng, 1e-9, 1e3)
        rise = 1 / v_f - 1 / v_i
        # A path that leans on the steady one: theta stays between the ends or grows like t.
        lean = min(t_f, 1.0)
        cases.append((a, b, v_i, v_f, t_f, rise * rng.uniform(0, 3) + lean * rng.uniform(-0.5, 1), rise * rng.uniform(-3, 3) + lean * rng.uniform(-1, 0.5)))
    border = []
    for case in cases[:90]:
        # Walk from a feasible point towards a far one and stop just inside the border.
        if landscape_point(*case)[-1] == "infeasible":
            continue
        angle = rng.uniform(0, 6.283185307179586)
        far = (float(case[5] + 3 * mp.cos(angle)), float(case[6] + 3 * mp.sin(angle)))
        inside, outside = mpf(0), mpf(1)
        at = lambda s: (*case[:5], float(case[5] + s * (mpf(far[0]) - case[5])), float(case[6] + s * (mpf(far[1]) - case[6])))
        for _ in range(50):
            middle = (inside + outside) / 2
            feasible = landscape_status(*at(middle))
            inside, outside = (middle, outside) if feasible else (inside, middle)
        for distance in rng.sample([1e-3, 1e-6, 1e-9, 1e-12], 2):
            border.append(at(inside * (1 - mpf(distance))))
    for case in cases + border:
        work, v_min, v_max, status = landscape_point(*case)
        yield [repr(x) for x in case] + [show(work), show(v_min), status, show(v_max)]


def natural_rows():
    """Coefficients in natural units, whose products with the duration are no doubles; most are close to the border of feasibility."""
    rng = random.Random(8)
    cases = [
        (0.03781888451588019, 0.03781888451588019, 3.1018218799667956, 43401.354232566286, 16.636174225670654, -0.01703758495701251, -0.0014750639772272733),
        (0.025222672778663833, 0.025222672778663833, 11.913590201879229, 98403.75774227892, 2.4265525198504745e-06, -25955.54274215368, -21368352735.20225),
    ]
    while len(cases) < 80:
        a = log_uniform(rng, 1e-3, 0.1)
        b = rng.choice([0.0, a, a * log_uniform(rng, 0.1, 10)])
        v_i, v_f = log_uniform(rng, 1.5, 1e3), log_uniform(rng, 1.5, 1e3)
        t_f = log_uniform(rng, 1e-4, 1e2)
        rise, lean = 1 / v_f - 1 / v_i, min(t_f, 1.0)
        a_2, a_3 = rise * rng.uniform(0, 3) + lean * rng.uniform(-0.5, 1), rise * rng.uniform(-3, 3) + lean * rng.uniform(-1, 0.5)
        inside = natural(a, b, v_i, v_f, t_f, a_2 / t_f, a_3 / t_f**2)
        if not landscape_status(*inside):
            continue
        angle = rng.uniform(0, 6.283185307179586)
        far = (a_2 + 3 * math.cos(angle), a_3 + 3 * math.sin(angle))
        at = lambda s: (a, b, v_i, v_f, t_f, float((a_2 + s * (far[0] - a_2)) / t_f), float((a_3 + s * (far[1] - a_3)) / mpf(t_f) ** 2))
        low, high = mpf(0), mpf(1)
        for _ in range(50):
            middle = (low + high) / 2
            low, high = (middle, high) if landscape_status(*natural(*at(middle))) else (low, middle)
        cases += [at(low * (1 - mpf(distance))) for distance in rng.sample([1e-6, 1e-9, 1e-11, 1e-13], 2)]
    for case in cases:
        work, v_min, v_max, status = landscape_point(*natural(*case))
        yield [repr(x) for x in case] + [show(work), show(v_min), status, show(v_max)]


def natural(a, b, v_i, v_f, t_f, alpha_2, alpha_3):
    """The arguments of a shortcut with coefficients relative to the duration."""
    return a, b, v_i, v_f, t_f, mpf(alpha_2) * mpf(t_f), mpf(alpha_3) * mpf(t_f) ** 2


def landscape_status(a, b, v_i, v_f, t_f, a_2, a_3):
    """Feasible or not, without the quadrature."""
    v_i, v_f, t_f, a_2, a_3 = (mpf(x) for x in (v_i, v_f, t_f, a_2, a_3))
    q0 = 1 / v_i
    a_4 = 1 / v_f - q0 - a_2 - a_3
    theta = lambda x: q0 + x * (a_2 + x * (a_3 + x * a_4))
    n = lambda x: t_f - a_2 - x * (2 * a_3 + x * 3 * a_4)
    places, turns = [mpf(0), mpf(1)], [mpf(0), mpf(1)]
    discriminant = a_3 * a_3 - 3 * a_2 * a_4
    if a_4 != 0:
        if discriminant >= 0:
            places += [(-a_3 + s * sqrt(discriminant)) / (3 * a_4) for s in (1, -1)]
        turns.append(-a_3 / (3 * a_4))
    elif a_3 != 0:
        places.append(-a_2 / (2 * a_3))
    return min(theta(x) for x in places if 0 <= x <= 1) > 0 and min(n(x) for x in turns if 0 <= x <= 1) > 0


def best_rows():
    """Interior minima: Newton's method on the gradient of the work, all by quadrature at 30 digits; the gap is the plain difference."""
    rng = random.Random(5)
    cases = [(0.03, 0.05, 3.0, 100.0, 0.02, 1), (0.03, 0.05, 3.0, 100.0, 0.037, 1), (0.03, 0.05, 3.0, 100.0, 0.049, 0)]
    while len(cases) < 30:
        a = log_uniform(rng, 5e-3, 0.1)
        b = a * log_uniform(rng, 0.2, 3)
        v_i = log_uniform(rng, 2, 20)
        v_f = v_i * log_uniform(rng, 1.2, 60)
        p = Problem(a, b, v_i, v_f, True)
        try:
            t_cross = p.by_start(mpf(0))[2].time
        except Unphysical:
            continue
        cases.append((a, b, v_i, v_f, float(t_cross * mpf(rng.uniform(0.2, 0.95))), 1))
    for case in cases:
        try:
            a, b, v_i, v_f, t_f = (mpf(x) for x in case[:5])
            optimum = optimal_row(*case[:5], bool(case[5]))[0]
            q0, rise = 1 / v_i, 1 / v_f - 1 / v_i
            kappa, s = 1 - a * log(t_f), b - a

            def moments(a_2, a_3):
                a_4 = rise - a_2 - a_3
                theta = lambda x: q0 + x * (a_2 + x * (a_3 + x * a_4))
                n = lambda x: t_f - a_2 - x * (2 * a_3 + x * 3 * a_4)
                if any(theta(mpf(i) / 40) <= 0 or n(mpf(i) / 40) <= 0 for i in range(41)):
                    return None
                t2, t3 = (lambda x: x - x**3), (lambda x: x**2 - x**3)
                n2, n3 = (lambda x: 3 * x * x - 1), (lambda x: 3 * x * x - 2 * x)

                def parts(x):
                    q, m = theta(x), n(x)
                    tau = kappa + a * log(m) + s * log(q)
                    return q, m, tau, (tau + a) / q, (s - tau) * m / q**2, a / (m * q), (s - tau - a) / q**2, m * (2 * tau - 3 * s) / q**3

                def second(x, dn, dq, en, eq):
                    q, m, tau, hn, hq, hnn, hnq, hqq = parts(x)
                    return hnn * dn(x) * en(x) + hnq * (dn(x) * eq(x) + en(x) * dq(x)) + hqq * dq(x) * eq(x)

                cuts = [0, 0.5, 0.8, 0.95, 1]
                w = quad(lambda x: (lambda p: p[2] * p[1] / p[0])(parts(x)), cuts)
                g = [quad(lambda x: (lambda p: p[3] * dn(x) + p[4] * dq(x))(parts(x)), cuts) for dn, dq in ((n2, t2), (n3, t3))]
                h = [quad(lambda x: second(x, *pair), cuts) for pair in ((n2, t2, n2, t2), (n2, t2, n3, t3), (n3, t3, n3, t3))]
                return w, g, h

            mp.dps = 15
            start = None
            grid = [(mpf(i) / 12 * q0 * 3, mpf(j) / 12 * q0 * 3) for i in range(-12, 13) for j in range(-12, 13)]
            for a_2, a_3 in grid:
                point = landscape_status(0, 0, v_i, v_f, t_f, a_2, a_3) and moments(a_2, a_3)
                if point and (start is None or point[0] < start[0]):
                    start = (point[0], a_2, a_3)
            _, a_2, a_3 = start
            for mp.dps, steps in ((15, 25), (30, 4)):
                for _ in range(steps):
                    w, g, h = moments(a_2, a_3)
                    d = h[0] * h[2] - h[1] ** 2
                    step = (-(h[2] * g[0] - h[1] * g[1]) / d, -(h[0] * g[1] - h[1] * g[0]) / d)
                    fraction = mpf(1)
                    while True:
                        trial = moments(a_2 + fraction * step[0], a_3 + fraction * step[1]) if landscape_status(0, 0, v_i, v_f, t_f, a_2 + fraction * step[0], a_3 + fraction * step[1]) else None
                        if trial and trial[0] <= w * (1 + mpf(10) ** (3 - mp.dps)):
                            break
                        fraction /= 2
                        if fraction < mpf(10) ** -6:
                            raise Unphysical
                    a_2, a_3 = a_2 + fraction * step[0], a_3 + fraction * step[1]
            mp.dps = DIGITS
            work, v_min, v_max, status = landscape_point(*case[:5], a_2, a_3)
            if status == "infeasible" or (case[5] and status != "ok"):
                continue
            yield [repr(x) for x in case] + [show(x) for x in (a_2, a_3, work, optimum, (work - optimum) / optimum, v_min, v_max)]
        except (Unphysical, AssertionError, TypeError) as error:
            mp.dps = DIGITS
            print("skipped", case, repr(error)[:80], file=sys.stderr)


def touching_rows():
    """Best shortcuts that touch v = 1 inside: v = 1 and v' = 0 at a place x, and the gradient of the work is along that of v there. Newton's method with
    differences at 30 digits, each case from the one before; the first from the paper's picture."""
    a, b, v_i, v_f = mpf(0.03), mpf(0.05), mpf(3), mpf(100)
    q0, rise, s = 1 / v_i, 1 / v_f - 1 / v_i, b - a
    near = mp.matrix([-0.07618, 0.49105, 0.45])
    for t_f in (0.049, 0.05, 0.052, 0.055, 0.06, 0.065):
        time = mpf(t_f)

        def place(x, a_2, a_3):
            a_4 = rise - a_2 - a_3
            return q0 + x * (a_2 + x * (a_3 + x * a_4)), time - a_2 - x * (2 * a_3 + x * 3 * a_4)

        def conditions(a_2, a_3, x):
            a_4 = rise - a_2 - a_3
            q, m = place(x, a_2, a_3)
            slope = (-2 * a_3 - 6 * x * a_4) * q - m * (time - m)
            # Change of q and n with a_2 and a_3.
            change = [((lambda y: y - y**3), (lambda y: 3 * y * y - 1)), ((lambda y: y**2 - y**3), (lambda y: 3 * y * y - 2 * y))]
            of_v = [(dn(x) * q - m * dq(x)) for dq, dn in change]

            def along(y, dq, dn):
                theta, n = place(y, a_2, a_3)
                tau = 1 + a * log(n / time) + s * log(theta)
                return (tau + a) / theta * dn(y) + (s - tau) * n / theta**2 * dq(y)

            of_w = [quad(lambda y: along(y, *pair), [0, 0.25, 0.5, 0.8, 0.95, 1]) for pair in change]
            return [m / (time * q) - 1, slope, of_w[0] * of_v[1] - of_w[1] * of_v[0]]

        if t_f == 0.049:
            velocity = lambda x: place(x, near[0], near[1])[1] / place(x, near[0], near[1])[0]
            near[2] = min((mpf(i) / 200 for i in range(201)), key=velocity)
        mp.dps = 30
        near = mp.findroot(lambda *z: conditions(*z), tuple(near), tol=mpf(10) ** -50, maxsteps=30)
        mp.dps = DIGITS
        a_2, a_3 = near[0], near[1]
        work, v_min, v_max, status = landscape_point(a, b, v_i, v_f, time, a_2, a_3)
        assert abs(v_min - 1) < mpf(10) ** -22, v_min
        optimum = optimal_row(0.03, 0.05, 3.0, 100.0, t_f, True)[0]
        case = (0.03, 0.05, 3.0, 100.0, t_f, 1)
        yield [repr(x) for x in case] + [show(x) for x in (a_2, a_3, work, optimum, (work - optimum) / optimum, v_max)]


def edge_rows():
    """Optima near where one regime passes into another, and near v = 1."""
    materials = [(0.03, 0.05, 3.0, 100.0), (0.03, 0.05, 100.0, 3.0), (0.1, 0.02, 3.0, 2.9)]
    cases = []
    for small in (1e-3, 1e-6, 1e-9, 1e-12):
        cases.append(("v_near_1", 0.03, 0.05, 1 + small, 40.0, 0.3, 1))
        least = Problem(0.03, 0.05, 40.0, 1 + small, True).least_time()
        cases.append(("v_near_1", 0.03, 0.05, 40.0, 1 + small, float(least + 1), 1))
    for a, b, v_i, v_f in materials:
        precision(DIGITS)
        times = crossover_row(a, b, v_i, v_f)
        for name, t in zip(("t_cross", "t_floor", "t_cheapest", None, "t_turn", "t_free", "t_free"), times):
            if name is None or t is None:
                continue
            for fraction in (1e-7, 1e-13):
                cases.append(("near_" + name, a, b, v_i, v_f, float(t * (1 + mpf(fraction))), 1))
    yield from solved(cases)


def stability_row(a, b, k, m, v):
    """Eigenvalues of steady sliding, times v: the roots of the characteristic polynomial, to many more digits than are shown."""
    law_a, law_b, stiffness, inertia = mpf(a), mpf(b), mpf(k), mpf(m) * mpf(v) ** 2
    # Of what cancels near the critical stiffness, of roots decades apart, and of close roots.
    mp.dps = 120
    roots = mp.polyroots([inertia, inertia + law_a, stiffness + law_a - law_b, stiffness], maxsteps=2000, extraprec=2000)
    mp.dps = DIGITS
    pair = [r for r in roots if abs(r.imag) > abs(r) * mpf(10) ** -50]
    if pair:
        growth, frequency = pair[0].real, abs(pair[0].imag)
        decay = next(r.real for r in roots if all(r is not p for p in pair))
    else:
        decay, _, growth = sorted(r.real for r in roots)
        frequency = mpf(0)
    return [repr(x) for x in (a, b, k, m, v)] + [show(x * mpf(v)) for x in (growth, frequency, decay)]


def stability_rows():
    rng = random.Random(6)
    cases = [(0.005, 0.01, k, 2.5e-16, v) for k in (1e-3, 7.5e-3, 0.1) for v in (1e5, 3.2e6)]
    while len(cases) < 200:
        a = log_uniform(rng, 1e-4, 0.3)
        b = rng.choice([0.0, a * log_uniform(rng, 0.1, 1), a * log_uniform(rng, 1, 10)])
        v = log_uniform(rng, 1, 1e8)
        cases.append((a, b, log_uniform(rng, 1e-5, 1e2), a * log_uniform(rng, 1e-8, 1e6) / v**2, v))
    while len(cases) < 300:
        # Near the critical stiffness.
        a = log_uniform(rng, 1e-4, 0.3)
        b = a * log_uniform(rng, 1.01, 10)
        v = log_uniform(rng, 1, 1e8)
        m = a * log_uniform(rng, 1e-4, 1e4) / v**2
        fraction = rng.choice([1, -1]) * log_uniform(rng, 1e-13, 1e-2)
        critical = (mpf(b) - mpf(a)) * (1 + mpf(m) * mpf(v) ** 2 / mpf(a))
        cases.append((a, b, float(critical * (1 + mpf(fraction))), m, v))
    for case in cases:
        yield stability_row(*case)


def hopf_coefficient(a, b, inertia):
    """The first Lyapunov coefficient by Kuznetsov's multilinear forms, in units of l/v for time and ln v for the amplitude, for (z, y, x) of
    z' = k (1 - e^x), y' = e^-y - e^x, M e^x x' = z - a x - b y at the critical stiffness; linear systems by elimination."""
    a, b, mass = mpf(a), mpf(b), mpf(inertia)
    k = (b - a) * (1 + mass / a)
    omega = sqrt((k + a - b) / mass)
    i = mp.mpc(0, 1)
    jacobian = mp.matrix([[0, 0, -k], [0, -1, -1], [1 / mass, -b / mass, -a / mass]])
    q = mp.matrix([i * k / omega, -1 / (1 + i * omega), 1])
    p = mp.matrix([i / (omega * mass), (b / mass) / (i * omega - 1), 1])
    assert mp.norm(jacobian * q - i * omega * q) < mpf(10) ** -30 * mp.norm(q) * mp.mnorm(jacobian)
    assert mp.norm(jacobian.T * p + i * omega * p) < mpf(10) ** -30 * mp.norm(p) * mp.mnorm(jacobian)
    pull = lambda u: (u[0] - b * u[1] - a * u[2]) / mass
    second = lambda u, v: mp.matrix([-k * u[2] * v[2], u[1] * v[1] - u[2] * v[2], -(u[2] * pull(v) + v[2] * pull(u))])

    def third(u, v, w):
        x = u[2] * v[2] * pull(w) + u[2] * w[2] * pull(v) + v[2] * w[2] * pull(u)
        return mp.matrix([-k * u[2] * v[2] * w[2], -u[1] * v[1] * w[1] - u[2] * v[2] * w[2], x])

    mirrored = q.apply(mp.conj)
    still = mp.lu_solve(jacobian, second(q, mirrored))
    double = mp.lu_solve(2 * i * omega * mp.eye(3) - jacobian, second(q, q))
    total = third(q, q, mirrored) - 2 * second(q, still) + second(mirrored, double)
    dot = lambda u, v: sum(mp.conj(u[n]) * v[n] for n in range(3))
    return (dot(p, total) / dot(p, q)).real / (2 * omega)


def hopf_rows():
    rng = random.Random(7)
    cases = [(0.005, 0.01, 1e5, 3.2e6, 7.5e-3, 2.5e-16), (0.005, 0.01, 1e5, 7e5, 7.5e-3, 2.5e-16)]
    while len(cases) < 60:
        a = log_uniform(rng, 1e-4, 0.3)
        b = a * (1 + log_uniform(rng, 1e-3, 10))
        v = log_uniform(rng, 1.5, 1e8)
        cases.append((a, b, 0.5 * v + 0.6, v, a, a * log_uniform(rng, 1e-6, 1e4) / v**2))
    # Near where the kind changes: where a mu = 1/(3 + 2 sqrt(3 + b/a)).
    for fraction in (1e-2, -1e-2, 1e-6, -1e-6, 1e-12, -1e-12):
        mu = (1 + mpf(fraction)) / (3 + 2 * sqrt(3 + mpf(0.01) / mpf(0.005)))
        cases.append((0.005, 0.01, 1e3, 1024.0, 7.5e-3, float(mpf(0.005) * mu / 2**20)))
    cases += [(0.005, 0.01, 10.0, 100.0, 0.1, 0.0), (0.01, 0.01, 10.0, 100.0, 0.1, 1e-6), (0.02, 0.01, 10.0, 100.0, 0.1, 1e-6)]
    for a, b, v_i, v_f, k, m in cases:
        coefficient = hopf_coefficient(a, b, mpf(m) * mpf(v_f) ** 2) if b > a and m > 0 else None
        yield [repr(x) for x in (a, b, v_i, v_f, k, m)] + [show(coefficient)]


TABLES = {
    "gauss": (["n", "i", "x", "weight"], gauss_rows),
    "elementary": (["x", "ln", "ln_1p", "exp", "exp_m1"], elementary_rows),
    "turning": (["w", "ln_u"], turning_rows),
    "crossover": (["a", "b", "v_i", "v_f", "t_cross", "t_floor", "t_cheapest", "t_min", "t_turn", "t_free_in", "t_free_out",
                   "work_at_t_cross", "work_at_t_floor", "work_at_t_cheapest", "work_at_t_min", "work_at_t_turn"], crossover_rows),
    "optimal": (["regime", "a", "b", "v_i", "v_f", "t_f", "bounded", "work", "v_start", "v_end", "time_at_floor", "hamiltonian", "theta_max", "strategy"], optimal_rows),
    "landscape": (["a", "b", "v_i", "v_f", "t_f", "a_2", "a_3", "work", "v_min", "status", "v_max"], landscape_rows),
    "landscape_natural": (["a", "b", "v_i", "v_f", "t_f", "alpha_2", "alpha_3", "work", "v_min", "status", "v_max"], natural_rows),
    "stability": (["a", "b", "k", "m", "v", "growth_rate", "frequency", "decay_rate"], stability_rows),
    "optimal_edges": (["regime", "a", "b", "v_i", "v_f", "t_f", "bounded", "work", "v_start", "v_end", "time_at_floor", "hamiltonian", "theta_max", "strategy"], edge_rows),
    "best_cubic_touching": (["a", "b", "v_i", "v_f", "t_f", "bounded", "a_2", "a_3", "work", "work_optimal", "gap", "v_max"], touching_rows),
    "hopf": (["a", "b", "v_i", "v_f", "k", "m", "first_lyapunov_coefficient"], hopf_rows),
    "best_cubic": (["a", "b", "v_i", "v_f", "t_f", "bounded", "a_2", "a_3", "work", "work_optimal", "gap", "v_min", "v_max"], best_rows),
}

if __name__ == "__main__":
    for name in sys.argv[1:] or TABLES:
        mp.dps = DIGITS
        header, rows = TABLES[name]
        write(name, header, rows())
