#!/usr/bin/env python3
"""regularised.csv: the optimum with its jumps replaced by smooth pieces, by Taylor series.

    venv/bin/python generate_regularised.py          # minutes; needs mpmath and gmpy2

The optimum's ends and its time on the floor are those of generate.py, by quadrature at 40 digits. From there the extremal is a power series about the start of each
step in the paper's equations, forwards in the first half of what is kept, backwards in the second. A piece is one too: the exponent with its stretched
step, v by the recurrence of the exponential, theta, the logarithms, work and control velocity by theirs, order 36 in arithmetic of 50 digits. The
parameter of a piece is a root by bracketing in theta. Ranges are those of 16 places a step, the best of them improved by golden sections.
"""
import csv
import gmpy2
from gmpy2 import exp, log, mpfr
from mpmath import nstr

import generate

gmpy2.get_context().precision = 170
ORDER = 36
LEAVES = mpfr("1e-34")


def product(x, y, n):
    return sum((x[i] * y[n - i] for i in range(n + 1)), mpfr(0))


def times(x, y):
    return [product(x, y, n) for n in range(ORDER + 1)]


def exponential(x):
    out = [exp(x[0])]
    for n in range(1, ORDER + 1):
        out.append(sum((k * x[k] * out[n - k] for k in range(1, n + 1)), mpfr(0)) / n)
    return out


def logarithm(x):
    out = [log(x[0])]
    for n in range(1, ORDER + 1):
        rest = sum((k * out[k] * x[n - k] for k in range(1, n)), mpfr(0))
        out.append((x[n] - rest / n) / x[0])
    return out


def at(x, h):
    value = mpfr(0)
    for c in reversed(x):
        value = value * h + c
    return value


def derivative(x):
    return [(n + 1) * x[n + 1] for n in range(len(x) - 1)] + [mpfr(0)]


def reach(h, *series):
    """The longest step up to h that the last terms allow."""
    for s in series:
        for n in (ORDER, ORDER - 1):
            if s[n] != 0:
                h = min(h, (LEAVES * max(abs(s[0]), mpfr("1e-20")) / abs(s[n])) ** (mpfr(1) / n))
    return h


class Range:
    def __init__(self):
        self.best = [None, None]

    def take(self, series, h):
        """The extremes of a series over a step, which may be negative."""
        places = [h * j / 16 for j in range(17)]
        values = [at(series, x) for x in places]
        for side, sign in enumerate((-1, 1)):
            i = max(range(17), key=lambda i: sign * values[i])
            if self.best[side] is not None and sign * values[i] <= sign * self.best[side] - abs(self.best[side]) * mpfr("0.05"):
                continue
            low, high = places[max(i - 1, 0)], places[min(i + 1, 16)]
            ratio = (gmpy2.sqrt(mpfr(5)) - 1) / 2
            for _ in range(90):
                x_1, x_2 = high - ratio * (high - low), low + ratio * (high - low)
                if sign * at(series, x_1) > sign * at(series, x_2):
                    high = x_2
                else:
                    low = x_1
            value = sign * max(sign * values[i], sign * at(series, (low + high) / 2))
            if self.best[side] is None or sign * value > sign * self.best[side]:
                self.best[side] = value


