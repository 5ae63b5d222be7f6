"""The bounded optimum by direct collocation: an optimiser's answer that shares nothing with the library.

ln theta is a polynomial of degree 5 on each of N intervals, collocated at Gauss-Legendre points, ln v is free at those points
and at least 0, and IPOPT minimises the quadrature of tau v. The intervals are graded towards both ends, where the optimum
changes fastest. Where the bound is left inside an interval the error falls irregularly, so it is taken as the greatest
difference between the finest of four numbers of intervals and the others that IPOPT solves.

    python3 -m venv venv && venv/bin/pip install casadi
    venv/bin/python collocation.py > collocation.csv
"""

import casadi as ca
import numpy as np

DEGREE = 5
CASES = [
    (0.02, 0.03, 0.05, 3.0, 100.0), (0.037, 0.03, 0.05, 3.0, 100.0), (0.049, 0.03, 0.05, 3.0, 100.0),
    (0.1, 0.03, 0.05, 3.0, 100.0), (0.5, 0.03, 0.05, 3.0, 100.0), (0.5, 0.05, 0.03, 3.0, 100.0), (0.5, 0.03, 0.0, 3.0, 100.0),
    (0.5, 0.03, 0.05, 100.0, 3.0), (0.4, 0.03, 0.05, 100.0, 3.0), (0.42, 0.05, 0.05, 100.0, 3.0), (0.3, 0.03, 0.05, 3.0, 2.0),
]


def work(case, intervals):
    t_f, a, b, v_i, v_f = case
    points = np.array(ca.collocation_points(DEGREE, "legendre"))
    nodes = np.append(0.0, points)
    lagrange = [np.poly1d([1.0]) for _ in nodes]
    for j in range(len(nodes)):
        for k in range(len(nodes)):
            if k != j:
                lagrange[j] *= np.poly1d([1.0, -nodes[k]]) / (nodes[j] - nodes[k])
    slopes = np.array([[p.deriv()(x) for p in lagrange] for x in points])
    ends = np.array([p(1.0) for p in lagrange])
    weights = np.polynomial.legendre.leggauss(DEGREE)[1] / 2
    grid = t_f * (0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, intervals + 1)))
    y_i, y_f = -np.log(v_i), -np.log(v_f)
    variables, guess, low, high, conditions, cost = [], [], [], [], [], 0

    def variable(name, value, least):
        x = ca.MX.sym(name)
        variables.append(x), guess.append(value), low.append(least), high.append(ca.inf)
        return x

    start = ca.MX(y_i)
    for i in range(intervals):
        h = grid[i + 1] - grid[i]
        levels = [start] + [
            variable(f"y{i}_{j}", y_i + (y_f - y_i) * (grid[i] + h * x) / t_f, -ca.inf) for j, x in enumerate(points)
        ]
        for j in range(DEGREE):
            level = y_i + (y_f - y_i) * (grid[i] + h * points[j]) / t_f
            log_v = variable(f"w{i}_{j}", np.log(max(1.1, np.exp(-level) - (y_f - y_i) / t_f)), 0.0)
            slope = sum(float(slopes[j, k]) * levels[k] for k in range(DEGREE + 1))
            conditions.append(slope - h * (ca.exp(-levels[j + 1]) - ca.exp(log_v)))
            cost += h * weights[j] * ca.exp(log_v) * (1 + a * log_v + b * levels[j + 1])
        start = sum(float(ends[k]) * levels[k] for k in range(DEGREE + 1))
    conditions.append(start - y_f)
    problem = {"x": ca.vertcat(*variables), "f": cost, "g": ca.vertcat(*conditions)}
    options = {"ipopt.print_level": 0, "print_time": 0, "ipopt.tol": 1e-13, "ipopt.max_iter": 500, "ipopt.sb": "yes"}
    solver = ca.nlpsol("solver", "ipopt", problem, options)
    solution = solver(x0=guess, lbx=low, ubx=high, lbg=0, ubg=0)
    return float(solution["f"]) if solver.stats()["success"] else None


print("t_f,a,b,v_i,v_f,work,error")
for case in CASES:
    # Where IPOPT does not converge on a grid, the others decide.
    found = [f for f in (work(case, intervals) for intervals in (31, 40, 53, 80)) if f is not None]
    if len(found) > 1:
        *others, finest = found
        error = max(abs(finest - other) for other in others)
        print(*map(repr, case), f"{finest:.13f}", f"{error:.1e}", sep=",", flush=True)
