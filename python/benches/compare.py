"""The package against the engine alone, and against what one would write in Python instead.

Usage: compare.py ENGINE WHEEL. ENGINE is the example `engine` of this crate, WHEEL the installed wheel. `python/benches/run` makes both.
"""

import csv
import importlib.metadata
import os
import platform
import subprocess
import sys
import timeit
from pathlib import Path

import numpy as np
import polars as pl

import slipsweep as ss

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / "benches/peers/python"))
import peers  # noqa: E402

PAPER = dict(a=0.03, b=0.05, v_i=3.0, v_f=100.0)

# Optima of the long table, and of the comparison with other tools.
MANY, FEW = 1_000_000, 100

# Repetitions of a measurement, of which the least counts.
TIMES = 5

# Calls of a repetition for a single row.
CALLS = 1000


def seconds(run, number=1):
    """The least time of a call."""
    return min(timeit.repeat(run, number=number, repeat=TIMES)) / number


def alone(engine):
    """Seconds of the engine for the long table, on as many threads as the package has."""
    return float(subprocess.run([engine, str(MANY)], capture_output=True, text=True, check=True).stdout)


def import_seconds():
    """Seconds of `import slipsweep` after `import numpy`."""

    def run(code):
        return seconds(lambda: subprocess.run([sys.executable, "-c", code], check=True))

    return run("import numpy, slipsweep") - run("import numpy")


def copied_bytes(table):
    """Bytes of numbers that polars does not share with the table."""
    frame, copied = pl.DataFrame(table), 0
    for name in table.units:
        shared = frame[name].to_numpy(allow_copy=False).__array_interface__["data"][0]
        if shared != table[name].__array_interface__["data"][0]:
            copied += table[name].nbytes
    return copied


def reference():
    """The first optima of tests/reference that stay above the velocity floor, which `solve_bvp` does not know: their arguments and works."""
    with open(REPOSITORY / "tests/reference/optimal.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    above = lambda row: float(row["time_at_floor"]) == 0 and min(float(row["v_start"]), float(row["v_end"])) > 1  # noqa: E731
    rows = list(filter(above, rows))[:FEW]
    assert len(rows) == FEW
    names = ("t_f", "a", "b", "v_i", "v_f")
    return {name: np.array([float(row[name]) for row in rows]) for name in names}, np.array([float(row["work"]) for row in rows])


def line(*cells):
    print(f"| {' | '.join(cells)} |", flush=True)


def package(engine, wheel):
    """The table of the package alone."""
    times = np.geomspace(0.01, 0.1, MANY)
    shuffled = np.random.default_rng(1).permutation(times)
    rust, ours, random = [], [], []
    # In turns, so that a slower machine slows all of them.
    for _ in range(3):
        rust.append(alone(engine))
        ours.append(seconds(lambda: ss.optimal(**PAPER, t_f=times)))
        random.append(seconds(lambda: ss.optimal(**PAPER, t_f=shuffled)))
    copied = copied_bytes(ss.optimal(**PAPER, t_f=times))
    line("measurement", "value", "limit")
    line("---", "---", "---")
    line("1e6 optima by the Rust engine", f"{min(rust):.2f} s", "")
    line("1e6 optima from NumPy arrays", f"{min(ours):.2f} s, {min(ours) / min(rust):.2f} of that", "1.1")
    line("the same in random order", f"{min(random):.2f} s, {min(random) / min(rust):.2f} of that", "")
    line("a scalar call", f"{seconds(lambda: ss.optimal(**PAPER, t_f=0.02), CALLS) * 1e6:.1f} µs", "15 µs")
    line("a scalar call and its work", f"{seconds(lambda: ss.optimal(**PAPER, t_f=0.02)['work'], CALLS) * 1e6:.1f} µs", "")
    line("`import slipsweep` after numpy", f"{import_seconds():.3f} s", "0.1 s")
    line("the wheel", f"{Path(wheel).stat().st_size / 1e6:.1f} MB", "15 MB")
    line("bytes copied from Arrow to polars", str(copied), "0")
    assert copied == 0


def others():
    """The table of the same optima by several tools."""
    arguments, works = reference()
    rows = [dict(zip(arguments, values)) for values in zip(*(values.tolist() for values in arguments.values()))]
    solve = peers.collocation(20)
    tools = {
        "slipsweep, one call": lambda: ss.optimal(**arguments)["work"],
        "slipsweep, 100 calls": lambda: [ss.optimal(**row)["work"] for row in rows],
        "`scipy.solve_bvp`, tolerance 1e-6": lambda: [peers.boundary_value(*row.values(), 1e-6)[0] for row in rows],
        "`scipy.solve_bvp`, tolerance 1e-9": lambda: [peers.boundary_value(*row.values(), 1e-9)[0] for row in rows],
        "CasADi and IPOPT, 20 intervals": lambda: [solve(*row.values(), True)[0] for row in rows],
    }
    line(f"{len(rows)} optima", "time", "solved", "median error", "greatest error")
    line("---", "---", "---", "---", "---")
    for name, run in tools.items():
        start = timeit.default_timer()
        found = np.array(run())
        spent = timeit.default_timer() - start
        # What is fast is measured again.
        spent = seconds(run) if spent < 1 else spent
        solved = np.isfinite(found)
        errors = np.abs(found / works - 1)[solved]
        line(name, f"{spent * 1e3:.3g} ms", str(solved.sum()), f"{np.median(errors):.1e}", f"{errors.max():.1e}")


def main():
    np.seterr(all="ignore")
    threads = os.environ.get("RAYON_NUM_THREADS") or os.cpu_count()
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "polars", "scipy", "casadi"))
    package(*sys.argv[1:])
    print()
    others()
    print(f"\nPython {platform.python_version()}, {versions}; {threads} threads for slipsweep, one for the others. Errors of the work are relative to")
    print("references of 25 digits. The construction of the optimisation problem is not in the times.")


main()