class Case:
    def __init__(self, a, b, v_i, v_f, t_f, k, m, delta_t, bounded):
        self.a, self.b, self.v_i, self.v_f, self.t_f, self.k, self.m, self.delta_t = (mpfr(x) for x in (a, b, v_i, v_f, t_f, k, m, delta_t))
        generate.precision(generate.DIGITS)
        work, v_start, v_end, floor, _, _, _ = generate.optimal_row(a, b, v_i, v_f, t_f, bounded)
        self.work, self.v_start, self.v_end, self.floor = (mpfr(nstr(x, 38)) for x in (work, v_start, v_end, floor))
        self.v, self.control, self.excess = Range(), Range(), mpfr(0)

    def steer(self, v, ln_v, ln_theta, unit):
        """Series of the control velocity, of a series in time over unit."""
        if self.k.is_infinite():
            return v
        rate = [self.a * p + self.b * q for p, q in zip(derivative(ln_v), derivative(ln_theta))]
        bend = derivative(derivative(v))
        control = [c + (r / unit + self.m * s / unit**2) / self.k for c, r, s in zip(v, rate, bend)]
        # The last coefficients lack terms.
        return control[: ORDER - 2]

    def held(self, t):
        return 1 - (1 - 1 / self.v_i) * exp(-t)

    def arc(self, v, theta, time, visit=None):
        """Along the extremal for a time, which may be negative: v with two derivatives and theta at its end, and the work."""
        q, y, work, rest = log(v), log(theta), mpfr(0), time
        while True:
            qs, ys, vs, rs = [q], [y], [exp(q)], [exp(-y)]
            for n in range(ORDER):
                pull = [self.b - self.a - 1 - self.a * qs[0] - self.b * ys[0]] + [-self.a * p - self.b * r for p, r in zip(qs[1:], ys[1:])]
                qs.append(-product(rs, pull, n) / self.a / (n + 1))
                ys.append((rs[n] - vs[n]) / (n + 1))
                m = n + 1
                vs.append(sum((k * qs[k] * vs[m - k] for k in range(1, m + 1)), mpfr(0)) / m)
                rs.append(-sum((k * ys[k] * rs[m - k] for k in range(1, m + 1)), mpfr(0)) / m)
            if rest == 0:
                return [vs[0], vs[1], 2 * vs[2], 1 / rs[0]], work
            h = reach(abs(rest), vs, rs)
            h = rest if h == abs(rest) else (h if rest > 0 else -h)
            friction = [self.a * p + self.b * r for p, r in zip(qs, ys)]
            friction[0] += 1
            power = times(friction, vs)
            work += sum((power[n] * h ** (n + 1) / (n + 1) for n in range(ORDER + 1)), mpfr(0))
            if visit:
                visit(vs, self.steer(vs, qs, ys, mpfr(1)), h)
            q, y, rest = at(qs, h), at(ys, h), (mpfr(0) if h == rest else rest - h)

    def floor_work(self, start, end):
        """int (1 + b ln theta) dt on v = 1, by series in time."""
        t, work = start, mpfr(0)
        while t < end:
            theta = [self.held(t)]
            for n in range(ORDER):
                theta.append(((1 if n == 0 else 0) - theta[n]) / (n + 1))
            ln_theta = logarithm(theta)
            h = reach(end - t, theta, ln_theta)
            work += h + self.b * sum((ln_theta[n] * h ** (n + 1) / (n + 1) for n in range(ORDER + 1)), mpfr(0))
            t = end if h == end - t else t + h
        return work

    def state(self, t):
        """v with two derivatives and theta on the optimum, and its work from there to the end of the arc on the floor or to the nearer end."""
        if t <= self.floor:
            return [mpfr(1), mpfr(0), mpfr(0), self.held(t)]
        if t < self.t_f / 2 or t - self.floor < self.t_f - t:
            return self.arc(*self.leaving(), t - self.floor)[0]
        return self.arc(self.v_end, 1 / self.v_f, t - self.t_f)[0]

    def leaving(self):
        """v and theta where the extremal begins."""
        return (mpfr(1), self.held(self.floor)) if self.floor > 0 else (self.v_start, 1 / self.v_i)

    def work_until(self, t):
        """Work of the optimum from the start."""
        if t <= self.floor:
            return self.floor_work(mpfr(0), t)
        if t == self.t_f:
            return self.work
        if t < self.t_f / 2 or t - self.floor < self.t_f - t:
            return self.floor_work(mpfr(0), self.floor) + self.arc(*self.leaving(), t - self.floor)[1]
        return self.work + self.arc(self.v_end, 1 / self.v_f, t - self.t_f)[1]

    def replace(self, start, end):
        """A smooth piece between two times."""
        outer = [start == 0, end == self.t_f]
        ends = [[v, mpfr(0), mpfr(0), 1 / v] if out else self.state(t) for v, out, t in ((self.v_i, outer[0], start), (self.v_f, outer[1], end))]
        piece = Piece(self, mpfr(0), ends, outer, end - start)
        if piece.lowest() < 1 and ends[0][0] > 1 and ends[1][0] > 1:
            piece = Piece(self, mpfr(1), ends, outer, end - start)
        self.excess += piece.run(self.v, self.control) - (self.work_until(end) - self.work_until(start))

    def keep(self, start, end):
        if end <= start:
            return
        take = lambda v, control, h: (self.v.take(v, h), self.control.take(control, h))
        for t in (start, min(end, self.floor)):
            if t <= self.floor and start < self.floor:
                theta = self.held(t)
                self.v.take([mpfr(1)], mpfr(1))
                if not self.k.is_infinite():
                    self.control.take([1 + self.b * (1 / theta - 1) / self.k], mpfr(1))
        first = max(start, self.floor)
        if first >= end:
            return
        middle = (first + end) / 2
        v, _, _, theta = self.state(first)
        self.arc(v, theta, middle - first, take)
        v, _, _, theta = self.state(end)
        self.arc(v, theta, middle - end, take)

    def solve(self):
        d, corner = self.delta_t, self.floor
        self.replace(mpfr(0), d)
        start = d
        if d < corner < self.t_f - d:
            before, after = max(corner - d / 2, d), min(corner + d / 2, self.t_f - d)
            self.keep(start, before)
            self.replace(before, after)
            start = after
        self.keep(start, self.t_f - d)
        self.replace(self.t_f - d, self.t_f)
        return [self.work + self.excess, self.work, self.excess / self.work, *self.v.best, *self.control.best]


