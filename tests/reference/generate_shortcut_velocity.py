#!/usr/bin/env python3
"""Reference table of the families step, cubic and bounded_velocity.

    venv/bin/pip install mpmath gmpy2 python-flint && venv/bin/python generate_shortcut_velocity.py          # or name the families

step and cubic are tanh-sinh quadratures of their formulas with mpmath at 40 digits; extrema the greatest of a grid, then golden sections. Theta of
bounded_velocity is a Taylor series of 90 terms on every step, with Arb at 66 digits; where theta follows the velocity it is the sum
1/v - (1/v)(1/v)'/t_f + ... instead. Its parameter is bracketed at few digits and finished by Newton's method; it is run again with other steps,
terms and digits, and written where 25 digits agree. No collocation, no dilogarithm. Inputs are doubles, written by repr and used exactly; a time
near t_min counts as the double that it is.
"""
import csv, math, random, sys
from flint import arb, arb_poly, arb_series, ctx
from generate import friction_min
from mpmath import exp, log, log1p, mp, mpf, nstr, quad, sqrt

DIGITS = 40
# Bits, terms and accuracy of a step: a rough pass, one close to the least time, the pass that counts, and the one that checks it.
ROUGH, CLOSE, FINE, OTHER = (80, 20, 1e-7), (140, 40, 1e-20), (220, 90, 1e-40), (280, 110, 1e-46)
NOTHING = 140
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
    # At one velocity friction rises or falls with theta, which goes one way.
    status = "ok" if min(tau(mpf(0)), tau(t_f)) >= 0 else "negative_friction"
    return None, work, v_f, v_f, max(tau(mpf(0)), tau(t_f)), (v_f / v_i - 1) * exp(-end), status


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
    status = "ok" if v_min >= 1 else "below_bound"
    if friction_min(a, b, t_f, [1 / v_i, mpf(0), -3 * d / (v_i * v_f), 2 * d / (v_i * v_f)]) < 0:
        status = "negative_friction"
    return None, work, v_min, v_max, greatest(tau, fine), mpf(0), status


def at(series, h):
    return arb_poly(series.coeffs())(h).mid()


class Bounded:
    """v = 1 + w_i exp(L x - c x (1 - x)), and theta along it."""

    def __init__(self, v_i, v_f, t_f):
        self.w_i, self.v_i, self.v_f, self.t_f = v_i - 1, v_i, v_f, t_f

    def run(self, c, precision, gather=None):
        """ln(theta(t_f) v_f), and its derivative by c."""
        ctx.prec, terms, eps = precision
        l, t_f, ln_w = ((self.v_f - 1) / self.w_i).log(), self.t_f, self.w_i.log()
        x, theta, turn, since = arb(0), 1 / self.v_i, arb(0), arb(0)
        # Where v - 1 is below e^-NOTHING it is left out.
        quiet = None
        root = ((c - l) / (2 * c)) ** 2 - (ln_w + NOTHING) / c
        if c > 0 and root > 0:
            low, high = ((c - l) / (2 * c) - root.sqrt()).mid(), ((c - l) / (2 * c) + root.sqrt()).mid()
            quiet = (max(low, arb(0), key=float), min(high, arb(1), key=float)) if low < 1 and high > 0 else None
        while x < 1:
            still = quiet is not None and quiet[0] <= x < quiet[1]
            limit = quiet[0] if quiet is not None and x < quiet[0] else quiet[1] if still else arb(1)
            ctx.cap = terms
            slope = l - c * (1 - 2 * x)
            exponent = arb_series([ln_w + l * x - c * x * (1 - x), slope, c], terms)
            w = arb_series([0], terms) if still else exponent.exp()
            v = 1 + w
            lean = -arb_series([x * (1 - x), 1 - 2 * x, -1], terms) * w
            reach = limit - x
            if not still:
                reach = min(reach, 8 / (abs(slope) + abs(c).sqrt()), key=float)
            slow = self.follow(v, lean, eps) if since > 110 else None
            if slow:
                thetas, turns = slow
            else:
                reach = min(reach, 12 / (t_f * v[0]), key=float)
                decay = (-t_f * v.integral()).exp()
                thetas = decay * (theta + t_f * (1 / decay).integral())
                turns = decay * (turn - t_f * (thetas * lean / decay).integral())
            followed = [(series, max(abs(series[0]), arb("1e-30"), key=float)) for series in (thetas, w)]
            if gather is not None:
                followed += [(v.log(), arb(1)), (thetas.log(), arb(1))]
            for series, size in followed:
                for n in (terms - 3, terms - 2):
                    if abs(series[n]) > 0:
                        reach = min(reach, (eps * size / abs(series[n])) ** (arb(1) / n), key=float)
            h = reach.mid() if float(reach) < 0.999 * float(limit - x) else (limit - x).mid()
            if gather is not None:
                gather(v, thetas, h)
            theta, turn = at(thetas, h), at(turns, h)
            since = (since + t_f * at(v.integral(), h)).mid()
            x = limit if h == (limit - x).mid() else (x + h).mid()
        return (theta * self.v_f).log(), turn / theta

    def follow(self, v, lean, eps):
        """Theta and its derivative by c where they follow v: theta = (1 - theta'/t_f)/v, iterated."""
        theta, turn = 1 / v, -lean / (v * v)
        for _ in range(16):
            before = theta[0], turn[0]
            theta = (1 - theta.derivative() / self.t_f) / v
            turn = (-theta * lean - turn.derivative() / self.t_f) / v
            changes = abs(theta[0] - before[0]) / theta[0], abs(turn[0] - before[1])
            if changes[0] < eps and changes[1] <= eps * (abs(turn[0]) + theta[0] * eps):
                return theta, turn
        return None

    def member(self):
        spare = self.t_f - (self.v_f / self.v_i).log() - ((self.v_i - 1) / (self.v_f - 1)).log()
        precision = CLOSE if spare < self.t_f / 1000 else ROUGH
        beyond = lambda q: float(self.run(arb(math.sinh(q)), precision)[0])
        low, high = -0.5, 0.5
        while beyond(low) > 0:
            high, low = low, low - (0.5 + 0.5 * abs(low))
        while beyond(high) < 0:
            low, high = high, high + (0.5 + 0.5 * abs(high))
        while high - low > 1e-3:
            middle = (low + high) / 2
            low, high = (middle, high) if beyond(middle) < 0 else (low, middle)
        c = arb(math.sinh((low + high) / 2))
        for _ in range(16):
            end = self.run(c, FINE)
            step = -(end[0] / end[1]).mid()
            c = (c + step).mid()
            if abs(step) <= 1e-28 * abs(c):
                return c
        raise ArithmeticError("Newton's method does not settle")

    def numbers(self, a, b, c, precision):
        """Work, and the greatest and the least friction."""
        work, friction = arb(0), []

        def gather(v, theta, h):
            nonlocal work
            tau = 1 + a * v.log() + b * theta.log()
            work = (work + self.t_f * at((tau * v).integral(), h)).mid()
            slope = arb_poly(tau.derivative().coeffs())
            friction.extend([tau[0].mid(), at(tau, h)])
            places = [h * i / 16 for i in range(17)]
            for low, high in zip(places, places[1:]):
                sign = 1 if slope(low) > 0 else -1
                if not (sign * slope(low) > 0 and sign * slope(high) < 0):
                    continue
                for _ in range(120):
                    middle = ((low + high) / 2).mid()
                    low, high = (middle, high) if sign * slope(middle) > 0 else (low, middle)
                friction.append(at(tau, low))

        self.run(c, precision, gather)
        return work, max(friction, key=float), min(friction, key=float)


