"""Exact optimal protocols, work gaps and parameter sweeps of rate-and-state friction.

Each table has a function: `slipsweep.optimal(t_f=0.02, a=0.03, b=0.05, v_i=3.0, v_f=100.0)` gives rows in memory. `trace` gives one protocol over
time, `Sweep` and `run` compute a spec, `open` opens a dataset. `help(slipsweep.optimal)` shows axes, units, ranges and columns.
"""

from . import _tables
from ._core import __version__
from ._dataset import Audit, Dataset, DatasetTable, open
from ._sweep import Sweep, run
from ._table import Picture, Table, Text
from ._tables import *  # noqa: F403
from ._trace import Trace, trace

__all__ = ["Audit", "Dataset", "DatasetTable", "Picture", "Sweep", "Table", "Text", "Trace", "__version__", "open", "run", "trace"]
__all__ += _tables.__all__
