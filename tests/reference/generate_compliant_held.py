#!/usr/bin/env python3
"""compliant_held.csv: how far the smooth shortcut misses its target if its control velocity is sampled every dt and held, by Taylor series.

    venv/bin/python generate_compliant_held.py          # seconds; needs compliant.csv

The protocol as in generate_compliant.py gives v, v', v'' and theta at the samples; the block then moves under a constant control velocity from one
sample to the next: v, theta and the force of the spring are power series, v and theta themselves, not their logarithms, being the unknowns.
"""
import csv
from gmpy2 import log, mpfr, sqrt

from generate_compliant import ORDER, Shortcut, at, derivative, logarithm

LEAVES = mpfr("1e-32")


def protocol(shortcut, alpha, times):
    """The control velocity at some times."""
    a, b, k, m, t_f = shortcut.a, shortcut.b, shortcut.k, shortcut.m, shortcut.t_f
    x, theta, control = mpfr(0), 1 / shortcut.v_i, []
    for time in times:
        target = time / t_f
        while True:
            v = shortcut.velocity(x, alpha)
            series = shortcut.lifetime(theta, v)
            if x == target:
                break
            h = min(shortcut.step(x, v, series), target - x)
            theta, x = at(series, h), (target if h == target - x else x + h)
        ln_v, ln_theta = logarithm(v[:4]), logarithm(series[:4])
        rate = (a * ln_v[1] + b * ln_theta[1]) / t_f
        bend = derivative(derivative(v))[0] / t_f**2
        control.append(v[0] + (rate + m * bend) / k)
    return control


def held(shortcut, controls, times):
    """The state at the end, in (v, theta, k s - 1)."""
    a, b, k, m = shortcut.a, shortcut.b, shortcut.k, shortcut.m
    v, theta, force = shortcut.v_i, 1 / shortcut.v_i, (shortcut.a - shortcut.b) * log(shortcut.v_i)
    for control, start, end in zip(controls, times, [*times[1:], shortcut.t_f]):
        rest = end - start
        while rest > 0:
            vs, thetas, forces = [v], [theta], [force]
            ln_v, ln_theta = [log(v)], [log(theta)]
            for n in range(ORDER):
                unit = 1 if n == 0 else 0
                product = sum((thetas[i] * vs[n - i] for i in range(n + 1)), mpfr(0))
                vs.append((forces[n] - a * ln_v[n] - b * ln_theta[n]) / m / (n + 1))
                thetas.append((unit - product) / (n + 1))
                forces.append(k * ((control if n == 0 else 0) - vs[n]) / (n + 1))
                for ln_u, u in ((ln_v, vs), (ln_theta, thetas)):
                    done = sum((i * ln_u[i] * u[n + 1 - i] for i in range(1, n + 1)), mpfr(0))
                    ln_u.append((u[n + 1] - done / (n + 1)) / u[0])
            h = rest
            for u in (vs, thetas):
                for n in (ORDER - 1, ORDER):
                    if u[n] != 0:
                        h = min(h, (LEAVES * abs(u[0]) / abs(u[n])) ** (mpfr(1) / n))
            v, theta, force = (at(u, h) for u in (vs, thetas, forces))
            rest = mpfr(0) if h == rest else rest - h
    return v, theta, force


def main():
    with open("compliant.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    chosen = [row for row in rows if float(row["m"]) > 0 and row["k"] != "inf"]
    out = []
    for row in chosen:
        for count in (15.5, 60.0):
            case = {name: float(row[name]) for name in ("a", "b", "v_i", "v_f", "t_f", "k", "m")}
            shortcut = Shortcut(*case.values())
            dt = case["t_f"] / count
            times = []
            while mpfr(dt) * len(times) < shortcut.t_f:
                times.append(mpfr(dt) * len(times))
            try:
                v, theta, force = held(shortcut, protocol(shortcut, mpfr(row["alpha"]), times), times)
            except (ValueError, ZeroDivisionError):
                continue
            if not v > 0:
                continue
            target = (shortcut.a - shortcut.b) * log(shortcut.v_f)
            miss = [log(v / shortcut.v_f), log(theta * shortcut.v_f), (force - target) / shortcut.a]
            error = sqrt(sum((x * x for x in miss), mpfr(0)))
            if not error < 10:
                continue
            out.append([repr(x) for x in (*case.values(), dt)] + ["{0:.25g}".format(error)])
            print(*out[-1], flush=True)
    with open("compliant_held.csv", "w", newline="") as file:
        file.write("# made by generate_compliant_held.py, Taylor series of order 40 at 50 digits\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["a", "b", "v_i", "v_f", "t_f", "k", "m", "dt", "sampling_error"])
        writer.writerows(out)


if __name__ == "__main__":
    main()
