#!/usr/bin/env python3
"""Every table at random points of the physical domain: numbers of loose tolerances against those of the tightest.

Usage: tests/nightly/tolerances.py PROGRAM POINTS [SEED]

Prints for each table and rtol the numbers that differ by more than 2 rtol, the rows without a number at one of the two, and
the rows that are not converged; then verifies the table at its default rtol. 3,000 points take ten minutes of two cores.
Exits with 1 if a number differs or a row is not converged. Needs pandas and pyarrow.
"""

import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq

RTOLS = ["1e-2", "1e-4", "1e-6", "1e-8"]
TIGHTEST = "1e-12"
FREE = "velocity_bound = false\n"
# Columns of the points, table, and keys of [model].
SWEEPS = {
    "optimal": ("t_f a b v_i v_f", "optimal", ""),
    "optimal, no floor": ("t_f a b v_i v_f", "optimal", FREE),
    "optimal, regularised": ("t_f a b v_i v_f", "optimal", FREE + 'friction = "regularised"\n'),
    "ceilings": ("t_f a b v_i v_f v_ceiling tau_ceiling", "optimal", ""),
    "ceilings, no floor": ("t_f a b v_i v_f v_ceiling tau_ceiling", "optimal", FREE),
    "laws": ("law t_f a b v_i v_f v_most", "optimal", ""),
    "feedback": ("theta t_left a b v_f v_ceiling tau_ceiling", "feedback", ""),
    "crossover": ("a b v_i v_f", "crossover", ""),
    "gap": ("t_f a b v_i v_f alpha_2 alpha_3", "gap", ""),
    "gap, ceiling": ("t_f a b v_i v_f v_ceiling alpha_2 alpha_3", "gap", ""),
    "gap, laws": ("law t_f a b v_i v_f v_most alpha_2 alpha_3", "gap", ""),
    "best_cubic": ("t_f a b v_i v_f", "best_cubic", ""),
    "best_cubic, ceiling": ("t_f a b v_i v_f v_ceiling", "best_cubic", ""),
    "best_cubic, laws": ("law t_f a b v_i v_f v_most", "best_cubic", ""),
    "shortcut": ("t_f a b v_i v_f tau_ceiling", "shortcut", ""),
    "compliant": ("t_f a b v_i v_f k m dt", "compliant", ""),
    "regularised": ("t_f a b v_i v_f k m delta_t", "regularised", ""),
    "regularised, no floor": ("t_f a b v_i v_f k m delta_t", "regularised", FREE),
    "stability": ("a b v_i v_f k m", "stability", ""),
    "step_response": ("state_law a b v_i v_f k_c_near m", "step_response", ""),
}
HEADINGS = {"v_most": "v_ceiling", "state_law": "law", "k_c_near": "k"}


def draw(rng):
    """A point of the physical domain: docs/spec.md."""
    log = lambda low, high: math.exp(rng.uniform(math.log(low), math.log(high)))
    sign = lambda: rng.choice([-1, 1])
    while True:
        a = log(1e-3, 0.3)
        b = rng.choice([0.0, a] + 8 * [min(0.5, a * log(0.05, 20))])
        b = a if abs(b - a) < 1.1e-3 * a else b
        v_i = 1 + log(1e-3, 1e10)
        v_f = rng.choice([v_i, 1 + log(1e-3, 1e10), v_i * (1 + sign() * log(1.1e-6, 0.5))])
        fastest, slowest = max(v_i, v_f), min(v_i, v_f)
        t_f = log(1e-3, 1e7) / fastest
        steady = [1 + (a - b) * math.log(v) for v in (v_i, v_f)]
        if 1.001 < slowest and fastest < 1e10 and t_f < 1e4 and max(steady) > 0.05:
            break
    m = rng.choice([0, a * log(1e-8, 1e4) / v_f**2])
    k = rng.choice([math.inf] + 9 * [a * log(1e-4, 1e5)])
    # Near the critical stiffness, where there is one.
    k_c = (b - a) * (1 + m * v_f**2 / a)
    near = k_c * (1 + sign() * log(1e-8, 0.9)) if b > a and rng.random() < 0.5 else k
    point = {
        "t_f": t_f, "t_left": t_f, "a": a, "b": b, "v_i": v_i, "v_f": v_f, "theta": 1 / v_i, "m": m, "k": k,
        "k_c_near": near if 1e-4 < near / a < 1e5 else k,
        "v_ceiling": rng.choice([math.inf, min(1e12, v_f * (1 + log(1e-6, 1e3)))]),
        "tau_ceiling": rng.choice([math.inf, max(steady) + 3 * a * log(1e-7, 1)]),
        "v_most": min(1e12, fastest * (1 + log(1e-3, 1e3))),
        "alpha_2": sign() * log(1e-3, 1e2) / t_f, "alpha_3": sign() * log(1e-3, 1e2) / t_f**2,
        "dt": t_f * log(1e-3, 0.5), "delta_t": max(1e-19, t_f * log(1e-9, 0.5)),
        "law": rng.choice(["slip", "prz"]), "state_law": rng.choice(["ageing", "ageing", "slip", "prz"]),
    }  # fmt: skip
    return point


