"""First Lyapunov coefficients of the slip law and of Perrin, Rice and Zheng's at the critical stiffness.

    python hopf_laws.py > hopf_laws.csv      # mpmath

By Kuznetsov, Elements of Applied Bifurcation Theory, (5.39), from the equations of motion alone: derivatives along vectors by differences of the
vector field with 100 digits, eigenvectors by elimination. Time is in l/v and the amplitude is that of ln v.
"""

import random

from mpmath import exp, expm1, log, matrix, mp, mpc, mpf, sqrt

mp.dps = 100
STEP = mpf(10) ** -20

LAWS = {
    "ageing": lambda u: 1 - u,
    "slip": lambda u: -u * log(u),
    "prz": lambda u: (1 - u * u) / 2,
}


def flow(law, a, b, k, mass):
    """Dimension and vector field, with ln v of a state."""
    G = LAWS[law]
    if mass == 0:
        speed = lambda s: (s[0] - b * s[1]) / a
        return 2, lambda s: matrix([-k * expm1(speed(s)), exp(-s[1]) * G(exp(speed(s) + s[1]))]), speed
    field = lambda s: matrix([-k * expm1(s[2]), exp(-s[1]) * G(exp(s[1] + s[2])), exp(-s[2]) * (s[0] - a * s[2] - b * s[1]) / mass])
    return 3, field, lambda s: s[2]


def derivative(field, size, vectors):
    """The derivative of the field at 0 along real vectors, one for each order."""
    h = STEP
    total = matrix(size, 1)
    for signs in range(2 ** len(vectors)):
        signs = [1 if signs >> n & 1 else -1 for n in range(len(vectors))]
        weight = 1
        for sign in signs:
            weight *= sign
        at = sum((sign * h * vector for sign, vector in zip(signs, vectors)), matrix(size, 1))
        total += weight * field(at)
    return total / (2 * h) ** len(vectors)


def along(field, size, vectors):
    """The derivative along complex vectors, which is multilinear in real and imaginary parts."""
    total = matrix(size, 1)
    for parts in range(2 ** len(vectors)):
        factor, real = mpc(1), []
        for n, vector in enumerate(vectors):
            if parts >> n & 1:
                factor *= mpc(0, 1)
                real.append(vector.apply(mp.im))
            else:
                real.append(vector.apply(mp.re))
        total += factor * derivative(field, size, real)
    return total


def null_vector(M, size):
    """The null vector of a singular matrix with last component 1."""
    A = matrix(size - 1, size - 1)
    right = matrix(size - 1, 1)
    for i in range(size - 1):
        for j in range(size - 1):
            A[i, j] = M[i, j]
        right[i] = -M[i, size - 1]
    head = mp.lu_solve(A, right)
    return matrix(list(head) + [1])


def coefficient(law, a, b, mass):
    k = (b - a) * (1 + mass / a)
    size, field, speed = flow(law, a, b, k, mass)
    unit = lambda n: matrix([1 if i == n else 0 for i in range(size)])
    J = matrix(size, size)
    for n in range(size):
        column = derivative(field, size, [unit(n)])
        for i in range(size):
            J[i, n] = column[i]
    i, omega = mpc(0, 1), sqrt((b - a) / a)
    eye = mp.eye(size)
    q = null_vector(J - i * omega * eye, size)
    p = null_vector(J.T + i * omega * eye, size)
    assert mp.norm(J * q - i * omega * q) < mpf(10) ** -30 * mp.norm(q)
    assert mp.norm(J.T * p + i * omega * p) < mpf(10) ** -30 * mp.norm(p)
    q = q / speed(q)
    bar = q.apply(mp.conj)
    form = lambda *vectors: along(field, size, vectors)
    still = mp.lu_solve(J, form(q, bar))
    double = mp.lu_solve(2 * i * omega * eye - J, form(q, q))
    total = form(q, q, bar) - 2 * form(q, still) + form(bar, double)
    dot = lambda u, v: sum(mp.conj(u[n]) * v[n] for n in range(size))
    return (dot(p, total) / dot(p, q)).real / (2 * omega)


def log_uniform(rng, low, high):
    return float(exp(rng.uniform(float(log(low)), float(log(high)))))


def rows():
    rng = random.Random(20)
    for law in ("slip", "prz"):
        cases = [(0.005, 0.01, 1e5, 3.2e6, 7.5e-3, 2.5e-16)]
        while len(cases) < 36:
            a = log_uniform(rng, 1e-3, 0.3)
            b = a * (1 + log_uniform(rng, 1e-3, 19))
            v = log_uniform(rng, 1.5, 1e8)
            cases.append((a, b, 0.5 * v + 0.6, v, a, a * log_uniform(rng, 1e-6, 1e4) / v**2))
        for ratio in (1.01, 1.5, 2.0, 10.0):
            cases.append((0.01, 0.01 * ratio, 10.0, 100.0, 0.1, 0.0))
        cases.append((0.02, 0.01, 10.0, 100.0, 0.1, 1e-6))
        # Near where the kind of prz changes for b = 2 a: the double mu below makes mass of it.
        for fraction in (1e-2, -1e-2, 1e-4, -1e-4):
            mu = 0.09107188411405 * (1 + fraction)
            cases.append((0.0078125, 0.015625, 1e3, 1024.0, 7.5e-3, 0.0078125 * mu / 2**20))
        for a, b, v_i, v_f, k, m in cases:
            mass = mpf(m) * mpf(v_f) ** 2
            is_hopf = b > a and (m > 0 or law == "prz")
            found = coefficient(law, mpf(a), mpf(b), mass) if is_hopf else None
            yield [law] + [repr(x) for x in (a, b, v_i, v_f, k, m)] + ["" if found is None else mp.nstr(found, 25)]


if __name__ == "__main__":
    for name, mu, om in (("ageing", "0.2", "1.2"), ("slip", "0.2", "1.2"), ("prz", "0.2", "1.2")):
        a = mpf(1) / 100
        import sys
        print(name, mp.nstr(coefficient(name, a, a * (1 + mpf(om) ** 2), a * mpf(mu)), 16), file=sys.stderr)
    print("# made by hopf_laws.py, mpmath at 100 digits")
    print("law,a,b,v_i,v_f,k,m,first_lyapunov_coefficient")
    for row in rows():
        print(",".join(row))
