"""Rows as NumPy, Arrow, polars, pandas, pyarrow, DuckDB and xarray."""

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from conftest import PAPER, command

import slipsweep as ss


@pytest.fixture(scope="module")
def table():
    """Rows of every type: numbers, some of them missing, words and flags."""
    return ss.optimal(**PAPER | dict(v_i=100.0, v_f=3.0, t_f=np.geomspace(1e-3, 10.0, 1000)))


def test_numpy_columns_are_not_copied(table):
    first, second = table["work"], table["work"]
    assert first.__array_interface__["data"][0] == second.__array_interface__["data"][0]
    assert not first.flags.writeable and not first.flags.owndata
    with pytest.raises(ValueError, match="read-only"):
        first[0] = 0.0


def test_polars_does_not_copy():
    # Without missing cells, so that NumPy can look at the memory of polars.
    table = ss.optimal(**PAPER | dict(t_f=np.geomspace(0.01, 0.1, 1000)))
    frame = pl.DataFrame(table)
    for field in table.fields:
        if field.kind == "number":
            memory = frame[field.name].to_numpy(allow_copy=False)
            assert memory.__array_interface__["data"] == table[field.name].__array_interface__["data"]


def test_arrow_outlives_the_table():
    frame = pl.DataFrame(ss.optimal(**PAPER | dict(t_f=[0.02, 0.037])))
    numbers = ss.optimal(**PAPER | dict(t_f=[0.02, 0.037]))["work"]
    for _ in range(100):
        ss.optimal(**PAPER | dict(t_f=[0.049, 0.1]))
    assert frame["work"].to_list() == numbers.tolist() == [ss.optimal(**PAPER | dict(t_f=t))["work"] for t in (0.02, 0.037)]


def same(cells, expected):
    """Whether cells are equal bit by bit, missing ones included."""
    cells, expected = np.asarray(cells), np.asarray(expected)
    if expected.dtype == float:
        return cells.astype(float).tobytes() == expected.tobytes() or np.array_equal(cells, expected, equal_nan=True)
    return cells.tolist() == expected.tolist()


def test_round_trips(table):
    frames = {
        "polars": lambda name: table.to_polars()[name].to_numpy(),
        "pandas": lambda name: table.to_pandas()[name].astype(object).where(lambda cells: cells.notna(), None).to_numpy()
        if table[name].dtype == object
        else table.to_pandas()[name].to_numpy(),
        "pyarrow": lambda name: pa.table(table)[name].to_pandas().to_numpy(),
        "duckdb": lambda name: np.array([row[0] for row in duckdb.from_arrow(pa.table(table)).select(name).fetchall()]),
    }
    for tool, column in frames.items():
        for name in ["t_f", "work", "v_end", "theta_max"]:
            cells = np.array([np.nan if cell is None else cell for cell in column(name)], dtype=float)
            assert same(cells, table[name]), (tool, name)
    assert table.to_polars()["status"].cast(pl.String).to_list() == table["status"].tolist()
    assert table.to_polars()["strategy"].cast(pl.String).to_list() == table["strategy"].tolist()
    assert [word if isinstance(word, str) else None for word in table.to_pandas()["strategy"]] == table["strategy"].tolist()


def test_flags():
    table = ss.stability(a=0.03, b=0.05, v_i=3.0, v_f=100.0, k=[1e-3, 1.0, 10.0])
    flags = table["stable_f"]
    assert flags.dtype == bool and flags.tolist() == table.to_polars()["stable_f"].to_list()
    assert table.to_pandas()["stable_f"].tolist() == flags.tolist()


def test_units_travel(table):
    field = pa.table(table).field("work")
    assert field.metadata[b"unit"] == b"mu_0 sigma l" and field.metadata[b"description"] == b"least work of friction W*"
    assert table.to_pandas().attrs["units"]["work"] == "mu_0 sigma l"
    work = table.to_xarray()["work"]
    assert work.attrs == {"units": "mu_0 sigma l", "long_name": "least work of friction W*"}
    assert work.coords["t_f"].attrs["units"] == "l/v_0"
    assert pa.schema(table).names == table.columns


def test_xarray_has_the_grid():
    table = ss.gap(**PAPER | dict(t_f=[0.02, 0.037]), grid=dict(alpha_2=np.linspace(-1, 1, 5), alpha_3=[0.0, 0.1]), unit="1/t_f")
    data = table.to_xarray()
    assert dict(data.sizes) == {"t_f": 2, "alpha_2": 5, "alpha_3": 2}
    assert same(data["gap"].values, table["gap"]) and data.coords["a"].ndim == 0
    scattered = ss.optimal(**PAPER | dict(t_f=[0.02, 0.037], v_f=[50.0, 100.0])).to_xarray()
    assert dict(scattered.sizes) == {"row": 2}
    assert dict(ss.optimal(**PAPER).to_xarray().sizes) == {}


def test_tables_show_themselves(table):
    text, page = repr(table), table._repr_html_()
    assert text.startswith("optimal: 1,000 rows\n") and "mu_0 sigma l" in text and text.endswith("...")
    assert "<th>work</th>" in page and "<i>mu_0 sigma l</i>" in page and page.count("<tr>") == 12


def test_unknown_columns_name_the_known_ones(table):
    with pytest.raises(KeyError, match="no column `work_`.*work"):
        table["work_"]
    assert "work" in list(table)


def test_pictures_are_those_of_the_command(tmp_path):
    times = "[0.02, 0.025, 0.03, 0.037, 0.04, 0.045, 0.049]"
    spec = f'name = "one"\n[axes]\nt_f = {times}\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n[tables.optimal]\n'
    (tmp_path / "one.toml").write_text(spec)
    command("run", "one.toml", "--quiet", cwd=tmp_path)
    command("plot", "results/one", "--table", "optimal", "--out", "one.svg", cwd=tmp_path)
    picture = ss.optimal(**PAPER | dict(t_f=eval(times))).plot()
    assert picture == (tmp_path / "one.svg").read_text()
    assert picture._repr_svg_().startswith("<svg")
    picture.save(tmp_path / "again.svg")
    assert (tmp_path / "again.svg").read_text() == picture
    picture.save(tmp_path / "again.png", dpi=50)
    assert (tmp_path / "again.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="the name ends in none of .svg, .png, .pdf"):
        picture.save(tmp_path / "again.gif")


def test_pandas_frames_can_be_changed(table):
    frame = table.to_pandas()
    frame.loc[0, "work"] = 1.0
    assert frame.loc[0, "work"] == 1.0 and isinstance(frame["status"].dtype, pd.CategoricalDtype)
