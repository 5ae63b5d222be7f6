"""What one would write in Python instead, on the rows of tests/reference: `peers.py FILE [SUBJECT...]` writes what each answered and how long
it took.

- the optimum: scipy's `solve_bvp` on the paper's equations, and direct collocation with CasADi and IPOPT,
  without ceilings and with them;
- the landscape: Gauss rules in numpy and in numba;
- linear stability: eigenvalues by numpy.

Nothing here knows the right answers: `cargo bench --bench work_precision -- --peers FILE` judges them as it does its own. One thread.
Compilation by numba and the construction of the optimisation problem are not in the times.
"""

import csv
import sys
import time
from pathlib import Path

import casadi as ca
import numpy as np
from scipy.integrate import solve_bvp

REFERENCE = Path(__file__).resolve().parents[3] / "tests/reference"

# Every how many rows the optimiser solves.
STRIDE = 6

# The table of a landscape is so many times as long as the reference table: numpy needs long arrays.
COPIES = 100

NODES = (16, 24, 32, 48, 64)


def table(name, *columns):
    """Some columns of a reference table, as arrays."""
    with open(REFERENCE / f"{name}.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return [np.array([float(row[column]) for row in rows]) for column in columns]


def least(times, run):
    """The least time of several runs, in nanoseconds, and the last result."""
    shortest = np.inf
    for _ in range(times):
        start = time.perf_counter_ns()
        result = run()
        shortest = min(shortest, time.perf_counter_ns() - start)
    return shortest, result


def boundary_value(t_f, a, b, v_i, v_f, tolerance):
    """Work and v(0+): ln theta, ln v and the work over t/t_f, where v' is that of the paper with beta eliminated."""
    y_i, y_f = -np.log(v_i), -np.log(v_f)

    def slope(_, state):
        y, z, _ = state
        tau = 1 + a * z + b * y
        return t_f * np.vstack([np.exp(-y) - np.exp(z), (tau - (b - a)) * np.exp(-y) / a, tau * np.exp(z)])

    def ends(start, end):
        return np.array([start[0] - y_i, end[0] - y_f, start[2]])

    x = np.linspace(0, 1, 11)
    y = y_i + (y_f - y_i) * x
    z = np.log(np.maximum(np.exp(-y) - (y_f - y_i) / t_f, 1.0))
    found = solve_bvp(slope, ends, x, np.vstack([y, z, 4 * x]), tol=tolerance, max_nodes=5000)
    return (found.y[2, -1], np.exp(found.y[1, 0])) if found.success else (np.nan, np.nan)


def collocation(intervals, degree=5):
    """A function of (t_f, a, b, v_i, v_f, bounded, v_ceiling, tau_ceiling) that returns work and v(0+), by IPOPT: ln theta is a
    polynomial of this degree on each interval, ln v is free at its Gauss points, where the bounds hold."""
    points = np.array(ca.collocation_points(degree, "legendre"))
    nodes = np.append(0.0, points)
    lagrange = [np.poly1d(np.poly(np.delete(nodes, j))) / np.prod(nodes[j] - np.delete(nodes, j)) for j in range(degree + 1)]
    slopes = np.array([[p.deriv()(x) for p in lagrange] for x in points])
    ends = np.array([p(1.0) for p in lagrange])
    weights = np.polynomial.legendre.leggauss(degree)[1] / 2
    # ln v at the start, from the points of the first interval.
    back = [np.prod(np.delete(points, j)) / np.prod(np.delete(points, j) - points[j]) for j in range(degree)]
    grid = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, intervals + 1))
    t_f, a, b, y_i, y_f = parameters = [ca.SX.sym(name) for name in ("t_f", "a", "b", "y_i", "y_f")]
    levels, velocities = ca.SX.sym("y", degree, intervals), ca.SX.sym("z", degree, intervals)
    conditions, friction, cost, start = [], [], 0, y_i
    for i in range(intervals):
        h = t_f * (grid[i + 1] - grid[i])
        values = [start] + [levels[j, i] for j in range(degree)]
        for j in range(degree):
            y, z = levels[j, i], velocities[j, i]
            rate = sum(slopes[j, k] * values[k] for k in range(degree + 1))
            conditions.append(rate - h * (ca.exp(-y) - ca.exp(z)))
            friction.append(1 + a * z + b * y)
            cost += h * weights[j] * ca.exp(z) * (1 + a * z + b * y)
        start = sum(ends[k] * values[k] for k in range(degree + 1))
    conditions.append(start - y_f)
    problem = {"x": ca.vertcat(ca.vec(levels), ca.vec(velocities)), "f": cost, "g": ca.vertcat(*conditions, *friction), "p": ca.vertcat(*parameters)}
    options = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes", "show_eval_warnings": False, "ipopt.tol": 1e-12, "ipopt.max_iter": 300}
    solver = ca.nlpsol("solver", "ipopt", problem, options)
    places = (grid[:-1, None] + np.diff(grid)[:, None] * points).ravel()

    def solve(t_f, a, b, v_i, v_f, bounded, v_ceiling=np.inf, tau_ceiling=np.inf):
        y_i, y_f = -np.log(v_i), -np.log(v_f)
        y = y_i + (y_f - y_i) * places
        z = np.log(np.minimum(v_ceiling, np.maximum(1.1, np.exp(-y) - (y_f - y_i) / t_f)))
        low = np.append(np.full(y.size, -np.inf), np.full(z.size, 0.0 if bounded else -np.inf))
        high = np.append(np.full(y.size, np.inf), np.full(z.size, np.log(v_ceiling)))
        least = np.append(np.zeros(len(conditions)), np.full(z.size, -np.inf))
        most = np.append(np.zeros(len(conditions)), np.full(z.size, tau_ceiling))
        found = solver(x0=np.append(y, z), lbx=low, ubx=high, lbg=least, ubg=most, p=[t_f, a, b, y_i, y_f])
        if not solver.stats()["success"]:
            return np.nan, np.nan
        first = np.array(found["x"]).ravel()[y.size : y.size + degree]
        return float(found["f"]), np.exp(np.dot(back, first))

    return solve


