#!/usr/bin/env python3
"""Reference tables of the family bounded_friction.

    venv/bin/pip install python-flint mpmath gmpy2
    venv/bin/python generate_shortcut_friction.py              # both tables, ten minutes; or name one of them

Arithmetic: 66 digits. ln theta is a Taylor series of 90 terms on every step, found by Newton's method on series, in the direction in which theta
contracts; alpha_3 is bracketed at few digits and finished by Newton's method with the derivative from the equation of variations. Extrema of the
velocity: zeros of the series of (ln v)'. Every member is run again with other steps, terms and digits, and written where 25 digits agree. No
collocation. Inputs are doubles, written by repr and used exactly.
"""
import csv, math, random, signal, sys
from flint import arb, arb_poly, arb_series, ctx

import ceilings
import generate
import optimal_ceilings

HEADER = ["a", "b", "v_i", "v_f", "t_f", "tau_ceiling", "t_least", "alpha", "work", "v_min", "v_max", "friction_max", "status"]
# Bits, terms and accuracy of a step: a rough pass, the pass that counts, and the one that checks it.
ROUGH, CLOSE, FINE, OTHER = (80, 20, 1e-7), (140, 40, 1e-20), (220, 90, 1e-42), (280, 110, 1e-48)
LOST = 40
MOST_STEPS = 4000


def at(series, h):
    return arb_poly(series.coeffs())(h).mid()


