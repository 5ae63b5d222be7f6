"""Rows as NumPy, Arrow, polars, pandas, pyarrow, DuckDB and xarray."""

import pickle

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
    if expected.dtype != float:
        return cells.tolist() == expected.tolist()
    missing = np.isnan(expected)
    cells = cells.astype(float)
    return bool((np.isnan(cells) == missing).all()) and cells[~missing].tobytes() == expected[~missing].tobytes()


# Springs below and above the critical stiffness without a mass: a row without an answer, and one with it.
SPRINGS = dict(a=0.03, b=0.05, v_i=3.0, v_f=100.0, k=[0.01, 0.1], m=0.0)


def test_same_compares_bits():
    one = np.array([1.0, np.nan, 0.0])
    assert same(one, one.copy()) and same([True, None], np.array([True, None]))
    assert not same(one, [1.0, np.nan, -0.0]) and not same(one, [1.0, 0.0, 0.0]) and not same(one, [np.nextafter(1, 2), np.nan, 0.0])


# How each tool gives back a column, missing cells as None or NaN.
TOOLS = {
    "polars": lambda table, name: table.to_polars()[name].to_list(),
    "polars from the stream": lambda table, name: pl.DataFrame(table)[name].to_list(),
    "pandas": lambda table, name: table.to_pandas()[name].tolist(),
    "pyarrow": lambda table, name: table.to_arrow()[name].to_pylist(),
    "duckdb": lambda rows, name: [row[0] for row in duckdb.sql(f"SELECT {name} FROM rows").fetchall()],
    "xarray": lambda table, name: np.broadcast_to(table.to_xarray()[name].values, table.shape).ravel().tolist(),
}


@pytest.mark.parametrize("tool", TOOLS)
def test_round_trips(tool):
    """Every column: numbers, words and flags, with missing cells of each."""
    tables = [ss.step_response(**SPRINGS), ss.optimal(t_f=[0.02, 1e-6], a=0.03, b=0.05, v_i=100.0, v_f=3.0)]
    fields = [(table, field) for table in tables for field in table.fields]
    missing = {field.kind for table, field in fields if any(cell is None or cell != cell for cell in table._flat(field.name))}
    assert missing == {"number", "word", "flag"}
    for table, field in fields:
        cells = TOOLS[tool](table, field.name)
        if field.kind == "number":
            cells = [np.nan if cell is None else cell for cell in cells]
        else:
            cells = [cell if isinstance(cell, (str, bool)) else None for cell in cells]
        assert same(cells, table._flat(field.name)), field.name


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
    with pytest.raises(KeyError, match="no column `work_`; expected t_f, .*work"):
        table["work_"]
    with pytest.raises(TypeError, match="columns have names, not int"):
        table[0]
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


def test_tables_and_traces_are_pickled(table):
    again = pickle.loads(pickle.dumps(table))
    assert again.shape == table.shape and again.name == table.name and again.fields == table.fields
    assert all(same(again[name], table[name]) for name in table.columns)
    trace = ss.trace("optimal", **PAPER, points=11)
    again = pickle.loads(pickle.dumps(trace))
    assert again.facts == trace.facts and same(again["v"], trace["v"])


def test_single_rows_have_the_cells_of_arrow():
    for made in [ss.optimal(**PAPER), ss.optimal(**PAPER | dict(v_i=100.0, v_f=3.0, t_f=1e-6)), ss.stability(**SPRINGS | dict(k=1.0))]:
        cells = {name: made[name] for name in made.columns}
        frame = made.to_polars()
        for name, cell in cells.items():
            assert same([cell], np.array([np.nan if name in made.units and frame[name][0] is None else frame[name][0]])), name
