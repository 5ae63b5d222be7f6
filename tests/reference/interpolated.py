"""First Lyapunov coefficients of the interpolated law theta' = (u^(1 - eps) - u)/eps, and how much slip keeps optima smooth.

    python interpolated.py > interpolated.csv      # mpmath

The coefficients are those of hopf_laws.py. An optimum is smooth where the cost tau v is a convex function of the rate theta' at a fixed state. The curvature is
that of three points of the curve, and its root in the fraction of slip is the border.
"""

import random

import hopf_laws
from hopf_laws import coefficient, log_uniform
from mpmath import exp, findroot, log, mp, mpf

STEP = mpf(10) ** -25


def interpolated(eps):
    return (lambda u: -u * log(u)) if eps == 0 else lambda u: (u ** (1 - eps) - u) / eps


def curvature(rate, cost, u):
    g, c = zip(*((rate(x), cost(x)) for x in (u * (1 - STEP), u, u * (1 + STEP))))
    return ((c[2] - c[1]) / (g[2] - g[1]) - (c[1] - c[0]) / (g[1] - g[0])) / (g[2] - g[0])


def cost_at(a, b, v):
    """tau v over u = theta v, at the state 1/v."""
    return lambda u: v * u * (1 + a * log(u * v) - b * log(v))


def root(function, start):
    # The curvature by differences has 50 digits.
    return findroot(function, (start, start * (1 + mpf(10) ** -6)), solver="secant", tol=mpf(10) ** -40, verify=False)


def slip_fraction(a, b, v_i, v_f):
    """The lesser border of both states, each found at two velocities."""
    borders = []
    for v in (v_i, v_f):
        steady = 1 + (a - b) * log(v)
        found = [root(lambda e: curvature(lambda w: (1 - e) * (1 - w) - e * w * log(w), cost_at(a, b, v), u), a / (a + steady))
                 for u in (mpf(7) / 10, mpf(40))]
        assert abs(found[0] / found[1] - 1) < mpf(10) ** -30
        borders.append(found[0])
    return min(borders)


def least_eps(a, b, v_i, v_f):
    """The greatest border over some states from that of the greater velocity to 1, and velocities above 1."""
    fastest = max(v_i, v_f)
    if 1 - b * log(fastest) <= max(b - a, 0):
        return None
    borders = []
    for part in (1, mpf(2) / 3, mpf(1) / 3, mpf(1) / 100):
        v = fastest**part
        cost = cost_at(a, b, v)
        for u in (1 / v, v ** -mpf("0.5"), mpf(1), mpf(20)):
            # A fixed-point iteration starts the secant method.
            slip = mpf(0)
            for _ in range(60):
                tau = cost(u) / (u * v)
                slip = a * (u ** (1 - slip) - slip) / ((1 - slip) * (tau + a))
            slip = root(lambda s: curvature(interpolated(1 - s), cost, u), slip)
            assert 0 < slip < 1
            borders.append((slip, part, u))
    least = min(borders)
    assert least[1] == 1 and least[2] == 1 / fastest, borders
    return 1 - least[0]


def rows():
    rng = random.Random(6)
    cases = [(0.97, 0.005, 0.01, 1e5, 3.2e6, 7.5e-3, 2.5e-16), (0.97, 0.03, 0.05, 4.0, 80.0, 0.1, 0.0)]
    while len(cases) < 52:
        a = log_uniform(rng, 1e-3, 0.3)
        b = a * (1 + log_uniform(rng, 1e-3, 19)) if len(cases) < 44 else a * rng.uniform(0, 1)
        v = log_uniform(rng, 1.5, 1e6)
        eps = rng.choice([0.0, 1.0, rng.random(), rng.random(), 1 - log_uniform(rng, 1e-6, 0.1), log_uniform(rng, 1e-6, 0.1)])
        # Steady friction is positive.
        if 1 + (a - b) * float(log(v)) > 0.05 and b <= 0.5:
            cases.append((eps, a, b, 0.5 * v + 0.6, v, a, a * log_uniform(rng, 1e-6, 1e4) / v**2))
    for case in cases:
        eps, a, b, v_i, v_f, k, m = map(mpf, case)
        hopf_laws.LAWS["eps"] = interpolated(eps)
        found = coefficient("eps", a, b, m * v_f**2) if b > a and m > 0 else None
        borders = slip_fraction(a, b, v_i, v_f), least_eps(a, b, v_i, v_f)
        yield [repr(x) for x in case] + ["" if x is None else mp.nstr(x, 25) for x in (found, *borders)]


if __name__ == "__main__":
    print("# made by interpolated.py, mpmath at 100 digits")
    print("law_eps,a,b,v_i,v_f,k,m,first_lyapunov_coefficient,slip_fraction_smooth,law_eps_smooth")
    for row in rows():
        print(",".join(row))
