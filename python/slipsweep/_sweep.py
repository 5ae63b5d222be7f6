"""Specs: checked, planned and run."""

import os
import warnings
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from . import _core, _toml
from ._dataset import Dataset, open
from ._progress import display
from ._table import Table, Text

Spec: TypeAlias = Mapping[str, Any] | str | os.PathLike[str]
# Threads of a run; the limit of the command.
MAX_THREADS = 1024

Progress: TypeAlias = bool | Callable[[str, int, int], object] | None


class Sweep:
    """A checked spec: a dict with the keys of the TOML file, or the path of that file.

    A wrong spec raises `ValueError` with the message of the command line.
    """

    def __init__(self, spec: Spec) -> None:
        if isinstance(spec, Mapping):
            self._sweep = _core.Sweep.parse(_toml.text(spec), os.curdir)
        else:
            self._sweep = _core.Sweep.load(spec)
        for text in self._sweep.warnings:
            warnings.warn(text, stacklevel=2)

    @property
    def name(self) -> str:
        """The name of the dataset."""
        return self._sweep.name

    @property
    def description(self) -> str:
        """The description of the sweep."""
        return self._sweep.description

    @property
    def text(self) -> str:
        """The spec in TOML."""
        return self._sweep.text

    @property
    def tables(self) -> dict[str, int]:
        """The rows of every table."""
        return dict(self._sweep.tables)

    def plan(self, out: str | os.PathLike[str] = "results") -> Text:
        """Rows, solves, time and size, from a small sample: what `slipsweep plan` prints."""
        return Text(self._sweep.plan(out))

    def __getitem__(self, table: str) -> Table:
        """The rows of a table in memory, computed now."""
        rows = self._sweep.rows(table)
        return Table(rows, table, (len(rows),))

    def run(
        self, out: str | os.PathLike[str] = "results", *, threads: int | None = None, progress: Progress = None
    ) -> Dataset:
        """Computes what is missing of the dataset `out/NAME`, and opens it.

        Ctrl-C raises `KeyboardInterrupt` and keeps finished parts; the same call continues. `progress` is True, False or a function of the phase,
        the rows done and all rows; by default terminals and notebooks show it after half a second.
        """
        if threads is not None and not 1 <= threads <= MAX_THREADS:
            raise ValueError(f"threads: {threads} is out of range\n  expected: 1 <= threads <= {MAX_THREADS}\n  help: leave it out")
        if callable(progress):
            return open(self._sweep.run(out, threads or 0, progress))
        shown, is_done = display(self.name, sum(self.tables.values()), progress), False
        try:
            path = self._sweep.run(out, threads or 0, shown)
            is_done = True
        finally:
            if shown is not None:
                shown.close(is_done)
        return open(path)

    def __repr__(self) -> str:
        rows = ", ".join(f"{table}: {rows:,} rows" for table, rows in self.tables.items())
        return f"<Sweep {self.name}; {rows}>"

    def _repr_html_(self) -> str:
        return Text(f"{self!r}\n\n{self.text}")._repr_html_()


def run(
    spec: Spec | Sweep,
    out: str | os.PathLike[str] = "results",
    *,
    threads: int | None = None,
    progress: Progress = None,
) -> Dataset:
    """Runs a spec: a dict, the path of a TOML file, or a `Sweep`. See `Sweep.run`."""
    sweep = spec if isinstance(spec, Sweep) else Sweep(spec)
    return sweep.run(out, threads=threads, progress=progress)