def optimal(write):
    columns = table("optimal", "t_f", "a", "b", "v_i", "v_f", "bounded")
    for tolerance in (1e-3, 1e-6, 1e-9, 1e-12):
        for row, case in enumerate(zip(*columns)):
            ns, answer = least(1, lambda: boundary_value(*case[:5], tolerance))
            write("optimal", "solve_bvp (scipy)", tolerance, tolerance, row, ns, *answer)
    for intervals in (10, 20, 40):
        solve = collocation(intervals)
        for row, case in list(enumerate(zip(*columns)))[::STRIDE]:
            ns, answer = least(1, lambda: solve(*case))
            write("optimal", "collocation (CasADi and IPOPT)", f"{intervals} intervals", "", row, ns, *answer)


def ceilings(write):
    columns = table("optimal_ceilings", "t_f", "a", "b", "v_i", "v_f", "bounded", "v_ceiling", "tau_ceiling")
    for intervals in (10, 20, 40):
        solve = collocation(intervals)
        for row, case in list(enumerate(zip(*columns)))[::STRIDE]:
            ns, answer = least(1, lambda: solve(*case))
            write("ceilings", "collocation (CasADi and IPOPT)", f"{intervals} intervals", "", row, ns, *answer)


def works(x, w, a, b, v_i, v_f, t_f, a_2, a_3):
    """Works of many shortcuts in numpy; NaN where a node has none."""
    q, a_4 = 1 / v_i, 1 / v_f - 1 / v_i - a_2 - a_3
    work, feasible = np.zeros_like(a), np.ones(a.shape, bool)
    for place, weight in zip(x, w):
        theta = q + place * (a_2 + place * (a_3 + place * a_4))
        n = t_f - a_2 - place * (2 * a_3 + place * 3 * a_4)
        feasible &= (theta > 0) & (n > 0)
        work += weight * (1 + a * np.log(n / t_f) + (b - a) * np.log(theta)) * n / theta
    return np.where(feasible, work, np.nan)


def point_by_point(x, w, a, b, v_i, v_f, t_f, a_2, a_3):
    """The works in a loop, for numba."""
    works = np.empty_like(a)
    for i in range(a.size):
        q = 1 / v_i[i]
        a_4 = 1 / v_f[i] - q - a_2[i] - a_3[i]
        work = 0.0
        for j in range(x.size):
            theta = q + x[j] * (a_2[i] + x[j] * (a_3[i] + x[j] * a_4))
            n = t_f[i] - a_2[i] - x[j] * (2 * a_3[i] + x[j] * 3 * a_4)
            if theta <= 0 or n <= 0:
                work = np.nan
                break
            work += w[j] * (1 + a[i] * np.log(n / t_f[i]) + (b[i] - a[i]) * np.log(theta)) * n / theta
        works[i] = work
    return works


def landscape(write):
    import numba

    compiled = numba.njit(point_by_point)
    columns = table("landscape", "a", "b", "v_i", "v_f", "t_f", "a_2", "a_3")
    rows = columns[0].size
    many = [np.tile(column, COPIES) for column in columns]
    for nodes in NODES:
        x, w = np.polynomial.legendre.leggauss(nodes)
        x, w = 0.5 + 0.5 * x, 0.5 * w
        compiled(x, w, *columns)
        for method, run in (("Gauss rules (numpy)", works), ("Gauss rules (numba)", compiled)):
            ns, answers = least(3, lambda: run(x, w, *many))
            for row in range(rows):
                write("landscape", method, f"{nodes} nodes", "", row, ns / COPIES / rows, answers[row], np.nan)


def stability(write):
    a, b, k, m, v = table("stability", "a", "b", "k", "m", "v")
    inertia, zero = m * v * v, np.zeros_like(a)

    def run():
        rates = [[-a / inertia, -b / inertia, 1 / inertia], [zero - 1, zero - 1, zero], [-k, zero, zero]]
        values = np.linalg.eigvals(np.moveaxis(np.array(rates), 2, 0))
        pair = np.take_along_axis(values, np.argmax(values.imag, axis=1)[:, None], axis=1)[:, 0]
        return np.where(pair.imag > 0, pair.real, values.real.max(axis=1)), pair.imag

    ns, (growth, frequency) = least(20, run)
    for row in range(a.size):
        write("stability", "eigenvalues (numpy)", "", "", row, ns / a.size, v[row] * growth[row], v[row] * frequency[row])


def main():
    np.seterr(all="ignore")
    with open(sys.argv[1], "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["subject", "method", "setting", "tolerance", "row", "ns", "first", "second"])

        def write(*cells):
            out.writerow([repr(float(cell)) if isinstance(cell, np.floating) else cell for cell in cells])

        subjects = {subject.__name__: subject for subject in (optimal, ceilings, landscape, stability)}
        for subject in [subjects[name] for name in sys.argv[2:]] or subjects.values():
            start = time.time()
            subject(write)
            print(f"{subject.__name__}: {time.time() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
