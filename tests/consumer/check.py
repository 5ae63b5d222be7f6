"""Reads a dataset folder as it is with polars, pandas with pyarrow, and DuckDB, and checks values, types and metadata.

Usage: check.py DATASET, the folder that `slipsweep run tests/consumer/small.toml` writes.
"""

import json
import math
import sys
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq

STATUS = {"ok", "below_bound", "infeasible", "negative_friction", "unproven", "not_converged"}
AXES = ["t_f", "a", "b", "v_i", "v_f", "alpha_2", "alpha_3"]
GAP = AXES + ["work", "work_optimal", "gap", "v_min", "status"]

# The axes of small.toml.
ALPHA_2 = np.linspace(-0.5, 0.5, 21)
ALPHA_3 = np.linspace(-0.5, 0.5, 41)
T_F = [0.02, 0.037, 0.049]


def check_manifest(dataset):
    manifest = json.loads((dataset / "manifest.json").read_text())
    assert manifest["name"] == "small"
    assert "tables.gap" in manifest["spec"]
    rows = {table["name"]: table["rows"] for table in manifest["tables"]}
    assert rows == {"gap": 3 * 21 * 41, "best_cubic": 3, "optimal": 3, "crossover": 1}
    for table in manifest["tables"]:
        parts = sorted(path.name for path in (dataset / table["name"]).iterdir())
        assert parts == [f"part-{part:06}.parquet" for part in range(table["parts"])]
    return manifest


def check_pandas(dataset):
    frame = pd.read_parquet(dataset / "gap")
    assert list(frame.columns) == GAP
    assert all(frame[column].dtype == np.float64 for column in GAP[:-1])
    assert isinstance(frame["status"].dtype, pd.CategoricalDtype)
    assert set(frame["status"].cat.categories) <= STATUS
    # The axes are the doubles that a notebook computes, in the order of the spec.
    t_f, alpha_2, alpha_3 = (grid.ravel() for grid in np.meshgrid(T_F, ALPHA_2, ALPHA_3, indexing="ij"))
    assert (frame["t_f"] == t_f).all()
    assert (frame["alpha_2"] == alpha_2).all()
    assert (frame["alpha_3"] == alpha_3).all()
    assert (frame["a"] == 0.03).all() and (frame["v_f"] == 100.0).all()
    # A number exists exactly where the status requires one, and never NaN in the file.
    infeasible = frame["status"] == "infeasible"
    for column in ["work", "work_optimal", "gap", "v_min"]:
        assert (frame[column].isna() == infeasible).all()
    given = frame[~infeasible]
    assert np.allclose(given["gap"], given["work"] / given["work_optimal"] - 1, rtol=0, atol=1e-15)
    assert (given["v_min"][given["status"] == "ok"] >= 1 - 1e-9).all()
    assert (given["v_min"][given["status"] == "below_bound"] < 1).all()
    return frame


def check_polars(dataset, frame):
    table = pl.read_parquet(dataset / "gap" / "*.parquet")
    assert table.columns == GAP
    assert table.schema["status"] == pl.Categorical
    assert [table.schema[column] for column in GAP[:-1]] == [pl.Float64] * 11
    for column in GAP[:-1]:
        values = table[column]
        assert values.is_nan().sum() == 0
        assert np.array_equal(values.to_numpy(), frame[column].to_numpy(), equal_nan=True)
    assert table["status"].cast(pl.String).to_list() == frame["status"].tolist()
    lazy = pl.scan_parquet(dataset / "gap" / "*.parquet").filter((pl.col("t_f") == 0.037) & (pl.col("status") == "ok"))
    least = lazy.sort("gap").first().collect()
    expected = frame[(frame["t_f"] == 0.037) & (frame["status"] == "ok")].sort_values("gap").iloc[0]
    assert least["gap"][0] == expected["gap"]
    optimal = pl.read_parquet(dataset / "optimal" / "*.parquet")
    assert optimal["strategy"].cast(pl.String).to_list() == ["speed_up", "speed_up", "slow_down"]
    # The paper's figures: the gap's minimum at t_f = 0.02 and the crossover.
    best = pl.read_parquet(dataset / "best_cubic" / "*.parquet")
    assert math.isclose(best["gap"][0], 6.580308e-7, rel_tol=1e-6)
    assert math.isclose(best["alpha_2"][0], -0.1198296, rel_tol=1e-6)
    crossover = pl.read_parquet(dataset / "crossover" / "*.parquet")
    assert math.isclose(crossover["t_cross"][0], 0.0374184120524, rel_tol=1e-10)
    assert crossover["t_min"].null_count() == 1