class Course:
    """tau over the distance d from the end where the integration starts; the numbers of a case are exact."""

    def __init__(self, case):
        self.a, self.b, v_i, v_f, self.t_f, self.tau_ceiling = case
        self.forward = self.b <= self.a
        self.first, self.last = (v_i, v_f) if self.forward else (v_f, v_i)
        self.sign = 1 if self.forward else -1

    def gap(self, v):
        return self.tau_ceiling - 1 - (self.a - self.b) * arb(v).log()

    def unit(self):
        return float((self.a / max(self.gap(self.first), self.gap(self.last), key=float)).mid())

    def run(self, alpha, precision, gather=None):
        """ln theta at the end beyond its target, and its derivative by alpha; None where theta is lost."""
        ctx.prec, terms, eps = precision
        a, b, gap, pace = self.a, self.b, self.gap(self.first).mid(), self.sign * self.t_f
        slope_r = (self.gap(self.last) / gap).log().mid()
        ratio = b / a
        d, u, turn = arb(0), -arb(self.first).log().mid(), arb(0)
        target = -arb(self.last).log().mid()
        floor = float(min(u, target, key=float)) - LOST
        # Where the exponent has risen so far that v is below 1e-400, or fallen so far that tau is tau_ceiling to all digits, nothing is resolved.
        level = math.log(float((a * 1000 + abs(self.tau_ceiling - 1) + b * (40 + abs(floor))) / gap)) if alpha > 0 else -250.0
        half, middle = alpha + slope_r, (1 + slope_r / alpha) / 2
        root = half * half / 4 / alpha - level
        quiet = None
        if float(root / alpha) > 0:
            spread = (root / alpha).sqrt()
            low, high = (middle - spread).mid(), (middle + spread).mid()
            quiet = (low, high) if low > 0 and high < 1 else None
        steps = 0
        while d < 1:
            steps += 1
            if steps > MOST_STEPS:
                raise ArithmeticError("too stiff for Taylor series")
            still = quiet is not None and d >= quiet[0] and d < quiet[1]
            limit = quiet[0] if quiet is not None and d < quiet[0] else quiet[1] if still else arb(1)
            if still and alpha > 0:
                # theta changes by the time alone.
                theta = u.exp() + pace * (limit - d)
                if float(theta) <= math.exp(floor):
                    return None
                turn, u, d = (turn * u.exp() / theta).mid(), theta.log().mid(), limit
                if gather is not None:
                    gather(arb(0), None, None)
                continue
            lean = arb_series([d * (1 - d), 1 - 2 * d, -1], 3)
            exponent = arb_series([d * (slope_r + alpha * (1 - d)), slope_r + alpha * (1 - 2 * d), -alpha], 3)
            ctx.cap = terms
            fall = gap * arb_series(exponent.coeffs(), terms).exp() if not still else arb_series([0], terms)
            drive = ((self.tau_ceiling - 1) - fall) / a
            us, known = arb_series([u], 1), 1
            while True:
                known = ctx.cap = min(2 * known, terms)
                us = arb_series(us.coeffs(), known)
                inverse = (-us).exp()
                v = (arb_series(drive.coeffs(), known) - ratio * us).exp()
                slope = pace * (ratio * v - inverse)
                decay = slope.integral().exp()
                rest = pace * (inverse - v) - us.derivative()
                us = us + decay * (rest / decay).integral()
                if known == terms:
                    break
            us = arb_series([c.mid() for c in us.coeffs()], terms)
            log_v = drive - ratio * us
            v = log_v.exp()
            reach = limit - d
            if not still:
                reach = min(reach, 10 / (abs(exponent[1]) + abs(alpha).sqrt()), 15 / abs(log_v[1]), key=float)
            for series, size in ((us, 1), (log_v, 1), (v, max(v[0], arb("1e-20"), key=float))):
                for n in (terms - 3, terms - 2):
                    last = abs(series[n])
                    if last > 0:
                        reach = min(reach, (eps * size / last) ** (arb(1) / n), key=float)
            h = reach.mid() if float(reach) < 0.999 * float(limit - d) else (limit - d).mid()
            # What the last terms cannot show: v may rise from nothing within the step.
            while abs(at(log_v, h) - log_v[0]) > 20:
                h = h / 2
            if h < 1e-45:
                return None
            slope = pace * (ratio * v - (-us).exp())
            decay = slope.integral().exp()
            push = pace * v * arb_series(lean.coeffs(), terms) * fall / a
            turn = at(decay * (turn + (push / decay).integral()), h)
            if gather is not None:
                gather(self.t_f * at(((1 + a * log_v + b * us) * v).integral(), h), log_v, h)
            u = at(us, h)
            if float(u) < floor or (float(u) < floor + LOST - 3 and float(abs(slope[0])) > 1e5):
                return None
            d = limit if h == (limit - d).mid() else (d + h).mid()
        return u - target, turn

    def member(self, least):
        """alpha_3 and the numbers of the member, where least is the time below which there is none."""
        unit = self.unit()
        precision = CLOSE if self.t_f - least < self.t_f / 1000 else ROUGH

        def beyond(q):
            # alpha is exponential in q far out, where the layers at the ends shrink like 1/alpha.
            end = self.run(arb(unit * math.sinh(q)), precision)
            if end is None:
                return -self.sign * 1e6
            return self.sign * float(end[0])

        low, high = -0.5, 0.5
        while beyond(low) > 0:
            high, low = low, low - (0.5 + 0.5 * abs(low))
        while beyond(high) < 0:
            low, high = high, high + (0.5 + 0.5 * abs(high))
        enough = 1e-3
        for _ in range(16):
            while high - low > enough:
                middle = (low + high) / 2
                low, high = (middle, high) if beyond(middle) < 0 else (low, middle)
                alpha = arb(unit * math.sinh((low + high) / 2))
            end = self.run(alpha, FINE)
            if end is None:
                enough, precision = enough / 30, CLOSE
                continue
            step = -(end[0] / end[1]).mid()
            alpha = (alpha + step).mid()
            if abs(step) <= 1e-28 * abs(alpha):
                break
        else:
            raise ArithmeticError("Newton's method does not settle")
        found, check = self.numbers(alpha, FINE), self.numbers(alpha, OTHER)
        end, turn = self.run(alpha, OTHER)
        off = [abs(end / turn / alpha)] + [abs((x - y) / y) for x, y in zip(found, check) if x != 0 or y != 0]
        assert all(difference < 1e-25 for difference in off), [x.str(3) for x in off]
        return [alpha] + check

    def numbers(self, alpha, precision):
        work, speeds = arb(0), [arb(self.first), arb(self.last)]

        def gather(part, log_v, h):
            nonlocal work
            if log_v is None:
                speeds.append(arb(0))
                return
            work = (work + part).mid()
            # Where tau is tau_ceiling to all digits, the velocity may be constant.
            speeds.append(log_v[0].exp())
            slope = arb_poly(log_v.derivative().coeffs())
            places = [h * i / 16 for i in range(17)]
            for low, high in zip(places, places[1:]):
                rising = slope(low) > 0
                if rising == (slope(high) > 0):
                    continue
                for _ in range(140):
                    middle = ((low + high) / 2).mid()
                    low, high = (middle, high) if (slope(middle) > 0) == rising else (low, middle)
                speeds.append(at(log_v, low).exp())

        self.run(alpha, precision, gather)
        friction = [self.tau_ceiling - self.gap(self.first), self.tau_ceiling - self.gap(self.last)]
        gap, slope_r = self.gap(self.first), (self.gap(self.last) / self.gap(self.first)).log()
        vertex = (slope_r / alpha + 1) / 2
        if alpha < 0 and vertex > 0 and vertex < 1:
            friction.append(self.tau_ceiling - gap * (vertex * (slope_r + alpha * (1 - vertex))).exp())
        speeds = [v.mid() for v in speeds]
        least = min(speeds)
        return [x.mid() for x in (work, least if least > 1e-307 else arb(0), max(speeds), max(friction, key=float))]


