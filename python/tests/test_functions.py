"""The functions of tables: arguments, messages, statuses and documentation."""

import inspect
import re

import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import DEFINITIONS, PAPER, arguments

import slipsweep as ss


def shown_axes(name):
    """The axes that a call without a law has as columns: then the tables of cubic shortcuts have no ceiling."""
    names = [axis["name"] for axis in DEFINITIONS[name]["axes"] if not axis["is_tacit"]]
    return [axis for axis in names if axis != "v_ceiling" or name not in ("gap", "best_cubic")]


@pytest.mark.parametrize("name", DEFINITIONS)
def test_every_table_has_a_function(name):
    function = getattr(ss, name)
    table = function(**arguments(name))
    definition = DEFINITIONS[name]
    axes = [axis["name"] for axis in definition["axes"]]
    columns = [column["name"] for column in definition["columns"] if not column["is_optional"]]
    assert table.columns == [*shown_axes(name), *columns, "status"]
    assert list(inspect.signature(function).parameters)[: len(axes)] == axes
    for axis in definition["axes"]:
        assert axis["doc"] in function.__doc__
        assert axis["words"] or axis["range"] in function.__doc__
    for column in definition["columns"]:
        assert f"{column['name']}, in {column['unit']}" in function.__doc__ or not column["unit"]
    units = {column["name"]: column["unit"] for column in definition["columns"] if column["unit"]}
    assert all(table.units[name] == units[name] for name in columns if name in units)


@pytest.mark.parametrize("name", DEFINITIONS)
def test_empty_arrays_give_no_rows(name):
    given = arguments(name)
    first = next(iter(given))
    table = getattr(ss, name)(**given | {first: np.empty(0)})
    assert len(table) == 0 and table.shape[0] == 0
    assert table["status"].shape == table.shape
    assert pl.DataFrame(table).columns == table.columns


@pytest.mark.parametrize("name", DEFINITIONS)
def test_optional_columns_are_computed_when_named(name):
    optional = [column["name"] for column in DEFINITIONS[name]["columns"] if column["is_optional"]]
    if optional:
        assert getattr(ss, name)(**arguments(name), columns=optional).columns == [*shown_axes(name), *optional, "status"]


def test_scalars_give_scalars():
    table = ss.optimal(**PAPER)
    assert table.shape == () and len(table) == 1
    assert isinstance(table["work"], float) and abs(table["work"] - 3.808_111_416_33) < 1e-10
    assert table["t_f"] == 0.02 and table["strategy"] == "speed_up" and table["status"] == "ok"


TIMES = [0.02, 0.037, 0.049]


@pytest.mark.parametrize(
    "times",
    [
        TIMES,
        tuple(TIMES),
        np.array(TIMES),
        np.array(TIMES * 2)[::2][[0, 2, 1]],
        np.array(TIMES[::-1])[::-1],
        np.array(TIMES, dtype=">f8"),
        np.array(TIMES, dtype=object),
        np.ma.masked_array(TIMES),
        pd.Series(TIMES),
        pd.Series(TIMES, index=[5, 3, 1]),
        pd.Series(TIMES, dtype="Float64"),
        pl.Series(TIMES),
        pl.Series([TIMES[:1], TIMES[1:]]).explode(),
    ],
    ids=lambda value: type(value).__module__ + "." + type(value).__name__,
)
def test_arguments_of_any_kind(times):
    table = ss.optimal(**PAPER | dict(t_f=times))
    assert table.shape == (3,)
    for work, time in zip(table["work"], np.asarray(times, dtype=float)):
        assert work == ss.optimal(**PAPER | dict(t_f=float(time)))["work"]


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.int8, np.int64, np.uint32])
def test_dtypes_become_doubles(kind):
    values = np.array([20, 50, 100], dtype=kind)
    assert (ss.optimal(**PAPER | dict(v_f=values))["work"] == ss.optimal(**PAPER | dict(v_f=[20.0, 50.0, 100.0]))["work"]).all()
    assert ss.optimal(**PAPER | dict(v_f=values[2]))["work"] == ss.optimal(**PAPER)["work"]


