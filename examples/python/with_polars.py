"""Three questions, answered with polars. Usage: with_polars.py RESULTS, the folder with the datasets of docs/examples.md."""

import sys
from pathlib import Path

import polars as pl

results = Path(sys.argv[1])


def table(dataset, name):
    return pl.scan_parquet(results / dataset / name / "*.parquet")


# Map the landscape: the best point of the map at each duration.
gap = table("landscape", "gap").filter(pl.col("status") == "ok")
best = gap.sort("gap").group_by("t_f", maintain_order=True).first().sort("t_f").collect()
for row in best.iter_rows(named=True):
    print(f"landscape: t_f={row['t_f']} alpha_2={row['alpha_2']:.2f} alpha_3={row['alpha_3']:.2f} gap={row['gap']:.3e}")

# Locate the crossover in t_f: the theory, and the first duration of the grid that does not speed up at once.
optimal = table("crossover", "optimal").filter(pl.col("strategy") != "speed_up")
first = optimal.group_by("b", "v_f").agg(pl.col("t_f").min().alias("first"))
crossover = table("crossover", "crossover").join(first, on=["b", "v_f"]).sort("b", "v_f").collect()
for row in crossover.iter_rows(named=True):
    print(f"crossover: b={row['b']} v_f={row['v_f']:.6g} t_cross={row['t_cross']:.6f} first={row['first']:.6f}")

# Which material falls into stick-slip: the stiffest spring that does, at each final velocity.
step = table("stick-slip", "step_response").filter(pl.col("stick_slip"))
stiffest = step.group_by("v_f").agg(pl.col("k").max(), pl.len().alias("springs")).sort("v_f").collect()
for row in stiffest.iter_rows(named=True):
    print(f"stick-slip: v_f={row['v_f']:.6g} springs={row['springs']} stiffest={row['k']:.6g}")
