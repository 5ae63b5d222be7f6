"""A table of slipsweep as a labelled xarray Dataset, in one call.

    import slipsweep_dataset
    gap = slipsweep_dataset.open("results/landscape", "gap")

The axes that vary are dimensions with coordinates, those that do not are scalar coordinates. Units and meanings are attributes of the
variables, the spec that the table was made from is an attribute of the Dataset. If the points are no grid (a `zip`, a file of points,
samples), there is one dimension, `row`.
"""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import xarray as xr

# The quantities that can be axes, in the order of their columns.
AXES = ["t_f", "theta", "t_left", "a", "b", "v_i", "v_f", "family", "v_ceiling", "tau_ceiling", "alpha_2", "alpha_3", "k", "m", "dt", "delta_t"]


# The program that a clone of the repository builds.
BUILT = Path(__file__).resolve().parents[2] / "target/release/slipsweep"


def make(question, folder="results"):
    """Makes the dataset `QUESTION` in `folder` from the spec of `slipsweep init --question`, as far as it is missing."""
    folder = Path(folder)
    program = shutil.which("slipsweep") or shutil.which(BUILT)
    if program is None:
        raise FileNotFoundError(f"no program slipsweep on the path, nor {BUILT}: `cargo build --release` in the clone builds it")
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / f"{question}.toml").exists():
        _run([program, "init", question, "--question", question], folder)
    _run([program, "run", f"{question}.toml", "--out", ".", "--quiet"], folder)


def _run(command, folder):
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} ended with exit code {done.returncode}\n{done.stderr}")


def open(dataset, table):
    """The table `table` of the dataset in the folder `dataset`."""
    folder = Path(dataset)
    manifest = json.loads((folder / "manifest.json").read_text())
    parts = sorted((folder / table).glob("*.parquet"))
    if not parts:
        raise FileNotFoundError(f"{folder / table}: no part of this table; `slipsweep run` makes what is missing")
    rows = pq.ParquetDataset([str(part) for part in parts]).read()

    columns = {name: _values(rows[name]) for name in rows.column_names}
    attributes = {field.name: _attributes(field) for field in rows.schema}
    # Axis columns come first; `best_cubic` has results of the same names as axes, which stand after.
    axes = []
    for name in rows.column_names:
        if name not in AXES or (axes and AXES.index(name) <= AXES.index(axes[-1])) or rows.schema.field(name).nullable:
            break
        axes.append(name)

    # The values of each axis in the order in which they come, and where each row has its own among them.
    steps = {name: _steps(columns[name]) for name in axes}
    varying = [name for name in axes if len(steps[name][0]) > 1]
    shape = tuple(len(steps[name][0]) for name in varying)
    places = tuple(steps[name][1] for name in varying)
    flat = np.ravel_multi_index(places, shape) if varying else np.zeros(rows.num_rows, dtype=int)
    is_grid = len(np.unique(flat)) == rows.num_rows == np.prod(shape, dtype=int)
    if not is_grid:
        varying_rows = {name: ("row", columns[name], attributes[name]) for name in varying}
        coordinates = varying_rows | _scalars(axes, varying, columns, attributes)
        data = {name: ("row", columns[name], attributes[name]) for name in columns if name not in axes}
    else:
        order = np.empty(rows.num_rows, dtype=int)
        order[flat] = np.arange(rows.num_rows)
        grid = {name: (name, steps[name][0], attributes[name]) for name in varying}
        coordinates = grid | _scalars(axes, varying, columns, attributes)
        data = {
            name: (varying, columns[name][order].reshape(shape), attributes[name]) for name in columns if name not in axes
        }
    about = {"name": manifest["name"], "table": table, "version": manifest["version"], "spec": manifest["spec"]}
    return xr.Dataset(data, coordinates, about)


def _scalars(axes, varying, columns, attributes):
    return {name: ((), columns[name][0], attributes[name]) for name in axes if name not in varying}


def _values(column):
    """Numbers with NaN, words and flags with None, where there is nothing."""
    array = column.combine_chunks()
    if hasattr(array, "dictionary_decode"):
        array = array.dictionary_decode()
    return array.to_numpy(zero_copy_only=False)


def _steps(values):
    distinct, first, place = np.unique(values, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return distinct[order], rank[place]


def _attributes(field):
    metadata = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
    attributes = {"units": metadata.get("unit", ""), "long_name": metadata.get("description", "")}
    return {key: value for key, value in attributes.items() if value}