def least_time(case):
    """Time above which there is a member: that of v = 0 or that of tau = tau_ceiling; infinite if tau_ceiling is below an end."""
    a, b, v_i, v_f, t_f, tau_ceiling = case
    if min(float(tau_ceiling - 1 - (a - b) * arb(v).log()) for v in (v_i, v_f)) <= 0:
        return arb("inf")
    return 1 / arb(v_f) - 1 / arb(v_i) if v_f < v_i else fastest(case)


def fastest(case):
    """Time from 1/v_i to 1/v_f with tau = tau_ceiling: int dtheta/(theta v - 1), by Gauss-Legendre in ln theta, cuts crowded at both ends."""
    ctx.prec = FINE[0]
    a, b, v_i, v_f, _, tau_ceiling = case
    nodes = [(arb.legendre_p_root(8, k, True)) for k in range(8)]
    z_i, z_f = ((tau_ceiling - 1 - (a - b) * arb(v).log()) / a for v in (v_i, v_f))
    span, time = (arb(v_f) / v_i).log(), arb(0)
    cuts = [arb(0)] + [arb(2) ** (-60 + k) for k in range(57)] + [arb(k) / 400 for k in range(51, 350)]
    cuts += [1 - arb(2) ** (-3 - k) for k in range(57)] + [arb(1)]
    for low, high in zip(cuts, cuts[1:]):
        for x, w in nodes:
            s = low + (high - low) * (1 + x) / 2
            time += (high - low) / 2 * w * span * (-s * span).exp() / v_i / (z_i + s * (z_f - z_i)).expm1()
    return time.mid()