def bounded_velocity(*case):
    ctx.prec = OTHER[0]
    a, b, v_i, v_f, t_f = map(arb, case)
    spare = t_f - (v_f / v_i).log() - ((v_i - 1) / (v_f - 1)).log()
    if spare <= 0:
        return (None,) * 6 + ("infeasible",)
    curve = Bounded(v_i, v_f, t_f)
    c = curve.member()
    found, check = (curve.numbers(a, b, c, precision) for precision in (FINE, OTHER))
    end, turn = curve.run(c, OTHER)
    off = [abs(end / turn / c)] + [abs((x - y) / y) for x, y in zip(found[:2], check)]
    assert all(difference < 1e-25 for difference in off), [x.str(3) for x in off]
    l = ((v_f - 1) / (v_i - 1)).log()
    top, velocities = (c - l) / (2 * c), [v_i, v_f]
    if top > 0 and top < 1:
        velocities.append(1 + (v_i - 1) * (l * top - c * top * (1 - top)).exp())
    numbers = c / t_f**2, check[0], min(velocities, key=float), max(velocities, key=float), check[1]
    return *(mpf(x.mid().str(30, radius=False)) for x in numbers), mpf(0), "ok" if check[2] >= 0 else "negative_friction"


FAMILIES = {"step": step, "cubic": cubic, "bounded_velocity": bounded_velocity}


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def cases(family, rng, random_rows):
    paper = [(0.03, 0.05, 3.0, 100.0, t) for t in (0.02, 0.037, 0.049)]
    yield from paper
    yield from [(0.03, 0.05, 100.0, 3.0, 0.5)]
    ends = [(1.001, 1e8), (1e8, 1.001), (1e8, 1e7), (1e7, 1e8), (1.001, 1.01), (1.01, 1.001), (3.0, 3.000003), (3.000003, 3.0)]
    for v_i, v_f in ends:
        for fraction in (1e-6, 1.0, 1e3):
            yield (0.03, 0.05, v_i, v_f, fraction / v_f)
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
    with open("shortcut_velocity.csv", "w", newline="") as file:
        file.write("# made by generate_shortcut_velocity.py, mpmath at 40 digits and more, quadrature; bounded_velocity by Taylor series\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADER)
        for family, rows in (("step", 40), ("cubic", 40), ("bounded_velocity", 25)):
            for case in cases(family, rng, rows):
                if family not in (sys.argv[1:] or FAMILIES):
                    continue
                mp.dps = DIGITS
                try:
                    row = FAMILIES[family](*map(mpf, case)) if family != "bounded_velocity" else bounded_velocity(*case)
                except (ArithmeticError, AssertionError) as error:
                    print("skipped", family, case, error, file=sys.stderr, flush=True)
                    continue
                mp.dps = DIGITS
                writer.writerow([family] + [repr(x) for x in case] + [show(x) for x in row[:-1]] + [row[-1]])
                file.flush()
                print(family, case, show(row[1]), row[-1], file=sys.stderr, flush=True)