def run(program, folder, table, model, rtol):
    """The table of the points, and its dataset."""
    name = f"at-{rtol or 'default'}"
    line = f"rtol = {rtol}\n" if rtol else ""
    spec = folder / f"{name}.toml"
    spec.write_text(f'name = "{name}"\npoints = "points.csv"\n[model]\n{model}[tables.{table}]\n{line}')
    subprocess.run([program, "run", "--quiet", spec, "--out", folder], check=True)
    return pq.read_table(folder / name / table).to_pandas(), folder / name


def scale(column, exact):
    """What an error is relative to: docs/accuracy.md."""
    size = exact[column].abs()
    if column in ("gap", "tau_ceiling_least", "sampling_error"):
        return 1 + size
    if column in ("v_c_min", "v_c_max"):
        return np.maximum(exact.v_c_min.abs(), exact.v_c_max.abs())
    if column == "t_peak":
        return size / np.minimum(1, exact.v_peak / exact.v_f - 1)
    return size


def compare(rtol, found, exact, inputs):
    """Prints what differs, and returns how many numbers do."""
    wrong = 0
    for column in found.columns.difference(inputs):
        if found[column].dtype.kind != "f":
            continue
        with np.errstate(all="ignore"):
            error = ((found[column] - exact[column]).abs() / scale(column, exact)).where(found[column] != exact[column], 0)
        off = error > 2 * float(rtol)
        nulls = found[column].isna() != exact[column].isna()
        wrong += off.sum()
        if off.any():
            worst = error.idxmax()
            print(f"  {rtol} {column}: {off.sum()} differ, row {worst} by {error[worst] / float(rtol):.3g} rtol")
        if nulls.any():
            print(f"  {rtol} {column}: {nulls.sum()} rows without a number at one of the two")
    lost = (found.status == "not_converged").sum()
    if lost:
        print(f"  {rtol}: {lost} rows not converged")
    return wrong + lost


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    program, count = Path(sys.argv[1]).resolve(), int(sys.argv[2])
    rng = random.Random(int(sys.argv[3]) if len(sys.argv) == 4 else 0)
    points = [draw(rng) for _ in range(count)]
    wrong = 0
    for title, (columns, table, model) in SWEEPS.items():
        columns = columns.split()
        rows = [point for point in points if table != "step_response" or 1e-6 < point["v_f"] / point["v_i"] < 1e6]
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            frame = pd.DataFrame(rows)[columns].rename(columns=HEADINGS)
            frame.to_csv(folder / "points.csv", index=False, float_format="%.17g")
            print(f"{title}: {len(rows)} points", flush=True)
            exact, _ = run(program, folder, table, model, TIGHTEST)
            for rtol in RTOLS:
                wrong += compare(rtol, run(program, folder, table, model, rtol)[0], exact, set(frame.columns))
            dataset = run(program, folder, table, model, "")[1]
            verified = subprocess.run([program, "verify", dataset, "--sample", "300"], capture_output=True, text=True)
            if verified.returncode:
                print(verified.stdout + verified.stderr)
    sys.exit(int(wrong > 0))


if __name__ == "__main__":
    main()
