"""Specs, runs, datasets, traces and the command."""

import os
import re
import shutil
import subprocess
import sys
import tomllib

import numpy as np
import polars as pl
import pyarrow.parquet as pq
import pytest
from conftest import DEFINITIONS, PAPER, SPEC, command
from test_tables import same

import slipsweep as ss
from slipsweep import _toml

GRID = dict(alpha_2=np.linspace(-0.5, 0.5, 11), alpha_3=np.linspace(-0.5, 0.5, 21))


def test_functions_give_the_bits_of_the_command(dataset):
    t_f, v_f = np.array([0.02, 0.037, 0.049]), np.array([50.0, 100.0])
    changes = dict(a=0.03, b=0.05, v_i=3.0)
    tables = {
        "gap": ss.gap(**changes, grid=dict(t_f=t_f, v_f=v_f) | GRID, unit="1/t_f"),
        "optimal": ss.optimal(**changes, t_f=t_f[:, None], v_f=v_f),
        "best_cubic": ss.best_cubic(**changes, t_f=t_f[:, None], v_f=v_f),
        "crossover": ss.crossover(**changes, v_f=v_f),
        "shortcut": ss.shortcut(**changes, t_f=t_f[:, None], v_f=v_f),
        "stability": ss.stability(**changes, v_f=v_f),
    }
    for name, table in tables.items():
        read = dataset[name]
        assert read.columns == table.columns and read.units == table.units and len(read) == len(table)
        for column in table.columns:
            assert same(table._flat(column), read[column]), (name, column)
        in_memory = ss.Sweep(tomllib.loads(SPEC))[name]
        for column in table.columns:
            assert same(in_memory[column], read[column]), (name, column)


# Values of every axis.
VALUES = {
    "t_f": [0.02, 0.037],
    "theta": [0.1, 0.2],
    "t_left": [0.01, 1.0],
    "a": [0.03],
    "b": [0.05, 0.02],
    "v_i": [3.0],
    "v_f": [100.0, 2.0],
    "v_ceiling": [np.inf, 5000.0],
    "tau_ceiling": [np.inf, 2.0],
    "alpha_2": [-0.12, 0.0],
    "alpha_3": [-0.066, 0.0],
    "law_eps": [0.0, 0.5],
    "k": [10.0, np.inf],
    "m": [0.0, 1e-6],
    "dt": [0.0, 1e-4],
    "delta_t": [1e-3],
}


# The laws of slip and of Perrin, Rice and Zheng need a velocity ceiling and have no friction ceiling.
CEILINGS = {"v_ceiling": [200.0, 5000.0]}
GRIDS = [(name, CEILINGS if name in ("gap", "best_cubic") else {}) for name in DEFINITIONS if name not in ("optimal", "stability")]
# The law is a word or an interpolation.
GRIDS += [("stability", {"law_eps": []}), ("stability", {"law": []})]
GRIDS += [("optimal", {"law": ["ageing"]}), ("optimal", {"v_ceiling": [200.0, 5000.0], "tau_ceiling": [np.inf]})]


@pytest.mark.parametrize("name, changes", GRIDS)
def test_every_column_has_the_bits_of_the_command(name, changes, tmp_path):
    definition = DEFINITIONS[name]
    axes = {axis["name"]: axis["words"] or VALUES[axis["name"]] for axis in definition["axes"]} | changes
    axes = {axis: values for axis, values in axes.items() if len(values)}
    columns = [column["name"] for column in definition["columns"]]
    spec = {"name": "all", "axes": axes, "tables": {name: {"columns": columns}}}
    (tmp_path / "all.toml").write_text(_toml.text(spec))
    command("run", "all.toml", "--quiet", cwd=tmp_path)
    read = pq.read_table(tmp_path / "results/all" / name)
    table = getattr(ss, name)(grid=axes, columns=columns)
    assert table.columns == read.column_names and len(table) == read.num_rows == np.prod([len(values) for values in axes.values()])
    for column in table.columns:
        cells = read[column].to_pandas().to_numpy(dtype=float if column in table.units else object)
        cells = cells if column in table.units else [cell if isinstance(cell, (str, bool)) else None for cell in cells]
        assert same(table._flat(column), cells), column
    assert "ok" in table["status"]


def test_tables_of_a_dataset(dataset):
    assert list(dataset) == ["gap", "optimal", "best_cubic", "crossover", "shortcut", "stability"]
    scanned = dataset["gap"].scan().filter(pl.col("status") == "ok").select(pl.col("gap").min()).collect().item()
    gap = dataset["gap"]["gap"]
    assert scanned == np.nanmin(np.where(dataset["gap"]["status"] == "ok", gap, np.nan))
    data = dataset["optimal"].to_xarray()
    assert dict(data.sizes) == {"t_f": 3, "v_f": 2} and data["work"].attrs["units"] == "mu_0 sigma l"
    assert dataset["optimal"].to_pandas()["work"].tolist() == dataset["optimal"]["work"].tolist()
    assert pl.DataFrame(dataset["optimal"]).height == 6
    with pytest.raises(KeyError, match="no table `gaps`; expected gap"):
        dataset["gaps"]


