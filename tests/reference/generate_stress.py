#!/usr/bin/env python3
"""Points of the stress sample, which is drawn over the whole legal domain, to 25 digits.

    SLIPSWEEP_STRESS=400 SLIPSWEEP_STRESS_PRINT=1 cargo test --release --test solver stress:: -- --nocapture --test-threads 1 > points.txt
    venv/bin/python generate_stress.py points.txt

The formulas are those of generate.py, at 80 digits: between velocities and times twenty decades apart half of them cancel. A point is left out
where the optimum is not physical, where there is none, where the time on the floor lasts longer than the digits distinguish theta from 1, and where the quadrature
does not reach the digits that its own checks need, or takes more than a minute (a quarter of that for
bounded_friction); what is left out is counted. Members of bounded_friction are Taylor series as in generate_shortcut_friction.py.
"""
import csv, functools, multiprocessing, re, signal, sys

import generate
import generate_shortcut_friction as friction
import generate_shortcut_velocity as shortcut
from generate import Problem, Unphysical, crossover_row, landscape_point, landscape_status, optimal_row, show, stability_row
from mpmath import mp, mpf

DIGITS = 80
SECONDS = {"shortcut bounded_friction": 15}
MOST_SECONDS = 60
HOLD = 60

FIELD = re.compile(r"\b(\w+): (true|false|inf|-?[0-9][0-9.e+-]*)")
POINT = re.compile(r"((?:shortcut )?\w+) (\d+): (Point .*)")
LAW = ("a", "b", "v_i", "v_f")


class Late(Exception):
    pass


def late(*_):
    raise Late


def points(path, table):
    """The points of one table, each a dictionary."""
    for line in open(path):
        point = POINT.search(line)
        if point and point[1] == table:
            found = {}
            for key, value in FIELD.findall(point[3]):
                found.setdefault(key, int(value == "true") if value in ("true", "false") else float(value))
            yield int(point[2]), found


def of_optimal(p):
    problem = Problem(p["a"], p["b"], p["v_i"], p["v_f"], bool(p["bounded"]))
    if mpf(p["t_f"]) <= problem.least_time() or p["v_i"] == p["v_f"]:
        raise Unphysical
    if p["bounded"] and p["t_f"] - problem.least_time() > HOLD:
        raise Unphysical
    key = [p[name] for name in (*LAW, "t_f")] + [p["bounded"]]
    row = optimal_row(*key[:5], bool(p["bounded"]))
    # The branch of the family is chosen at 16 digits.
    assert row[3] >= 0 and (not p["bounded"] or row[1] >= 1)
    return key, row


def of_crossover(p):
    if p["v_i"] == p["v_f"] or not p["bounded"]:
        raise Unphysical
    key = [p[name] for name in LAW]
    return key, crossover_row(*key)


def of_gap(p):
    key = [p[name] for name in (*LAW, "t_f", "a_2", "a_3")]
    if not landscape_status(*key):
        return key, [None, None, "infeasible"]
    work, v_min, _, status = landscape_point(*key)
    assert status != "infeasible"
    mp.dps = DIGITS // 2
    rough = landscape_point(*key)[0]
    mp.dps = DIGITS
    assert abs(rough - work) <= mpf(10) ** -22 * abs(work), (rough, work)
    return key, [work, v_min, status]


def of_stability(p):
    key = [p[name] for name in ("a", "b", "k", "m", "v")]
    if p["m"] == 0 or p["k"] == float("inf"):
        raise Unphysical
    return None, stability_row(*key)


def of_family(family, p):
    key = [p[name] for name in (*LAW, "t_f")]
    solve = shortcut.FAMILIES[family]
    row = solve(*key) if family == "bounded_velocity" else solve(*map(mpf, key))
    if family != "bounded_velocity" and row[1] is not None:
        mp.dps = DIGITS // 2
        rough = solve(*map(mpf, key))[1]
        mp.dps = DIGITS
        assert abs(rough - row[1]) <= mpf(10) ** -22 * abs(row[1]), (rough, row[1])
    return key, row


def of_friction(p):
    key = [p[name] for name in (*LAW, "t_f", "tau_ceiling")]
    # Without a bound there is no member.
    if p["tau_ceiling"] == float("inf"):
        raise Unphysical
    friction.ctx.prec = friction.FINE[0]
    exact = tuple(map(friction.arb, key))
    least = friction.least_time(exact)
    if not exact[4] > least:
        raise Unphysical
    return key, [mpf(x.str(40, radius=False)) for x in friction.Course(exact).member(least.mid())]


FAMILY = ["a", "b", "v_i", "v_f", "t_f", *shortcut.HEADER[6:]]
TABLES = {
    **{f"shortcut {family}": (FAMILY, functools.partial(of_family, family), 60) for family in shortcut.FAMILIES},
    "shortcut bounded_friction": (["a", "b", "v_i", "v_f", "t_f", "tau_ceiling", "alpha", "work", "v_min", "v_max", "friction_max"], of_friction, 400),
    "optimal": (["a", "b", "v_i", "v_f", "t_f", "bounded", "work", "v_start", "v_end", "time_at_floor", "hamiltonian", "theta_max", "strategy"], of_optimal, 160),
    "crossover": (["a", "b", "v_i", "v_f", "t_cross", "t_floor", "t_cheapest", "t_min", "t_turn", "t_free_in", "t_free_out",
                   "work_at_t_cross", "work_at_t_floor", "work_at_t_cheapest", "work_at_t_min", "work_at_t_turn"], of_crossover, 100),
    "gap": (["a", "b", "v_i", "v_f", "t_f", "a_2", "a_3", "work", "v_min", "status"], of_gap, 200),
    "stability": (["a", "b", "k", "m", "v", "growth_rate", "frequency", "decay_rate"], of_stability, 200),
}


def solved(job):
    """One row, or why there is none."""
    table, index, point = job
    generate.DIGITS = mp.dps = DIGITS
    signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, SECONDS.get(table, MOST_SECONDS))
    try:
        key, row = TABLES[table][1](point)
        return [index] + (row if key is None else [repr(x) for x in key] + [show(x) for x in row])
    except Unphysical:
        return "has no physical answer"
    except Late:
        return "takes too long"
    except (AssertionError, ArithmeticError, TypeError, ValueError, mp.NoConvergence) as error:
        return f"lacks digits ({type(error).__name__})"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def main(path, tables):
    for table in tables or TABLES:
        header, _, most = TABLES[table]
        jobs = [(table, index, point) for index, point in points(path, table)][:most]
        left_out = {}
        with multiprocessing.Pool(2) as pool, open(f"stress_{table.removeprefix('shortcut ')}.csv", "w", newline="") as file:
            digits = "Arb at 84 digits" if table == "shortcut bounded_friction" else f"mpmath at {DIGITS} digits"
            file.write(f"# made by generate_stress.py, {digits}, of the first {len(jobs)} points\n")
            out = csv.writer(file, lineterminator="\n")
            out.writerow(["point"] + header)
            for (_, index, _), row in zip(jobs, pool.imap(solved, jobs)):
                if isinstance(row, str):
                    left_out[row] = left_out.get(row, 0) + 1
                    print(table, index, row, file=sys.stderr)
                else:
                    out.writerow(row)
                    file.flush()
        print(table, len(jobs), "points, left out:", left_out)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
