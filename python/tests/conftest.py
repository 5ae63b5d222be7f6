"""Common arguments, datasets and the command."""

import subprocess
import sys
from pathlib import Path

import pytest

import slipsweep as ss
from slipsweep import _core

# The paper's material and velocities.
PAPER = dict(t_f=0.02, a=0.03, b=0.05, v_i=3.0, v_f=100.0)

# A legal value of every axis that has no default.
VALUES = PAPER | dict(alpha_2=-0.12, alpha_3=-0.066, delta_t=1e-3, theta=0.1, t_left=0.01)

DEFINITIONS = {definition["name"]: definition for definition in _core.tables()}

# Axes that expensive tables need for an interesting row.
SPRING = dict(k=10.0, m=1e-6)


def arguments(name):
    """Arguments of the function of a table."""
    axes = DEFINITIONS[name]["axes"]
    known = VALUES | SPRING
    return {axis["name"]: known[axis["name"]] for axis in axes if axis["name"] in known}


def command(*words, cwd=None, check=True):
    """Runs the command, and returns what it prints."""
    done = subprocess.run([sys.executable, "-m", "slipsweep", *map(str, words)], cwd=cwd, capture_output=True, text=True)
    if check:
        assert done.returncode == 0, done.stderr
    return done


SPEC = """name = "small"
[axes]
t_f = [0.02, 0.037, 0.049]
a = 0.03
b = 0.05
v_i = 3.0
v_f = [50.0, 100.0]
alpha_2 = { linspace = [-0.5, 0.5, 11], unit = "1/t_f" }
alpha_3 = { linspace = [-0.5, 0.5, 21], unit = "1/t_f^2" }
[tables.gap]
[tables.optimal]
[tables.best_cubic]
[tables.crossover]
[tables.shortcut]
[tables.stability]
"""


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """A folder with the spec `small.toml` and its dataset, which the command made."""
    folder = tmp_path_factory.mktemp("command")
    Path(folder, "small.toml").write_text(SPEC)
    command("run", "small.toml", "--quiet", cwd=folder)
    return folder


@pytest.fixture(scope="session")
def dataset(folder):
    return ss.open(folder / "results/small")
