"""Three questions, answered with DuckDB. Usage: with_duckdb.py RESULTS, the folder with the datasets of docs/examples.md."""

import sys
from pathlib import Path

import duckdb

results = Path(sys.argv[1])
database = duckdb.connect()
for dataset, names in {"landscape": ["gap"], "crossover": ["optimal", "crossover"], "stick-slip": ["step_response"]}.items():
    for name in names:
        files = (results / dataset / name / "*.parquet").as_posix()
        database.execute(f"CREATE VIEW {name} AS SELECT * FROM read_parquet('{files}', hive_partitioning = false)")

# Map the landscape: the best point of the map at each duration.
best = """
    SELECT t_f, arg_min(alpha_2, gap), arg_min(alpha_3, gap), min(gap)
    FROM gap WHERE status = 'ok' GROUP BY t_f ORDER BY t_f
"""
for t_f, alpha_2, alpha_3, gap in database.execute(best).fetchall():
    print(f"landscape: t_f={t_f} alpha_2={alpha_2:.2f} alpha_3={alpha_3:.2f} gap={gap:.3e}")

# Locate the crossover in t_f: the theory, and the first duration of the grid that does not speed up at once.
crossover = """
    SELECT b, v_f, any_value(t_cross), min(t_f)
    FROM crossover JOIN optimal USING (b, v_f)
    WHERE strategy <> 'speed_up' GROUP BY b, v_f ORDER BY b, v_f
"""
for b, v_f, t_cross, first in database.execute(crossover).fetchall():
    print(f"crossover: b={b} v_f={v_f:.6g} t_cross={t_cross:.6f} first={first:.6f}")

# Which material falls into stick-slip: the stiffest spring that does, at each final velocity.
stiffest = "SELECT v_f, count(*), max(k) FROM step_response WHERE stick_slip GROUP BY v_f ORDER BY v_f"
for v_f, springs, k in database.execute(stiffest).fetchall():
    print(f"stick-slip: v_f={v_f:.6g} springs={springs} stiffest={k:.6g}")
