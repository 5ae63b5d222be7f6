#!/usr/bin/env python3
"""Coefficients of the approximations in src/numerics, by interpolation in Chebyshev nodes at 60 digits.

    venv/bin/python coefficients.py        (needs mpmath)

Prints each array, rounded to double, with the last Chebyshev coefficient: about the truncation error.
"""
from mpmath import (
    atanh, binomial, cos, exp, expm1, fsum, lambertw, log, lu_solve, matrix, mp, mpf, nstr, pi, polyval, sqrt,
)

mp.dps = 60


def interpolant(f, low, high, degree):
    """The interpolant in powers of x, and its last Chebyshev coefficient."""
    n = degree + 1
    angle = lambda j: pi * (2 * j + 1) / (2 * n)
    middle, half = (low + high) / 2, (high - low) / 2
    values = [f(middle + half * cos(angle(j))) for j in range(n)]
    c = [2 * fsum(values[j] * cos(m * angle(j)) for j in range(n)) / n for m in range(n)]
    c[0] /= 2
    powers = [[mpf(1)], [mpf(0), mpf(1)]]
    for m in range(2, n):
        p = [mpf(0)] + [2 * v for v in powers[m - 1]]
        for i, v in enumerate(powers[m - 2]):
            p[i] -= v
        powers.append(p)
    in_t = [fsum(c[m] * powers[m][i] for m in range(n) if i < len(powers[m])) for i in range(n)]
    in_x = [fsum(in_t[i] * binomial(i, j) * (-middle) ** (i - j) / half**i for i in range(j, n)) for j in range(n)]
    return in_x, c[-1]


def ln_u_over_w(w):
    if abs(w) < mpf(10) ** -25:
        return mpf(1)
    u = -lambertw(-exp(-1 - w * w / 2), 0 if w < 0 else -1).real
    return log(u) / w


def u_over_x(s):
    x = exp(-1) * s * (2 - s)
    return -lambertw(-x, 0).real / x if x > mpf(10) ** -40 else mpf(1)


def ln_u_far(v):
    w = 11 * v / (1 - v)
    return log(-lambertw(-exp(-1 - w * w / 2), -1).real)


def atanh_tail(z):
    s = sqrt(z)
    return (2 * atanh(s) - 2 * s) / s**3 if z > mpf(10) ** -30 else mpf(2) / 3


def exp_tail(r):
    return (expm1(r) - r) / r**2 if abs(r) > mpf(10) ** -20 else mpf(1) / 2


def above_branch(p):
    """E with E ln E - E + 1 = p^2/2."""
    return exp(1 + lambertw((p * p / 2 - 1) * exp(-1), 0).real)


def rational(f, high, degrees):
    """The interpolant of f on [0, high] with these degrees in Chebyshev nodes of p/(p + 6), and its greatest relative error."""
    count = sum(degrees) + 1
    most = high / (high + 6)
    to_p = lambda s: 6 * s / (1 - s)
    nodes = [to_p(most / 2 * (1 + cos(pi * (2 * j + 1) / (2 * count)))) for j in range(count)]
    system = matrix(count, count)
    for i, x in enumerate(nodes):
        for j in range(degrees[0] + 1):
            system[i, j] = x**j / f(x)
        for j in range(1, degrees[1] + 1):
            system[i, degrees[0] + j] = -(x**j)
    solved = list(lu_solve(system, matrix([1] * count)))
    above, below = solved[: degrees[0] + 1], [mpf(1)] + solved[degrees[0] + 1 :]
    value = lambda x: polyval(above[::-1], x) / polyval(below[::-1], x)
    return above, below, max(abs(value(x) / f(x) - 1) for x in (to_p(most * k / 400) for k in range(401)))


ARRAYS = [
    ("LN_U_OVER_W", ln_u_over_w, mpf(-1), mpf(1), 18),
    ("U_OVER_X", u_over_x, mpf(0), 1 - sqrt(-expm1(-mpf(1) / 2)), 14),
    ("LN_U_FAR", ln_u_far, mpf(1) / 12, mpf(2) / 5, 3),
    ("ATANH", atanh_tail, mpf(0), ((sqrt(mpf(2)) - 1) / (sqrt(mpf(2)) + 1)) ** 2, 6),
    ("EXP", exp_tail, -log(mpf(2)) / 2, log(mpf(2)) / 2, 10),
]

for name, f, low, high, degree in ARRAYS:
    coefficients, last = interpolant(f, low, high, degree)
    print(name, "truncation", nstr(last, 2))
    for c in coefficients:
        print("   ", repr(float(c)))

above, below, error = rational(above_branch, mpf(20), (11, 10))
print("NEAR_ABOVE and NEAR_BELOW", "truncation", nstr(error, 2))
for c in above + below:
    print("   ", repr(float(c)))
