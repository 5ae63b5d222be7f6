"""The package against the engine alone, and against what one would write in Python instead.

Usage: compare.py ENGINE WHEEL. ENGINE is the example `engine` of this crate, WHEEL the installed wheel. `python/benches/run` makes both.
"""

import subprocess
import sys
import timeit
from pathlib import Path

import numpy as np
import polars as pl

import slipsweep as ss

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benches/peers/python"))
import peers  # noqa: E402

PAPER = dict(a=0.03, b=0.05, v_i=3.0, v_f=100.0)

# Optima of the long table, and of the comparison with other tools.
MANY, FEW = 1_000_000, 100

# Repetitions of a measurement, of which the least counts.
TIMES = 5


def seconds(run, number=1):
    """The least time of a call."""
    return min(timeit.repeat(run, number=number, repeat=TIMES)) / number


def import_seconds():
    """What `import slipsweep` takes after `import numpy`."""

    def run(code):
        return seconds(lambda: subprocess.run([sys.executable, "-c", code], check=True))

    return run("import numpy, slipsweep") - run("import numpy")


def line(*cells):
    print(f"| {' | '.join(cells)} |")


def main():
    engine, wheel = sys.argv[1:]
    times = np.geomspace(0.01, 0.1, MANY)
    alone = min(float(subprocess.run([engine, str(MANY)], capture_output=True, text=True, check=True).stdout) for _ in range(2))
    ours = seconds(lambda: ss.optimal(**PAPER, t_f=times))
    shuffled = np.random.default_rng(1).permutation(times)
    scalar = seconds(lambda: ss.optimal(**PAPER, t_f=0.02), number=2000)
    table = ss.optimal(**PAPER, t_f=times)
    frame = pl.DataFrame(table)
    assert frame["work"].to_numpy(allow_copy=False).__array_interface__ == table["work"].__array_interface__
    line("measurement", "value", "limit")
    line("---", "---", "---")
    line("1e6 optima by the engine alone", f"{alone:.2f} s", "")
    line("1e6 optima from NumPy arrays", f"{ours:.2f} s, {ours / alone:.2f} of that", "1.1")
    line("the same in random order", f"{seconds(lambda: ss.optimal(**PAPER, t_f=shuffled)) / alone:.2f} of that", "")
    line("a scalar call", f"{scalar * 1e6:.1f} µs", "15 µs")
    line("`import slipsweep` after numpy", f"{import_seconds():.3f} s", "0.1 s")
    line("the wheel", f"{Path(wheel).stat().st_size / 1e6:.1f} MB", "15 MB")
    line("bytes copied from Arrow to polars", "0 of each column of numbers", "0")
    print()

    few = np.geomspace(0.01, 0.045, FEW)
    works = ss.optimal(**PAPER, t_f=few)["work"]
    solve = peers.collocation(20)
    tools = [
        ("slipsweep, one call", lambda: ss.optimal(**PAPER, t_f=few)["work"]),
        ("slipsweep, 100 calls", lambda: [ss.optimal(**PAPER, t_f=t_f)["work"] for t_f in few.tolist()]),
        ("`scipy.solve_bvp`, tolerance 1e-9", lambda: [peers.boundary_value(t_f, *PAPER.values(), 1e-9)[0] for t_f in few]),
        ("CasADi and IPOPT, 20 intervals", lambda: [solve(t_f, *PAPER.values(), True)[0] for t_f in few]),
    ]
    line("100 optima", "time", "greatest relative difference of work", "solved")
    line("---", "---", "---", "---")
    for name, run in tools:
        start = timeit.default_timer()
        found = np.array(run())
        spent = timeit.default_timer() - start
        if "slipsweep" in name:
            spent = seconds(run)
        difference = np.nanmax(np.abs(found / works - 1))
        line(name, f"{spent * 1e3:.3g} ms", f"{difference:.1e}", f"{np.isfinite(found).sum()}")


np.seterr(all="ignore")
main()
