"""Least works for the slip law and that of Perrin, Rice and Zheng, 1 <= v <= v_ceiling, from the definitions.

    python relaxed.py > relaxed.csv      # mpmath; a law as argument for its rows alone

Times and works are integrals over ln theta of 1/(dw/dt) and tau v/(dw/dt) by tanh-sinh quadrature; the switching state is a root of the time; the
price of holding theta is that of a mixture of v = 1 and v = v_ceiling, and the state at which it is least is searched for. Nothing of the closed
forms of src/protocol/relaxed is used. What makes such a path the least is proved in docs/derivations.md, and tested by dynamic programming.
"""

import random
import sys

from mpmath import exp, findroot, lambertw, log, mp, mpf, quad

mp.dps = 30


def G(law, u):
    return -u * log(u) if law == "slip" else (1 - u * u) / 2


class Problem:
    def __init__(self, law, a, b, v_i, v_f, V):
        self.law = law
        self.a, self.b, self.V = mpf(a), mpf(b), mpf(V)
        self.w0, self.w1 = -log(mpf(v_i)), -log(mpf(v_f))

    def tau(self, w, v):
        return 1 + self.a * log(v) + self.b * w

    def rate(self, w, v):
        return G(self.law, exp(w) * v) / exp(w)

    def integral(self, f, low, high, v):
        """Of f over time at v, from ln theta = low to high; split where it is steep."""
        if low == high:
            return mpf(0)
        steady = -log(v)
        # In the logarithm of the distance from steady sliding.
        s = 1 if low > steady else -1
        x0, x1 = log(s * (low - steady)), log(s * (high - steady))
        g = lambda x: f(steady + s * exp(x)) / self.rate(steady + s * exp(x), v) * s * exp(x)
        return quad(g, [x0, (x0 + x1) / 2, x1])

    def arc(self, low, high, v):
        """Time and work from low to high at v."""
        return self.integral(lambda w: 1, low, high, v), self.integral(lambda w: self.tau(w, v) * v, low, high, v)

    def duty(self, w):
        slow, fast = self.rate(w, 1), self.rate(w, self.V)
        return slow / (slow - fast)

    def costate(self, w, v, H):
        """Of theta, from the constant Hamiltonian."""
        return (H - self.tau(w, v) * v) / G(self.law, exp(w) * v)

    def by_speed(self, w, v, H):
        """Derivative of tau v + costate theta' with respect to v."""
        theta = exp(w)
        slope = -log(theta * v) - 1 if self.law == "slip" else -theta * v
        return self.tau(w, v) + self.a + self.costate(w, v, H) * theta * slope

    def price(self, w):
        """What holding theta costs."""
        duty = self.duty(w)
        return duty * self.tau(w, self.V) * self.V + (1 - duty) * self.tau(w, mpf(1))

    def best(self, low):
        """The state of least price on [low, 0] and whether the price falls towards it from both sides."""
        n = 100
        places = [low * (1 - mpf(i) / n) for i in range(n + 1)]
        values = [self.price(w) for w in places]
        least = min(range(n + 1), key=lambda i: values[i])
        unimodal = all(values[i] >= values[i + 1] for i in range(least)) and all(values[i] <= values[i + 1] for i in range(least, n))
        if least in (0, n):
            slope = mp.diff(self.price, places[least] * (1 - mpf(10) ** -12), h=mpf(10) ** -16)
            if least == 0 and slope > 0 or least == n and slope < 0:
                return places[least], unimodal
        left, right = places[max(least - 1, 0)], places[min(least + 1, n)]
        h = mpf(10) ** -10
        root = findroot(lambda w: (self.price(w + h) - self.price(w - h)) / (2 * h), (left + h * 2, right - 2 * h if right < 0 else right - 2 * h), solver="anderson", tol=1e-18, verify=False)
        return root, unimodal

    def time(self, low, high, v):
        return self.arc(low, high, v)[0]


def bisect(f, low, high):
    """The root of a rising function: the Illinois method, with bisections where it lags."""
    at_low, at_high = f(low), f(high)
    assert at_low <= 0 <= at_high, (at_low, at_high)
    for step in range(300):
        secant = high - at_high * (high - low) / (at_high - at_low) if at_high > at_low else low
        x = (low + high) / 2 if step % 4 == 3 else secant
        value = f(x)
        if abs(value) < mpf(10) ** -26 or high - low < mpf(10) ** -27 * (1 + abs(x)):
            return x
        if value < 0:
            low, at_low, at_high = x, value, at_high / 2 if step % 4 != 3 else at_high
        else:
            high, at_high, at_low = x, value, at_low / 2 if step % 4 != 3 else at_low
    return x


