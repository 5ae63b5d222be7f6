"""The package: stubs, import time and documentation."""

import subprocess
import sys

import slipsweep as ss


def test_stubs_are_current():
    subprocess.run([sys.executable, "-m", "slipsweep._stubs", "--check"], check=True)


def test_the_import_brings_no_library_but_numpy():
    code = "import sys, slipsweep; print(sorted({'pandas', 'polars', 'pyarrow', 'xarray', 'IPython', 'matplotlib'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_all_names_exist():
    assert all(hasattr(ss, name) for name in ss.__all__) and "optimal" in ss.__all__


def test_help_shows_units_and_ranges():
    text = subprocess.run(
        [sys.executable, "-c", "import slipsweep; help(slipsweep.optimal)"], capture_output=True, text=True, check=True
    ).stdout
    assert "t_f : array_like, in l/v_0" in text and "1e-20 <= t_f <= 1e20" in text and "work, in mu_0 sigma l" in text
