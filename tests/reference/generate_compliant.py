#!/usr/bin/env python3
"""Reference table of the smooth shortcut at finite stiffness, `compliant.csv`.

    venv/bin/python generate_compliant.py          # some minutes

Taylor series of order 40 in arithmetic of 50 digits: everything is a power series about the start of each step, the exponent a polynomial, the
exponential and the logarithms by their recurrences, theta, work and the linearised flow by theirs. The step is as long as the last terms allow.
The parameter is a root by bracketing in theta(t_f). The range of the control velocity is that of 40 places a step, the best of them improved by
golden sections. No quadrature, no collocation, no matrix to be solved. Inputs are doubles, written by repr and used exactly.
"""
import csv, random
import gmpy2
from gmpy2 import exp, log, mpfr, sqrt

gmpy2.get_context().precision = 170
ORDER = 40
TOLERANCE = mpfr("1e-36")
HEADER = ["a", "b", "v_i", "v_f", "t_f", "k", "m", "alpha", "work", "v_min", "v_max", "v_c_min", "v_c_max", "amplification"]


def product(x, y, n):
    return sum((x[i] * y[n - i] for i in range(n + 1)), mpfr(0))


def quotient(x, y, n, so_far):
    """Coefficient n of x/y from those before it."""
    return (x[n] - sum((so_far[i] * y[n - i] for i in range(n)), mpfr(0))) / y[0]


def logarithm(x):
    out = [log(x[0])]
    for n in range(1, len(x)):
        rest = sum((k * out[k] * x[n - k] for k in range(1, n)), mpfr(0))
        out.append((x[n] - rest / n) / x[0])
    return out


def derivative(x):
    return [(n + 1) * x[n + 1] for n in range(len(x) - 1)] + [mpfr(0)]


def at(x, h):
    value = mpfr(0)
    for c in reversed(x):
        value = value * h + c
    return value