def turn(p, t_f, up):
    """The path with one switch: w of the turn, and its arcs (w from, w to, v)."""
    first, second = (mpf(1), p.V) if up else (p.V, mpf(1))
    total = lambda w: p.time(p.w0, w, first) + p.time(w, p.w1, second) - t_f
    if up:
        base = max(p.w0, p.w1)
        # -w = e^x falls.
        x = bisect(lambda x: total(-exp(-x)), -log(-base), -log(-base) + 2 * t_f + 5)
        w = -exp(-x)
    else:
        base = min(p.w0, p.w1)
        floor, s = -log(p.V), 1 if base > -log(p.V) else -1
        x = bisect(lambda x: total(floor + s * exp(-x)), -log(s * (base - floor)), -log(s * (base - floor)) + p.V * t_f + 5)
        w = floor + s * exp(-x)
    return w, [(p.w0, w, first), (w, p.w1, second)]


def rise(p, t_f):
    """The rise faster than at v = 1: -H, where it ends, and its arcs' time and work."""
    c = p.b - p.a
    T = lambda w: 1 + c * w

    def parts(h):
        end = min(p.w1, max(p.w0, -(1 + h) / (h + c)))
        omega = lambda w: lambertw(T(w) * exp(-1 - w) / h).real
        t = quad(lambda w: T(w) / (h * omega(w) * (1 + omega(w))), [p.w0, (p.w0 + end) / 2, end])
        work = quad(lambda w: T(w) / (1 + omega(w)) - p.a, [p.w0, (p.w0 + end) / 2, end])
        return end, t, work, omega

    rest = lambda end: p.time(end, p.w1, mpf(1))
    low = -T(p.w0) / (1 + p.w0)
    g = lambda x: t_f - (lambda q: q[1] + rest(q[0]))(parts(low * exp(x)))
    high = mpf(1)
    while g(high) < 0:
        high *= 2
    x = bisect(g, mpf(0), high)
    return low * exp(x), *parts(low * exp(x))