def test_summary_and_plot_are_those_of_the_command(dataset, folder, tmp_path):
    assert dataset.summary() == command("summary", folder / "results/small").stdout
    command("plot", folder / "results/small", "--table", "gap", "--where", "t_f=0.02, v_f=100", "--out", tmp_path / "gap.svg")
    assert dataset.plot("gap", where="t_f=0.02, v_f=100") == (tmp_path / "gap.svg").read_text()
    assert dataset["optimal"]._repr_html_().startswith("<svg")
    with pytest.raises(ValueError, match="which table"):
        dataset.plot()
    with pytest.raises(ValueError, match="no axis|unknown|has no"):
        dataset.plot("optimal", x="bogus")
    assert "<th>table</th>" in dataset._repr_html_() and "optimal: the protocol of least work; 6 rows" in repr(dataset)


def test_verify_solves_again(dataset):
    audit = dataset.verify(sample=5)
    assert audit.errors == 0 and any(line.split()[:3] == ["optimal", "5", "1e-10"] for line in audit.splitlines())
    assert audit == command("verify", dataset.path, "--sample", 5).stdout


def test_dicts_and_files_are_the_same_sweep(tmp_path):
    (tmp_path / "small.toml").write_text(SPEC)
    file, spec = ss.Sweep(tmp_path / "small.toml"), ss.Sweep(tomllib.loads(SPEC))
    assert file.tables == spec.tables == {"gap": 1386, "optimal": 6, "best_cubic": 6, "crossover": 2, "shortcut": 24, "stability": 2}
    one, other = ss.run(file, tmp_path / "file"), ss.run(tomllib.loads(SPEC), tmp_path / "dict")
    assert [one.spec, other.spec] == [file.text, spec.text]
    for name in one:
        assert pl.DataFrame(one[name]).equals(pl.DataFrame(other[name]))
    arrays = ss.Sweep({"name": "arrays", "axes": dict(PAPER, t_f=np.array([0.02, 0.03]), v_f=np.float64(100)), "tables": {"optimal": {}}})
    assert arrays["optimal"]["work"][0] == ss.optimal(**PAPER)["work"]


WRONG = {
    "axis": ({"axes": {**PAPER, "v_g": 3.0}}, "v_g"),
    "value": ({"axes": {**PAPER, "v_i": 0.5}}, "axes.v_i: 0.5 is out of range"),
    "table": ({"tables": {"optimum": {}}}, "tables.optimum: unknown table `optimum`"),
    "key": ({"table_s": {}}, "table_s: unknown key `table_s`"),
    "type": ({"axes": {**PAPER, "v_i": True}}, "axes.v_i: found true"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_specs_have_the_message_of_the_command(case, tmp_path, monkeypatch):
    change, message = WRONG[case]
    spec = {"name": "wrong", "axes": dict(PAPER), "tables": {"optimal": {}}} | change
    with pytest.raises(ValueError) as caught:
        ss.Sweep(spec)
    assert message in str(caught.value)
    (tmp_path / "wrong.toml").write_text(_toml.text(spec))
    said = command("run", "wrong.toml", cwd=tmp_path, check=False)
    assert said.returncode == 1
    # A file has lines; a dict has none.
    assert re.sub(r"wrong\.toml:\d+: ", "", said.stderr).strip() == f"error: {caught.value}"
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError) as caught:
        ss.Sweep("wrong.toml")
    assert said.stderr.strip() == f"error: {caught.value}"


def test_a_missing_file_suggests_another(tmp_path):
    (tmp_path / "granite.toml").write_text(SPEC)
    with pytest.raises(ValueError, match="did you mean"):
        ss.run(tmp_path / "granit.toml")
    with pytest.raises(ValueError, match="no such file|dataset"):
        ss.open(tmp_path / "nothing")


def test_plan(tmp_path):
    plan = ss.Sweep(tomllib.loads(SPEC)).plan(tmp_path)
    assert "1,386" in plan and "time on one thread" in plan and repr(plan) == plan


def test_another_spec_in_the_same_folder_is_refused(tmp_path):
    spec = {"name": "one", "axes": dict(PAPER), "tables": {"optimal": {}}}
    ss.run(spec, tmp_path)
    with pytest.raises(ValueError, match="holds a dataset of another spec"):
        ss.run(spec | {"axes": dict(PAPER, v_f=50.0)}, tmp_path)


def test_traces_from_a_state_and_after_a_disturbance():
    law = dict(a=0.03, b=0.05, v_f=100.0)
    start = ss.feedback(**law, theta=0.3, t_left=0.015)
    assert ss.trace("optimal", **law, theta=0.3, t_left=0.015).facts["work"] == pytest.approx(start["work_to_go"], rel=1e-9)
    closed, opened = (ss.trace("optimal", **PAPER, disturb="theta=+10% at 0.25", loop=loop) for loop in ("closed", "open"))
    assert closed["v"].tolist() != opened["v"].tolist()


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: ss.trace("optimum", **PAPER), 'unknown protocol "optimum"\n  expected: optimal, best_cubic'),
        (lambda: ss.trace("optimal", **PAPER | dict(t_f=[0.02, 0.03])), "t_f: found list\n  expected: a number"),
        (lambda: ss.trace("optimal", **PAPER, points=1), "invalid value '1' for '--points <N>': expected a whole number from 2 to 10000000"),
        (lambda: ss.run({"name": "x", "axes": PAPER, "tables": {"optimal": {}}}, threads=0), "threads: 0 is out of range"),
        (lambda: ss.run({"name": "x", "axes": PAPER, "tables": {"optimal": {}}}, threads=1025), "threads: 1025 is out of range"),
    ],
)
def test_wrong_arguments(call, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError) as caught:
        call()
    assert str(caught.value).startswith(message) and "--help" not in str(caught.value)
    with pytest.raises(TypeError, match="unexpected keyword argument 'tf'; expected t_f"):
        ss.trace("optimal", tf=0.02)