def test_arguments_broadcast_as_in_numpy():
    t_f, v_f = np.array(TIMES)[:, None], np.array([50.0, 100.0, 150.0, 200.0])
    table = ss.optimal(**PAPER | dict(t_f=t_f, v_f=v_f))
    assert table.shape == (3, 4) and table["work"].shape == (3, 4)
    assert (table["t_f"] == np.broadcast_to(t_f, (3, 4))).all() and (table["v_f"] == np.broadcast_to(v_f, (3, 4))).all()
    assert table["work"][2, 1] == ss.optimal(**PAPER | dict(t_f=0.049))["work"]
    assert ss.optimal(**PAPER | dict(t_f=[0.02]))["work"].shape == (1,)
    assert ss.optimal(**PAPER | dict(t_f=np.array(0.02)))["work"].shape == ()


def test_the_grid_is_a_product():
    grid = dict(alpha_2=np.linspace(-0.2, 0.2, 5), alpha_3=[-0.1, 0.0, 0.1])
    table = ss.gap(**PAPER, grid=grid, unit="1/t_f")
    assert table.shape == (5, 3)
    one = ss.gap(**PAPER, alpha_2=grid["alpha_2"][1], alpha_3=0.1, unit="1/t_f")
    assert table["gap"][1, 2] == one["gap"]
    assert table.units["alpha_2"] == "1/t_f" and table.units["alpha_3"] == "1/t_f^2"
    table = ss.gap(**PAPER | dict(t_f=TIMES), grid=grid, unit="1/t_f")
    assert table.shape == (3, 5, 3)
    assert table["gap"][0, 1, 2] == one["gap"] or np.isnan(one["gap"])
    model = ss.gap(**PAPER, alpha_2=-0.12 / 0.02, alpha_3=-0.066 / 0.02**2)
    assert model["gap"] == pytest.approx(ss.gap(**PAPER, alpha_2=-0.12, alpha_3=-0.066, unit="1/t_f")["gap"], rel=1e-5)


def test_words():
    table = ss.shortcut(**PAPER)
    assert table.shape == (4,) and list(table["family"]) == DEFINITIONS["shortcut"]["axes"][5]["words"]
    assert ss.shortcut(**PAPER, family="cubic")["work"] == table["work"][1]
    assert list(ss.shortcut(**PAPER, family=["cubic", "step"])["work"]) == [table["work"][1], table["work"][0]]
    assert ss.shortcut(**PAPER | dict(t_f=TIMES)).shape == (3, 4)
    assert ss.shortcut(**PAPER, grid=dict(family=["cubic"])).shape == (1,)


def test_repeated_values_have_repeated_rows():
    table = ss.optimal(**PAPER | dict(t_f=[0.02, 0.02, 0.037, 0.02]))
    assert table["work"][0] == table["work"][1] == table["work"][3] == ss.optimal(**PAPER)["work"]


def test_failed_rows_have_a_status():
    table = ss.optimal(**PAPER | dict(v_i=100.0, v_f=3.0, t_f=[1e-6, 1.0]))
    assert list(table["status"]) == ["infeasible", "ok"]
    assert np.isnan(table["work"][0]) and np.isfinite(table["work"][1]) and table["strategy"][0] is None
    assert pl.DataFrame(table)["work"].null_count() == 1