def cases():
    paper = (0.03, 0.05)
    for t_f in (0.02, 0.037, 0.049, 0.5):
        yield *paper, 3.0, 100.0, t_f, 1.6
    yield *paper, 100.0, 3.0, 0.5, 1.6
    # Existence: too short, and just long enough.
    yield *paper, 100.0, 3.0, 0.3, 1.6
    yield 0.05, 0.03, 3.0, 100.0, 1e-4, 1.1
    yield 0.05, 0.03, 3.0, 100.0, 0.1, 1.05
    for a, b in (paper, (0.05, 0.03), (0.03, 0.03)):
        for v_i, v_f in ((100.0, 3.0), (1e7, 1e3)):
            least = 1 / v_f - 1 / v_i
            for excess in (1e-12, 1e-6, 1e-2):
                yield a, b, v_i, v_f, least * (1 + excess), 1.6
        for excess in (1e-12, 1e-6, 1e-2):
            least = float(fastest((a, b, 3.0, 100.0, 0.0, 1.2)))
            yield a, b, 3.0, 100.0, least * (1 + excess), 1.2
    # The ratio b/a.
    for b in (0.0, 0.01, 0.0299999, 0.03, 0.030000000000000003, 0.0300001, 0.3, 1.5):
        for v_i, v_f in ((3.0, 100.0), (20.0, 5.0)):
            yield 0.03, b, v_i, v_f, max(1 / v_f - 1 / v_i, 0.0) + 2.0 / v_f, 2.0
    # The bound on friction, from just above both ends.
    for law in (paper, (0.05, 0.03)):
        for v_i, v_f, t_f in ((3.0, 100.0, 0.1), (100.0, 3.0, 0.6)):
            ends = max(1 + (law[0] - law[1]) * math.log(v) for v in (v_i, v_f))
            for above in (1e-9, 1e-4, 1e-1, 100.0):
                yield *law, v_i, v_f, t_f, ends + above
    # Velocities and times.
    for law in (paper, (0.05, 0.03)):
        for v_i, v_f in ((1.001, 1e8), (1e8, 1.001), (1e8, 1e7), (1e7, 1e8), (1.001, 1.01), (1.01, 1.001), (3.0, 3.000003), (3.000003, 3.0)):
            for fraction in (1e-6, 1.0, 1e3):
                yield *law, v_i, v_f, max(1 / v_f - 1 / v_i, 0.0) + fraction / v_f, 3.0
    chance = random.Random(5)
    for _ in range(40):
        a = 10 ** chance.uniform(-4, -1)
        b = a * 10 ** chance.uniform(-1, 1.7)
        v_i, v_f = 1 + 10 ** chance.uniform(-3, 4), 1 + 10 ** chance.uniform(-3, 4)
        t_f = max(1 / v_f - 1 / v_i, 0.0) + 10 ** chance.uniform(-4, 1.5) / v_f
        ends = max(1 + (a - b) * math.log(v) for v in (v_i, v_f))
        yield a, b, v_i, v_f, t_f, ends + 10 ** chance.uniform(-3, 1)
    yield from close_ceilings()


def close_ceilings():
    """Times and friction ceilings just above the least: the spare time is a small difference."""
    for a, b, v_i, v_f, excess in ((0.18, 0.0, 1.1, 1000.0, 1e-4), (0.27, 0.06, 7.0, 1e6, 1e-3), (0.03, 0.05, 3.0, 100.0, 1e-4)):
        tau_ceiling = max(1 + (a - b) * math.log(v) for v in (v_i, v_f)) + 5e-9
        yield a, b, v_i, v_f, float(fastest((a, b, v_i, v_f, 0.0, tau_ceiling))) * (1 + excess), tau_ceiling


def slowing():
    """From fast to slow within the physical domain: member and optimum differ by what is spent before a standstill."""
    reported = 0.0791568165593238, 0.17585334461193852, 12580.311800324214, 3.002349387942489
    for t_f, tau_ceiling in ((0.4055424603833174, 1.5), (0.4055424603833174, 3.0), (0.35, 1.5), (2.0, 1.5)):
        yield *reported, t_f, tau_ceiling
    chance = random.Random(7)
    for _ in range(36):
        a = 10 ** chance.uniform(-3, -0.53)
        b = chance.choice([0.0, a * chance.uniform(0.1, 0.99), a * chance.uniform(1.01, 3), a * 10 ** chance.uniform(0.3, 1.3)])
        v_f = 1 + 10 ** chance.uniform(-2, 3)
        v_i = v_f * 10 ** chance.uniform(0.5, 5)
        t_f = (1 / v_f - 1 / v_i) * (1 + 10 ** chance.uniform(-3, 1.5))
        ends = max(1 + (a - b) * math.log(v) for v in (v_i, v_f))
        if b <= 0.5 and 1e-3 <= t_f * v_i <= 1e7 and t_f <= 1e4:
            yield a, b, v_i, v_f, t_f, ends + 10 ** chance.uniform(-2, 0.5)


