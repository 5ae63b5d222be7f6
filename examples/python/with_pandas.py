"""Three questions, answered with pandas. Usage: with_pandas.py RESULTS, the folder with the datasets of docs/examples.md."""

import sys
from pathlib import Path

import pandas as pd

results = Path(sys.argv[1])


def table(dataset, name, columns=None):
    return pd.read_parquet(results / dataset / name, columns=columns)


# Map the landscape: the best point of the map at each duration.
gap = table("landscape", "gap", ["t_f", "alpha_2", "alpha_3", "gap", "status"])
gap = gap[gap["status"] == "ok"]
best = gap.loc[gap.groupby("t_f")["gap"].idxmin()].sort_values("t_f")
for row in best.itertuples():
    print(f"landscape: t_f={row.t_f} alpha_2={row.alpha_2:.2f} alpha_3={row.alpha_3:.2f} gap={row.gap:.3e}")

# Locate the crossover in t_f: the theory, and the first duration of the grid that does not speed up at once.
optimal = table("crossover", "optimal")
first = optimal[optimal["strategy"] != "speed_up"].groupby(["b", "v_f"], as_index=False)["t_f"].min()
crossover = table("crossover", "crossover").merge(first.rename(columns={"t_f": "first"}), on=["b", "v_f"])
for row in crossover.sort_values(["b", "v_f"]).itertuples():
    print(f"crossover: b={row.b} v_f={row.v_f:.6g} t_cross={row.t_cross:.6f} first={row.first:.6f}")

# Which material falls into stick-slip: the stiffest spring that does, at each final velocity.
step = table("stick-slip", "step_response")
step = step[step["stick_slip"] == True]  # noqa: E712, a flag may be null
for v_f, springs in step.groupby("v_f")["k"]:
    print(f"stick-slip: v_f={v_f:.6g} springs={len(springs)} stiffest={springs.max():.6g}")