@pytest.mark.parametrize(
    "change, message",
    [
        (dict(t_f=-1.0), "t_f: -1.0 is out of range\n  expected: 1e-20 <= t_f <= 1e20\n  help: choose values in the range"),
        (dict(t_f=[0.02, np.nan]), "t_f[1]: NaN is out of range\n  expected: 1e-20 <= t_f <= 1e20"),
        (dict(t_f=pd.Series([0.02, None])), "t_f[1]: NaN is out of range"),
        (dict(t_f=np.ma.masked_array([0.02, 0.03], mask=[False, True])), "t_f[1]: NaN is out of range"),
        (dict(v_f=0.5), "velocities are in units of v_0, above 1; for m/s, add `units = \"si\"` and the scales to [model]"),
        (dict(t_f=None), "`optimal` needs t_f\n  expected: axes t_f, a, b, v_i, v_f; optional: law, v_ceiling, tau_ceiling\n"),
        (dict(t_f=[1, 2], v_f=[1, 2, 3]), "arguments of different shapes: t_f (2,), v_f (3,)"),
        (dict(t_f="fast"), "t_f: found \"fast\"\n  expected: a number"),
        (dict(t_f=["fast", "slow"]), "t_f: found \"fast\""),
        (dict(t_f=np.array([1j])), "t_f: found complex128\n  expected: numbers"),
        (dict(grid=dict(t_f=[1.0])), "t_f: an argument and an axis of `grid`"),
        (dict(grid=[1.0]), "grid: found list\n  expected: axes and their values"),
        (dict(grid=dict(k=[1.0])), "k: `optimal` has no such axis"),
        (dict(grid=dict(bogus=[1.0])), "grid: unknown axis `bogus`"),
        (dict(grid=dict(t_f=[[1.0, 2.0]]), t_f=None), "grid: t_f has the shape (1, 2)"),
        (dict(rtol=1.0), "rtol: 1.0 is out of range\n  expected: 1e-13 <= rtol <= 1e-2"),
        (dict(columns=["work_"]), "unknown column `work_`"),
        (dict(units="cgs"), "model.units: unknown unit system \"cgs\""),
        (dict(units="si"), "model.units: \"si\" without `mu_0`"),
    ],
)
def test_wrong_arguments_raise_value_error(change, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        ss.optimal(**PAPER | change)


def test_wrong_words_and_units():
    with pytest.raises(ValueError, match="family: unknown family `cubi`.*\n.*\n.*did you mean `cubic`"):
        ss.shortcut(**PAPER, family="cubi")
    with pytest.raises(ValueError, match="family: found 1"):
        ss.shortcut(**PAPER, family=1)
    with pytest.raises(ValueError, match="unit: unknown unit"):
        ss.gap(**PAPER, alpha_2=0.0, alpha_3=0.0, unit="1/s")
    with pytest.raises(TypeError, match="unexpected keyword argument 'k'"):
        ss.optimal(**PAPER, k=1.0)


def test_more_rows_than_memory_are_refused():
    many = np.linspace(-0.5, 0.5, 1_000_000)
    with pytest.raises(MemoryError, match="1000000000000 rows do not fit into memory"):
        ss.gap(**PAPER, grid=dict(alpha_2=many, alpha_3=many))


def test_si_units():
    scales = dict(mu_0=0.6, l=1e-5, v_0=1e-6, normal_stress=5e6)
    scaled = ss.optimal(**PAPER)
    si = ss.optimal(t_f=0.02 * 10.0, a=0.03 * 0.6, b=0.05 * 0.6, v_i=3e-6, v_f=1e-4, units="si", **scales)
    assert si.units["work"] == "J/m^2" and si.units["t_f"] == "s"
    assert si["work"] == pytest.approx(scaled["work"] * 0.6 * 5e6 * 1e-5, rel=1e-9)
    with pytest.warns(UserWarning, match="unusually fast"):
        ss.optimal(t_f=0.2, a=0.018, b=0.03, v_i=3e-5, v_f=2e6, units="si", **scales | dict(v_0=1e-5))


def test_without_the_velocity_bound():
    with_bound = ss.optimal(**PAPER | dict(t_f=0.2))
    without = ss.optimal(**PAPER | dict(t_f=0.2), velocity_bound=False)
    assert with_bound["time_at_floor"] > 0 and without["work"] < with_bound["work"]


def test_an_axis_of_the_grid_takes_the_place_of_its_default():
    table = ss.optimal(**PAPER, grid=dict(v_ceiling=[np.inf, 5000.0, 3000.0]))
    assert table.shape == (3,) and table["work"][0] == ss.optimal(**PAPER)["work"] < table["work"][2]
    with pytest.raises(ValueError, match="v_ceiling: an argument and an axis of `grid`"):
        ss.optimal(**PAPER, v_ceiling=3000.0, grid=dict(v_ceiling=[5000.0]))


def test_every_axis_of_words_takes_words():
    for name, definition in DEFINITIONS.items():
        for axis in definition["axes"]:
            for word in axis["words"]:
                given = arguments(name)
                if axis["name"] == "law" and name in ("optimal", "gap", "best_cubic"):
                    given["v_ceiling"] = 5000.0
                one = getattr(ss, name)(**given, **{axis["name"]: word})
                many = getattr(ss, name)(**given, **{axis["name"]: np.array([word, word])})
                assert one[axis["name"]] == word and list(many[axis["name"]]) == [word, word]
            if axis["is_tacit"]:
                assert axis["name"] not in getattr(ss, name)(**arguments(name)).columns