def test_progress_is_called(tmp_path):
    calls = []
    axes = dict(PAPER, t_f={"geomspace": [0.01, 0.1, 300_000]})
    ss.run({"name": "some", "axes": axes, "tables": {"optimal": {}}}, tmp_path, progress=lambda *call: calls.append(call))
    assert calls and all(phase in ("checking", "computing", "writing") and done <= rows == 300_000 for phase, done, rows in calls)


def test_terminals_show_a_line_that_disappears(tmp_path, capfd):
    axes = dict(PAPER, t_f={"geomspace": [0.01, 0.1, 300_000]})
    spec = {"name": "some", "axes": axes, "tables": {"optimal": {}}}
    ss.run(spec, tmp_path / "shown", progress=True)
    lines = capfd.readouterr().err.split("\r\x1b[K")
    assert any(re.fullmatch(r"some: \d+% of 300,000 rows", line) for line in lines) and lines[-1] == ""
    ss.run(spec, tmp_path / "hidden", progress=False)
    assert capfd.readouterr().err == ""


def test_traces_are_those_of_the_command(tmp_path, dataset):
    trace = ss.trace("optimal", **PAPER, points=11)
    flags = [word for name, value in PAPER.items() for word in (f"--{name.replace('_', '-')}", value)]
    command("trace", "optimal", *flags, "--points", 11, "--out", "optimal.csv", cwd=tmp_path)
    read = pl.read_csv(tmp_path / "optimal.csv", comment_prefix="#")
    assert trace.columns == read.columns == ["t", "v", "theta", "tau", "beta"]
    for name in read.columns:
        assert same(trace[name], read[name].to_numpy())
    assert f"# work = {trace.facts['work']!r}\n" in (tmp_path / "optimal.csv").read_text()
    assert trace.facts["work"] == pytest.approx(ss.optimal(**PAPER)["work"], rel=1e-10) and trace.facts["status"] == "ok"
    command("plot", "optimal.csv", "--out", "optimal.svg", cwd=tmp_path)
    assert trace.plot() == trace._repr_html_() == (tmp_path / "optimal.svg").read_text()
    both = trace.plot(ss.trace("best_cubic", **PAPER))
    assert both.startswith("<svg") and both != trace.plot()
    assert trace.plot(x="v", y="tau") != trace.plot(x="v")
    with pytest.raises(ValueError, match="no column `bogus`"):
        trace.plot(x="bogus")
    assert dataset["optimal"].trace(row=1).facts["row"] == 1
    assert trace.to_xarray()["v"].attrs["units"] == "v_0"
    with pytest.raises(ValueError, match="`optimal` needs --v-f"):
        ss.trace("optimal", t_f=0.02, a=0.03, b=0.05, v_i=3.0)
    with pytest.raises(ValueError, match="no `optimal` protocol|too short"):
        ss.trace("optimal", **PAPER | dict(v_i=100.0, v_f=3.0, t_f=1e-6))


def test_every_protocol_has_a_trace():
    from slipsweep import _core

    more = {"gap": dict(alpha_2=-0.12, alpha_3=-0.066), "regularised": dict(delta_t=1e-3, k=10.0, m=1e-6)}
    more |= {"compliant": dict(k=10.0, m=1e-6), "step_response": dict(k=10.0, m=1e-6)}
    for name, _ in _core.protocols():
        assert len(ss.trace(name, **PAPER, **more.get(name, {}))) > 2, name


def test_the_command_is_on_the_path(folder):
    program = shutil.which("slipsweep", path=os.path.dirname(sys.executable))
    version = subprocess.run([program, "--version"], capture_output=True, text=True)
    assert version.stdout == f"slipsweep {ss.__version__}\n"
    head = command("head", folder / "results/small", "optimal", "-n", 2).stdout
    assert head.startswith("optimal: the protocol of least work; 6 rows\n") and "mu_0 sigma l" in head
    refused = command("query", folder / "results/small", "SELECT 1", check=False)
    assert refused.returncode == 1 and "`query` is not in the Python package" in refused.stderr
    assert "query" not in command("--help").stdout.split("Options")[0].split("Commands")[1]
    assert set(DEFINITIONS) <= set(re.findall(r"^(\w+)", command("tables").stdout, re.MULTILINE))