def solve(law, a, b, v_i, v_f, t_f, V):
    """A row: strategy and numbers; None for what does not exist."""
    p = Problem(law, a, b, v_i, v_f, V)
    t_f = mpf(t_f)
    falls = p.w1 <= p.w0
    direct = p.time(p.w0, p.w1, p.V if falls else mpf(1))
    t_least = direct
    if law == "slip" and not falls and p.w0 < -1:
        e = max(p.w0, min(p.w1, mpf(-1)))
        t_least = mp.e * (exp(e) - exp(p.w0)) + p.time(e, p.w1, mpf(1))
    row = {"t_least": t_least}
    if t_f < t_least:
        return row
    if t_f < direct:
        h, end, t, work, omega = rise(p, t_f)
        wait_t, wait_w = p.arc(end, p.w1, mpf(1))
        v = lambda w: exp(-1 - omega(w) - w)
        taus = [p.tau(w, v(w)) for w in (p.w0 + (end - p.w0) * mpf(i) / 2000 for i in range(2001))]
        fine = max(taus)
        place = taus.index(fine)
        if 0 < place < 2000:
            w = findroot(lambda w: mp.diff(lambda s: p.tau(s, v(s)), w), p.w0 + (end - p.w0) * mpf(place) / 2000)
            fine = p.tau(w, v(w))
        by = lambda f: quad(lambda w: f(w) * v(w) / p.rate(w, v(w)), [p.w0, (p.w0 + end) / 2, end])
        row.update(dwork_da=by(lambda w: log(v(w))), dwork_db=by(lambda w: w) + p.integral(lambda w: w, end, p.w1, mpf(1)))
        v_end = mpf(1) if wait_t > 0 else v(p.w1)
        row.update(dwork_dv_i=-exp(2 * p.w0) * p.costate(p.w0, v(p.w0), -h), dwork_dv_f=exp(2 * p.w1) * p.costate(p.w1, v_end, -h))
        row.update(dwork_dv_ceiling=mpf(0))
        row.update(strategy="rise", work=work + wait_w, hamiltonian=-h, v_start=v(p.w0), v_end=mpf(1) if wait_t > 0 else v(p.w1),
                   time_at_floor=wait_t, time_at_v_ceiling=mpf(0), theta_max=exp(p.w1), friction_max=max(fine, p.tau(p.w1, mpf(1)) if wait_t > 0 else fine))
        return row
    # The proof holds down to the steady state of the ceiling, or to the lowest state that is feasible.
    is_proven = lambda low, unimodal: unimodal and (1 + (p.b - p.a) * low > 0 if law == "slip" else p.tau(low, 1) > 0)
    lowest = -log(p.V)
    best, unimodal = p.best(lowest)
    if p.w0 < lowest:
        # The path rises through the steady state of the ceiling. The price of slip has a pole below, where v = 1 is the slowest rise.
        assert is_proven(p.w0, p.best(p.w0)[1] if law == "prz" else unimodal)
    elif not is_proven(lowest, unimodal):
        lowest, _ = turn(p, t_f, False)
        best, unimodal = p.best(lowest)
        assert is_proven(lowest, unimodal)
    first = mpf(1) if best > p.w0 else p.V
    last = p.V if best > p.w1 else mpf(1)
    reached = best < 0 and best > -log(p.V) and p.time(p.w0, best, first) + p.time(best, p.w1, last)
    chatter = t_f - reached if reached is not False and reached < t_f else None
    if chatter is not None:
        pieces = [(p.w0, best, first), (best, p.w1, last)]
        turning = best
    else:
        turning, pieces = turn(p, t_f, best > turn_mid(p))
    work = sum(p.arc(*piece)[1] for piece in pieces)
    at = lambda v: sum((p.arc(*piece)[0] for piece in pieces if piece[2] == v), mpf(0))
    floor, ceiling = at(mpf(1)), at(p.V)
    on_ceiling = [w for low, high, v in pieces if v == p.V for w in (low, high)]
    on_floor = [w for low, high, v in pieces if v == 1 for w in (low, high)]
    H = p.price(turning)
    row.update(dwork_da=ceiling * p.V * log(p.V), dwork_db=sum(p.integral(lambda w: w * v, low, high, v) for low, high, v in pieces))
    row.update(dwork_dv_i=-exp(2 * p.w0) * p.costate(p.w0, pieces[0][2], H), dwork_dv_f=exp(2 * p.w1) * p.costate(p.w1, pieces[-1][2], H))
    row["dwork_dv_ceiling"] = sum(p.integral(lambda w: p.by_speed(w, v, H), low, high, v) for low, high, v in pieces if v == p.V)
    row.update(hamiltonian=H, v_start=pieces[0][2], v_end=pieces[-1][2], theta_max=exp(max(p.w0, p.w1, turning)))
    if chatter is not None:
        duty = p.duty(best)
        # A long time on the ceiling costs more than any wait.
        ways = (True,) if p.V * t_f > 40 else (True, False)
        bang = min(sum(p.arc(*piece)[1] for piece in turn(p, t_f, up)[1]) for up in ways)
        row.update(strategy="chatter", chatter_time=chatter, chatter_theta=exp(best), chatter_duty=duty, work_bang_bang=bang)
        work += chatter * p.price(best)
        row["dwork_da"] += chatter * duty * p.V * log(p.V)
        row["dwork_db"] += chatter * best * (duty * p.V + 1 - duty)
        row["dwork_dv_ceiling"] += chatter * duty * p.by_speed(best, p.V, H)
        floor += chatter * (1 - duty)
        ceiling += chatter * duty
        on_ceiling.append(best)
        on_floor.append(best)
    else:
        row["strategy"] = "wait_jerk" if pieces[0][2] == 1 else "jerk_wait"
    friction = [p.tau(w, p.V) for w in on_ceiling] + [p.tau(w, mpf(1)) for w in on_floor]
    row.update(work=work, time_at_floor=floor, time_at_v_ceiling=ceiling, friction_max=max(friction))
    return row


SLOPES = ["dwork_da", "dwork_db", "dwork_dv_i", "dwork_dv_f", "dwork_dv_ceiling"]