class Piece:
    def __init__(self, case, floor, ends, outer, time):
        self.case, self.floor, self.time = case, floor, time
        theta = [end[3] for end in ends]
        mean = (time - (theta[1] - theta[0])) / (time * gmpy2.sqrt(theta[0] * theta[1])) - floor
        stretch = []
        for end, out in zip(ends, outer):
            rho = max((end[0] - floor) / mean, mpfr(1)) if out else mpfr(1)
            stretch.append(max(4 * (rho / gmpy2.cbrt(1 + 10 * log(rho)) - 1), mpfr(0)))
        if ends[1][0] * time > 5 * (1 + stretch[1]):
            stretch[1] = mpfr(0)
        self.stretch = stretch
        w = [end[0] - floor for end in ends]
        slope = [time * end[1] / x for end, x in zip(ends, w)]
        bend = [time**2 * (end[2] / x - (end[1] / x) ** 2) for end, x in zip(ends, w)]
        self.rise = log(w[1] / w[0])
        # The quintic of level ln w_0 at both ends with these slopes and curvatures.
        c_1, c_2 = slope[0], bend[0] / 2
        value, first, second = -c_1 - c_2, slope[1] - c_1 - 2 * c_2, bend[1] - 2 * c_2
        self.g = [log(w[0]), c_1, c_2, 10 * value - 4 * first + second / 2, -15 * value + 7 * first - second, 6 * value - 3 * first + second / 2, mpfr(0)]
        self.theta = theta
        self.alpha = None
        self.alpha = self.solve()

    def velocity(self, x, alpha):
        p, q = self.stretch
        plain = [c + alpha * bump for c, bump in zip(self.g, (0, 0, 0, 1, -3, 3, -1))]
        for k in range(7):
            for j in range(5, k - 1, -1):
                plain[j] += x * plain[j + 1]
        plain += [mpfr(0)] * (ORDER - 6)
        above, below = [(1 + p) * x, 1 + p], [1 + p * x + q * (1 - x), p - q]
        xi = []
        for n in range(ORDER + 1):
            xi.append(((above[n] if n < 2 else 0) - (xi[n - 1] * below[1] if n > 0 else 0)) / below[0])
        square = times(xi, xi)
        rest = [6 * s - 15 * c for s, c in zip(square, xi)]
        rest[0] += 10
        step = times(times(square, xi), rest)
        v = exponential([c + self.rise * s for c, s in zip(plain, step)])
        v[0] += self.floor
        return v

    def steps(self, alpha):
        x, theta = mpfr(0), self.theta[0]
        while x < 1:
            v = self.velocity(x, alpha)
            lifetimes = [theta]
            for n in range(ORDER):
                lifetimes.append(self.time * ((1 if n == 0 else 0) - product(lifetimes, v, n)) / (n + 1))
            h = reach(1 - x, v, lifetimes)
            yield v, lifetimes, h
            theta, x = at(lifetimes, h), (mpfr(1) if h == 1 - x else x + h)

    def miss(self, alpha):
        for _, lifetimes, h in self.steps(alpha):
            pass
        return at(lifetimes, h) / self.theta[1] - 1

    def solve(self):
        low, high, width = mpfr(-4), mpfr(4), mpfr(8)
        f_low, f_high = self.miss(low), self.miss(high)
        while f_low < 0:
            low, width = low - width, 2 * width
            f_low = self.miss(low)
        while f_high > 0:
            high, width = high + width, 2 * width
            f_high = self.miss(high)
        for i in range(200):
            if high - low < mpfr("1e-30") * (1 + abs(low)):
                break
            guess = (low * f_high - high * f_low) / (f_high - f_low) if i % 3 else (low + high) / 2
            # A narrow bracket about the secant's guess.
            for x in (guess - mpfr("1e-5") * (high - low), guess + mpfr("1e-5") * (high - low)) if i % 3 else (guess,):
                if low < x < high:
                    f = self.miss(x)
                    if f > 0:
                        low, f_low = x, f
                    else:
                        high, f_high = x, f
        return (low + high) / 2

    def lowest(self):
        seen = Range()
        for v, _, h in self.steps(self.alpha):
            seen.take(v, h)
        return seen.best[0]

    def run(self, v_range, control_range):
        """Work; takes in the ranges."""
        work = mpfr(0)
        for v, lifetimes, h in self.steps(self.alpha):
            ln_v, ln_theta = logarithm(v), logarithm(lifetimes)
            friction = [self.case.a * p + self.case.b * q for p, q in zip(ln_v, ln_theta)]
            friction[0] += 1
            power = times(friction, v)
            work += self.time * sum((power[n] * h ** (n + 1) / (n + 1) for n in range(ORDER + 1)), mpfr(0))
            v_range.take(v, h)
            control_range.take(self.case.steer(v, ln_v, ln_theta, self.time), h)
        return work


