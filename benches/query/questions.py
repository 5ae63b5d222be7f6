"""Asks a dataset the same questions through slipsweep, Python polars and DuckDB, in turns, and prints the least time of each.

usage: questions.py PROGRAM DATASET
"""

import os
import subprocess
import sys
import time

import duckdb
import polars as pl

ROUNDS = 5
QUESTIONS = {
    # What `run` recommends.
    "least by duration": "SELECT t_f, min(gap) FROM gap WHERE status = 'ok' GROUP BY t_f ORDER BY t_f",
    "rows by status": "SELECT status, count(*) AS points FROM gap GROUP BY status ORDER BY points DESC",
    "ten least": "SELECT t_f, alpha_2, alpha_3, gap FROM gap WHERE status = 'ok' ORDER BY gap LIMIT 10",
    "mean of a window": "SELECT avg(gap) AS mean, max(v_min) AS v FROM gap WHERE alpha_2 > -5 AND alpha_2 < 5 AND status = 'ok'",
}


def ours(program, dataset, question):
    subprocess.run([program, "query", dataset, question], check=True, stdout=subprocess.DEVNULL)


def polars(files, question):
    pl.SQLContext(gap=pl.scan_parquet(files)).execute(question).collect(engine="streaming")


def in_duckdb(files, question):
    duckdb.sql(question.replace("FROM gap", f"FROM read_parquet('{files}')")).fetchall()


def main():
    program, dataset = sys.argv[1:]
    files = f"{dataset}/gap/*.parquet"
    rows = duckdb.sql(f"SELECT count(*) FROM read_parquet('{files}')").fetchall()[0][0]
    megabytes = os.path.getsize(program) / 1e6
    print(f"{rows:,} rows, {os.cpu_count()} threads, polars {pl.__version__}, duckdb {duckdb.__version__}, program of {megabytes:.0f} MB\n")
    print(f"{'question':<20}{'slipsweep':>10}{'polars':>10}{'duckdb':>10}{'/polars':>10}{'/duckdb':>10}")
    for name, question in QUESTIONS.items():
        asked = [lambda: ours(program, dataset, question), lambda: polars(files, question), lambda: in_duckdb(files, question)]
        best = [float("inf")] * len(asked)
        for _ in range(ROUNDS):
            for place, ask in enumerate(asked):
                start = time.perf_counter()
                ask()
                best[place] = min(best[place], time.perf_counter() - start)
        times = "".join(f"{seconds:>8.2f} s" for seconds in best)
        print(f"{name:<20}{times}{best[0] / best[1]:>10.1f}{best[0] / best[2]:>10.1f}")


main()
