"""Three questions, answered with xarray. Usage: with_xarray.py RESULTS, the folder with the datasets of docs/examples.md."""

import sys
from pathlib import Path

import slipsweep as ss

results = Path(sys.argv[1])

# Map the landscape: the best point of the map at each duration.
landscape = ss.open(results / "landscape")["gap"].to_xarray()
gap = landscape["gap"].where(landscape["status"] == "ok")
for t_f, best in gap.groupby("t_f"):
    place = best.squeeze("t_f").argmin(["alpha_2", "alpha_3"])
    point = best.squeeze("t_f").isel(place)
    alpha_2, alpha_3 = float(point["alpha_2"]), float(point["alpha_3"])
    print(f"landscape: t_f={t_f} alpha_2={alpha_2:.2f} alpha_3={alpha_3:.2f} gap={float(point):.3e}")

# Locate the crossover in t_f: the theory, and the first duration of the grid that does not speed up at once.
optimal = ss.open(results / "crossover")["optimal"].to_xarray()
crossover = ss.open(results / "crossover")["crossover"].to_xarray()
first = optimal["t_f"].where(optimal["strategy"] != "speed_up").min("t_f")
for b in crossover["b"].values:
    for v_f in crossover["v_f"].values:
        point = {"b": b, "v_f": v_f}
        t_cross, at = float(crossover["t_cross"].sel(point)), float(first.sel(point))
        print(f"crossover: b={b} v_f={v_f:.6g} t_cross={t_cross:.6f} first={at:.6f}")

# Which material falls into stick-slip: the stiffest spring that does, at each final velocity.
step = ss.open(results / "stick-slip")["step_response"].to_xarray()
slips = step["stick_slip"] == True  # noqa: E712, a flag may be null
for v_f in step["v_f"].values:
    springs = slips.sel(v_f=v_f)
    if springs.any():
        print(f"stick-slip: v_f={v_f:.6g} springs={int(springs.sum())} stiffest={float(step['k'].where(springs).max()):.6g}")