class Shortcut:
    def __init__(self, a, b, v_i, v_f, t_f, k, m):
        self.a, self.b, self.v_i, self.v_f, self.t_f = (mpfr(x) for x in (a, b, v_i, v_f, t_f))
        self.k, self.m = mpfr(k), mpfr(m)
        self.rise = log((self.v_f - 1) / (self.v_i - 1))

    def exponent(self, x, alpha):
        """Taylor coefficients of f about x."""
        base = [log(self.v_i - 1), mpfr(0), mpfr(0), 10 * self.rise + alpha, -15 * self.rise - 3 * alpha, 6 * self.rise + 3 * alpha, -alpha]
        out = list(base)
        for k in range(7):
            for j in range(5, k - 1, -1):
                out[j] += x * out[j + 1]
        return out + [mpfr(0)] * (ORDER - 6)

    def velocity(self, x, alpha):
        f = self.exponent(x, alpha)
        e = [exp(f[0])]
        for n in range(1, ORDER + 1):
            e.append(sum((k * f[k] * e[n - k] for k in range(1, min(n, 6) + 1)), mpfr(0)) / n)
        return [1 + e[0]] + e[1:]

    def lifetime(self, theta, v):
        out = [theta]
        for n in range(ORDER):
            out.append(self.t_f * ((1 if n == 0 else 0) - product(out, v, n)) / (n + 1))
        return out

    def step(self, x, *series):
        """The longest step that the last terms of every series allow."""
        h = 1 - x
        for s in series:
            size = max(abs(s[0]), mpfr("1e-300"))
            for n in (ORDER, ORDER - 1):
                if s[n] != 0:
                    h = min(h, (TOLERANCE * size / abs(s[n])) ** (mpfr(1) / n))
        return h

    def miss(self, alpha):
        x, theta = mpfr(0), 1 / self.v_i
        while x < 1:
            v = self.velocity(x, alpha)
            series = self.lifetime(theta, v)
            h = self.step(x, v, series)
            theta, x = at(series, h), (mpfr(1) if h == 1 - x else x + h)
        return theta * self.v_f - 1

    def solve(self):
        if self.v_i == self.v_f:
            return mpfr(0)
        low, high, width = mpfr(-20), mpfr(20), mpfr(40)
        while self.miss(low) < 0:
            low, width = low - width, 2 * width
        while self.miss(high) > 0:
            high, width = high + width, 2 * width
        f_low, f_high = self.miss(low), self.miss(high)
        while high - low > mpfr("1e-30") * (1 + abs(low)):
            # Regula falsi against bisection, whichever closes in.
            for x in ((low * f_high - high * f_low) / (f_high - f_low), (low + high) / 2):
                if not low < x < high:
                    continue
                for y in (x - mpfr("1e-6") * (high - low), x, x + mpfr("1e-6") * (high - low)):
                    if low < y < high:
                        f = self.miss(y)
                        if f > 0:
                            low, f_low = y, f
                        else:
                            high, f_high = y, f
        return (low + high) / 2

    def run(self, alpha):
        x, theta, work = mpfr(0), 1 / self.v_i, mpfr(0)
        states = 1 if self.k.is_infinite() else (2 if self.m == 0 else 3)
        flow = [[mpfr(int(i == j)) for i in range(states)] for j in range(states)]
        samples, steps = [], []
        while x < 1:
            v = self.velocity(x, alpha)
            lifetimes = self.lifetime(theta, v)
            ln_v, ln_theta = logarithm(v), logarithm(lifetimes)
            friction = [self.a * p + self.b * q for p, q in zip(ln_v, ln_theta)]
            friction[0] += 1
            power = [product(friction, v, n) * self.t_f for n in range(ORDER + 1)]
            control = list(v)
            if states > 1:
                rate, bend = derivative(friction), derivative(derivative(v))
                control = [c + (r / self.t_f + self.m * s / self.t_f**2) / self.k for c, r, s in zip(v, rate, bend)]
            columns = self.flow(flow, v, lifetimes, ln_v, states)
            h = self.step(x, v, lifetimes, ln_v, ln_theta, *[s for column in columns for s in column if s[0] != 0])
            # The last three coefficients of the control lack terms.
            control = control[: ORDER - 2]
            steps.append((control, h))
            work += sum((power[n] * h ** (n + 1) / (n + 1) for n in range(ORDER + 1)), mpfr(0))
            theta = at(lifetimes, h)
            flow = [[at(s, h) for s in column] for column in columns]
            x = mpfr(1) if h == 1 - x else x + h
        for i, (control, h) in enumerate(steps):
            samples += [(at(control, h * j / 40), i, mpfr(j) / 40) for j in range(41)]
        return work, [self.extreme(samples, steps, sign) for sign in (-1, 1)], self.norm(flow)

    def flow(self, start, v, lifetimes, ln_v, states):
        """Series of the columns of the fundamental matrix, (ln v, ln theta, k s/a), (ln theta, k s/a) or (ln theta)."""
        t, a, b, k, m = self.t_f, self.a, self.b, self.k, self.m
        g = []
        one = [mpfr(1)] + [mpfr(0)] * ORDER
        for n in range(ORDER + 1):
            g.append(quotient(one, lifetimes, n, g))
        if states == 3:
            over = []
            for n in range(ORDER + 1):
                over.append(quotient(one, v, n, over))
            pull = [a / m * c for c in over]
            loss = [p + r / t for p, r in zip(pull, derivative(ln_v))]
        columns = []
        for column in start:
            s = [[c] for c in column]
            for n in range(ORDER):
                if states == 1:
                    s[0].append(-t * product(g, s[0], n) / (n + 1))
                    continue
                y, p = s[-2], s[-1]
                if states == 2:
                    q = [p[i] - b / a * y[i] for i in range(n + 1)]
                else:
                    q = s[0]
                slip = product(v, q, n)
                if states == 3:
                    q_next = t * (product(pull, p, n) - product(loss, q, n) - b / a * product(pull, y, n)) / (n + 1)
                y_next, p_next = -t * (product(g, y, n) + slip) / (n + 1), -t * k / a * slip / (n + 1)
                if states == 3:
                    q.append(q_next)
                y.append(y_next)
                p.append(p_next)
            columns.append(s)
        return columns

    def norm(self, flow):
        """Largest singular value from the states to (ln v, ln theta, k s/a), by squaring the symmetric matrix often."""
        n, ratio = len(flow), self.b / self.a
        if n == 2:
            flow = [column + [column[1] - ratio * column[0]] for column in flow]
        if n == 1:
            flow = [column + [ratio * column[0]] for column in flow]
        g = [[sum((p * q for p, q in zip(first, second)), mpfr(0)) for second in flow] for first in flow]
        base = [row[:] for row in g]
        for _ in range(14):
            size = max(abs(c) for row in g for c in row)
            g = [[c / size for c in row] for row in g]
            g = [[sum((g[i][k] * g[k][j] for k in range(n)), mpfr(0)) for j in range(n)] for i in range(n)]
        vector = max(g, key=lambda row: sum(c * c for c in row))
        image = [sum((base[i][j] * vector[j] for j in range(n)), mpfr(0)) for i in range(n)]
        return sqrt(sum(p * q for p, q in zip(image, vector)) / sum(c * c for c in vector))

    def extreme(self, samples, steps, sign):
        best, i, place = max(samples, key=lambda s: sign * s[0])
        control, h = steps[i]
        low, high = max(place - mpfr(1) / 40, mpfr(0)), min(place + mpfr(1) / 40, mpfr(1))
        ratio = (sqrt(mpfr(5)) - 1) / 2
        for _ in range(120):
            x_1, x_2 = high - ratio * (high - low), low + ratio * (high - low)
            if sign * at(control, h * x_1) > sign * at(control, h * x_2):
                high = x_2
            else:
                low = x_1
        return sign * max(sign * best, sign * at(control, h * low))