def least_ceiling(case):
    """The least ceiling of an acceleration, at which t_f is the least time; None for a deceleration."""
    law, a, b, v_i, v_f, t_f, V = case
    if v_f <= v_i:
        return None
    p = Problem(law, a, b, v_i, v_f, V)

    def missing(x):
        p.V = mpf(v_f) * (1 + exp(x))
        return t_f - p.time(p.w0, p.w1, p.V)

    low, high = mpf(-60), mpf(40)
    if missing(low) > 0:
        # Closer to v_f than 26 digits show.
        return mpf(v_f)
    x = bisect(missing, low, high)
    return mpf(v_f) * (1 + exp(x))


def turn_mid(p):
    return (p.w0 + p.w1) / 2


COLUMNS = ["work", "v_start", "v_end", "time_at_floor", "time_at_v_ceiling", "hamiltonian", "theta_max", "friction_max", "strategy", "chatter_time",
           "chatter_theta", "chatter_duty", "work_bang_bang", "t_least", "v_ceiling_least", *SLOPES]


def show(value):
    return "" if value is None else value if isinstance(value, str) else mp.nstr(value, 22)


def log_uniform(rng, low, high):
    return float(exp(rng.uniform(float(log(low)), float(log(high)))))


FIRST = {
    "slip": [(0.03, 0.05, 4.0, 80.0, 0.1, 600.0), (0.03, 0.05, 60.0, 2.5, 1.25, 600.0)],
    "prz": [(0.03, 0.05, 4.0, 80.0, 0.4, 600.0)],
}


def cases(law):
    rng = random.Random(5 if law == "slip" else 6)
    for case in FIRST[law]:
        yield law, *case
    made = 0
    while made < 110:
        a = log_uniform(rng, 1e-3, 0.1)
        b = rng.choice([0.0, 0.5, 1.0, 1.3, 1.7, 3.0]) * a
        if made % 12 == 11:
            b = 0.4 + 0.1 * rng.random()
            a = b / 10
        v_i, v_f = (log_uniform(rng, 1.2, 10 ** rng.choice([1, 3, 6])) for _ in range(2))
        V = max(v_i, v_f) * log_uniform(rng, 1.01, 10 ** rng.choice([1, 3]))
        p = Problem(law, a, b, v_i, v_f, V)
        least = solve(law, a, b, v_i, v_f, 0.0, V)["t_least"]
        direct = p.time(p.w0, p.w1, p.V if v_f >= v_i else mpf(1))
        if made % 4 == 0 and law == "slip" and direct > least:
            t_f = least + (direct - least) * mpf(rng.uniform(0.02, 0.98))
        elif made % 4 == 1:
            t_f = direct * (1 + mpf(log_uniform(rng, 1e-6, 1)))
        else:
            t_f = direct + mpf(log_uniform(rng, 1e-3, 5))
        t_f = float(t_f)
        if t_f * max(v_i, v_f) > 1e7:
            continue
        made += 1
        yield law, a, b, v_i, v_f, t_f, V
    # A ceiling below v_i.
    for _ in range(24):
        a = log_uniform(rng, 1e-3, 0.1)
        b = rng.choice([0.0, 0.5, 1.0, 1.3, 3.0]) * a
        v_f = log_uniform(rng, 1.2, 300)
        V = v_f * log_uniform(rng, 1.05, 100)
        v_i = V * log_uniform(rng, 1.01, 2 if law == "slip" else 100)
        p = Problem(law, a, b, v_i, v_f, V)
        direct = p.time(p.w0, p.w1, mpf(1))
        yield law, a, b, v_i, v_f, float(direct * (1 + mpf(log_uniform(rng, 1e-3, 3)))), V


if __name__ == "__main__":
    print("# made by relaxed.py, mpmath at 30 digits")
    print("law,a,b,v_i,v_f,t_f,v_ceiling," + ",".join(COLUMNS))
    skipped = 0
    for number, case in ((number, case) for law in sys.argv[1:] or FIRST for number, case in enumerate(cases(law))):
        try:
            row = solve(*case)
            if number % 3:
                # These take long.
                row = {name: value for name, value in row.items() if name not in SLOPES}
            else:
                row["v_ceiling_least"] = least_ceiling(case)
        except AssertionError:
            skipped += 1
            continue
        print(",".join([case[0]] + [repr(x) for x in case[1:]] + [show(row.get(name)) for name in COLUMNS]), flush=True)
    print(skipped, "cases without a proof, or closer to the ceiling than 30 digits show", file=sys.stderr)