def check_duckdb(dataset, frame):
    path = f"'{dataset}/gap/*.parquet'"
    types = dict(duckdb.sql(f"select column_name, column_type from (describe select * from {path})").fetchall())
    assert types == {**{column: "DOUBLE" for column in GAP[:-1]}, "status": "VARCHAR"}
    counts = dict(duckdb.sql(f"select status, count(*) from {path} group by status").fetchall())
    assert counts == frame["status"].value_counts()[lambda count: count > 0].to_dict()
    [(nulls, nans)] = duckdb.sql(
        f"select count(*) filter (gap is null), count(*) filter (isnan(gap)) from {path}"
    ).fetchall()
    assert (nulls, nans) == (counts["infeasible"], 0)
    [(total,)] = duckdb.sql(f"select sum(work) from {path} where alpha_2 <= 0 and t_f = 0.02").fetchall()
    expected = frame[(frame["alpha_2"] <= 0) & (frame["t_f"] == 0.02)]["work"].sum()
    assert math.isclose(total, expected, rel_tol=1e-13)
    footer = dict(
        (key.decode(), value.decode())
        for key, value in duckdb.sql(f"select key, value from parquet_kv_metadata({path})").fetchall()
    )
    assert footer["slipsweep.table"] == "gap"


def check_metadata(dataset, manifest):
    for table in manifest["tables"]:
        file = pq.ParquetFile(dataset / table["name"] / "part-000000.parquet")
        schema = file.schema_arrow
        for field in schema:
            assert field.metadata[b"description"], field.name
            is_word = pa.types.is_dictionary(field.type)
            assert is_word or field.type == pa.float64(), field
            assert bool(field.metadata[b"unit"]) != is_word, field
        footer = {key.decode(): value.decode() for key, value in file.metadata.metadata.items()}
        assert footer["slipsweep.spec"] == manifest["spec"]
        assert footer["slipsweep.hash"] == table["hash"]
        assert footer["slipsweep.version"] == manifest["version"]
        assert footer["slipsweep.revision"] == manifest["revision"]
        assert footer["slipsweep.table"] == table["name"]
        assert (footer["slipsweep.row_start"], footer["slipsweep.row_end"]) == ("0", str(table["rows"]))
    schema = pq.read_schema(dataset / "gap" / "part-000000.parquet")
    assert schema.field("alpha_2").metadata[b"unit"] == b"1/t_f"
    assert schema.field("alpha_3").metadata[b"unit"] == b"1/t_f^2"
    # Readers can skip row groups by what they hold.
    group = pq.ParquetFile(dataset / "gap" / "part-000000.parquet").metadata.row_group(0)
    for column, (least, greatest) in {0: (0.02, 0.049), 5: (-0.5, 0.5), 6: (-0.5, 0.5)}.items():
        statistics = group.column(column).statistics
        assert (statistics.min, statistics.max, statistics.null_count) == (least, greatest, 0)
    gap = group.column(GAP.index("gap")).statistics
    assert gap.has_min_max and gap.null_count > 0


def main():
    dataset = Path(sys.argv[1])
    manifest = check_manifest(dataset)
    frame = check_pandas(dataset)
    check_polars(dataset, frame)
    check_duckdb(dataset, frame)
    check_metadata(dataset, manifest)
    print(f"{dataset}: pandas {pd.__version__}, pyarrow {pa.__version__}, polars {pl.__version__}, duckdb {duckdb.__version__} agree")


main()