def cases():
    paper = (0.005, 0.01, 1e5, 3.2e6)
    for t_f, k, m in ((3.1e-6, 7.5e-3, 2.5e-16), (1e-6, 7.5e-3, 2.5e-16), (1e-5, 7.5e-3, 2.5e-16), (3.1e-6, 0.1, 2.5e-16), (3.1e-6, 7.5e-3, 0.0)):
        yield (*paper, t_f, k, m)
    for t_f in (0.002, 0.02, 0.037, 0.049, 0.5):
        yield 0.03, 0.05, 3.0, 100.0, t_f, 0.5, 1e-6
    yield 0.03, 0.05, 3.0, 100.0, 0.02, float("inf"), 1e-6
    yield 0.03, 0.05, 3.0, 100.0, 0.02, 1.0, 1e-3
    yield 0.03, 0.05, 100.0, 3.0, 0.5, 0.5, 1e-5
    yield 0.03, 0.05, 100.0, 3.0, 0.45, 0.5, 0.0
    yield 0.03, 0.01, 1.01, 40.0, 1.0, 0.05, 1e-4
    yield 0.03, 0.0, 2.0, 2.1, 0.3, 0.2, 1e-3
    yield 0.02, 0.03, 5.0, 5.0, 1.0, 0.02, 1e-3
    state = random.Random(4)
    while True:
        a = 10 ** state.uniform(-3, -1)
        b = a * state.uniform(0, 4)
        v_i, v_f = (1 + 10 ** state.uniform(-2, 3) for _ in range(2))
        least = max(0, float(log(mpfr(v_f) / v_i) + log((mpfr(v_i) - 1) / (mpfr(v_f) - 1))))
        t_f = least * (1 + 10 ** state.uniform(-1, 1)) + 10 ** state.uniform(-2, 1.3) / max(v_i, v_f)
        m = 0.0 if state.random() < 0.2 else a / (min(v_i, v_f) * t_f) * t_f * 10 ** state.uniform(-2, 3) * min(1, 10 / v_f)
        k = a * 10 ** state.uniform(-1, 2)
        # Neither too many oscillations nor too stiff for series.
        if t_f * max(v_i, v_f) > 300 or (m > 0 and (t_f * (k / m) ** 0.5 > 60 or a * t_f / m > 3000)) or (m == 0 and k / a * v_f * t_f > 3000):
            continue
        yield a, b, v_i, v_f, t_f, k, m


def main():
    rows = []
    for case in cases():
        shortcut = Shortcut(*case)
        alpha = shortcut.solve()
        work, (low, high), amplification = shortcut.run(alpha)
        x = (1 + 10 * shortcut.rise / alpha) / 2 if alpha != 0 else mpfr(0)
        ends = [shortcut.v_i, shortcut.v_f]
        if 0 < x < 1:
            ends.append(shortcut.velocity(x, alpha)[0])
        numbers = [alpha, work, min(ends), max(ends), low, high, amplification]
        rows.append([repr(x) for x in case] + ["{0:.25g}".format(x) for x in numbers])
        print(*rows[-1], flush=True)
        if len(rows) == 40:
            break
    with open("compliant.csv", "w", newline="") as file:
        file.write("# made by generate_compliant.py, Taylor series of order 40 at 50 digits\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADER)
        writer.writerows(rows)


if __name__ == "__main__":
    main()