def cases():
    paper = lambda t_f, fraction, k=0.5, m=1e-6, bounded=1: (0.03, 0.05, 3.0, 100.0, t_f, k, m, fraction * t_f, bounded)
    yield paper(0.02, 0.1)
    yield paper(0.02, 0.01)
    yield paper(0.02, 0.4)
    yield paper(0.02, 0.1, float("inf"), 0.0)
    yield paper(0.037, 0.05, 0.1, 0.0)
    yield paper(0.045, 0.2)
    yield paper(0.045, 0.01)
    yield paper(0.045, 0.2, bounded=0)
    yield paper(0.06, 0.1, bounded=0)
    yield paper(0.5, 0.02)
    yield paper(0.5, 0.001)
    yield paper(0.06, 0.3)
    yield 0.05, 0.02, 5.0, 20.0, 0.03, 0.05, 1e-4, 0.003, 1
    yield 0.1, 0.1, 1.5, 40.0, 0.02, 1.0, 1e-3, 0.002, 1
    yield 0.01, 0.02, 50.0, 5e3, 1e-3, 0.1, 1e-8, 1e-5, 1
    yield 0.03, 0.05, 100.0, 3.0, 0.5, 0.5, 1e-6, 0.025, 1
    yield 0.03, 0.01, 20.0, 2.0, 1.5, 0.5, 1e-4, 0.01, 1


if __name__ == "__main__":
    rows = []
    for *numbers, bounded in cases():
        case = Case(*numbers, bool(bounded))
        found = case.solve()
        rows.append([repr(x) for x in numbers] + [bounded, int(case.floor > 0)] + ["{0:.25g}".format(x) for x in found])
        print(*rows[-1], flush=True)
    with open("regularised.csv", "w", newline="") as file:
        file.write("# made by generate_regularised.py, Taylor series of order 36 at 50 digits\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow("a,b,v_i,v_f,t_f,k,m,delta_t,bounded,floor,work,work_optimal,gap,v_min,v_max,v_c_min,v_c_max".split(","))
        out.writerows(rows)