def least_work(case):
    """Least work under the bound on v, without it where the bound leaves too little time; None where it is not physical."""
    a, b, v_i, v_f, t_f, _ = case
    generate.mp.dps = generate.DIGITS
    bounded = t_f > generate.Problem(a, b, v_i, v_f, True).least_time()
    try:
        work = generate.optimal_row(a, b, v_i, v_f, t_f, bounded)[0]
    except generate.Unphysical:
        return "", int(bounded)
    return generate.show(work), int(bounded)


def least_work_under_ceiling(case):
    """The least work under tau_ceiling, by ceilings.py; None also where its quadrature does not find all digits within a minute."""
    a, b, v_i, v_f, t_f, tau_ceiling = case
    bounded = t_f > generate.Problem(a, b, v_i, v_f, True).least_time()
    signal.signal(signal.SIGVTALRM, optimal_ceilings.give_up)
    signal.setitimer(signal.ITIMER_VIRTUAL, 60)
    try:
        path = ceilings.solve(optimal_ceilings.maker(a, b, v_i, v_f, bounded, math.inf, tau_ceiling), t_f)[1]
        if path.lowest <= max(0, b - a):
            raise ceilings.Unphysical
        again = path.slopes()
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
    except (ceilings.Infeasible, ceilings.Unphysical, ArithmeticError, AssertionError) as error:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        print("no least work", case, repr(error), file=sys.stderr, flush=True)
        return "", int(bounded)
    # Time and work by another substitution.
    assert abs(again["time"] - path.time) < 1e-27 * path.time and abs(again["work"] - path.work) < 1e-27 * abs(path.work), case
    return optimal_ceilings.show(path.work), int(bounded)


def rows(cases):
    """Of each case its numbers; those of which the series do not find all digits are left out, and said to be."""
    for case in cases:
        ctx.prec = FINE[0]
        exact = tuple(map(arb, case))
        try:
            least = least_time(exact)
            numbers = Course(exact).member(least.mid()) if exact[4] > least else None
        except (ArithmeticError, AssertionError) as error:
            print("skipped", case, error, file=sys.stderr, flush=True)
            continue
        status = "infeasible" if numbers is None else "ok" if numbers[2] >= 1 else "below_bound"
        shown = [x.str(25, radius=False) for x in numbers] if numbers else [""] * 5
        shown = [least.mid().str(25, radius=False) if least.is_finite() else ""] + shown
        print(case, status, file=sys.stderr, flush=True)
        yield case, [repr(x) for x in case] + shown + [status]


def write(name, header, rows):
    with open(f"{name}.csv", "w", newline="") as file:
        file.write("# made by generate_shortcut_friction.py: Taylor series of 110 terms at 84 digits, 25 digits checked\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            writer.writerow(row)
            file.flush()


def main():
    names = sys.argv[1:] or ["shortcut_friction", "shortcut_friction_slowing"]
    header = HEADER + ["work_optimal", "bounded"]
    if "shortcut_friction" in names:
        write("shortcut_friction", header, ([*row, *least_work_under_ceiling(case)] for case, row in rows(cases())))
    if "shortcut_friction_slowing" in names:
        write("shortcut_friction_slowing", header, ([*row, *least_work(case)] for case, row in rows(slowing())))


if __name__ == "__main__":
    main()
