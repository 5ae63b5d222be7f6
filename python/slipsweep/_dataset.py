"""Datasets on disk."""

import html
import os
import warnings
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from . import _core
from ._table import Columns, Picture, Text, plot_arguments
from ._trace import Trace, of_arguments

if TYPE_CHECKING:
    import polars as pl


class Audit(Text):
    """What `slipsweep verify` prints; `errors` counts the numbers that differ by more than 10 rtol."""

    errors: int = 0


class DatasetTable(Columns):
    """A table of a dataset. Its rows are read when they are first used; `scan` reads only what a question needs."""

    def __init__(self, dataset: "Dataset", name: str, doc: str) -> None:
        self.dataset, self.name, self.doc = dataset, name, doc
        self.__rows: _core.Rows | None = None

    @property
    def paths(self) -> list[str]:
        """The Parquet files of the table."""
        paths, missing = self.dataset._dataset.parts(self.name)
        if missing:
            warnings.warn(f"{self.name}: {missing} parts are missing; running the spec computes them", stacklevel=2)
        return [os.fspath(path) for path in paths]

    @property
    def _rows(self) -> _core.Rows:
        if self.__rows is None:
            self.__rows = self.dataset._dataset.rows(self.name)
        return self.__rows

    @property
    def shape(self) -> tuple[int, ...]:  # type: ignore[override]  # pyright: ignore[reportIncompatibleVariableOverride]
        """The number of rows."""
        return (len(self),)

    def scan(self) -> "pl.LazyFrame":
        """A polars LazyFrame, which reads only the columns and row groups of a question."""
        import polars as pl

        return pl.scan_parquet(self.paths)

    def trace(self, row: int, *, points: int | None = None) -> Trace:
        """The protocol of a row over time."""
        arguments = [self.dataset.path, self.name, "--row", str(row)]
        return of_arguments(arguments, self.name, points)

    def plot(
        self,
        *,
        where: str | list[str] | None = None,
        x: str | None = None,
        y: str | None = None,
        color: str | None = None,
        width: float | None = None,
    ) -> Picture:
        """The picture that `slipsweep plot` draws of this table. Its options have the same names."""
        return Picture(self.dataset._dataset.plot(self.name, plot_arguments(where, x, y, color, width)))

    def _repr_html_(self) -> str:
        try:
            return str(self.plot())
        except ValueError:
            return super()._repr_html_()


class Dataset(Mapping[str, DatasetTable]):
    """A dataset on disk: a mapping of names to tables."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = os.fspath(path)
        self._dataset = _core.Dataset.open(path)
        self._tables = {name: DatasetTable(self, name, doc) for name, doc, _ in self._dataset.tables}

    @property
    def name(self) -> str:
        """The name of the dataset."""
        return self._dataset.name

    @property
    def version(self) -> str:
        """The version of slipsweep that made it."""
        return self._dataset.version

    @property
    def spec(self) -> str:
        """The spec that it was made from, in TOML."""
        return self._dataset.spec

    def __getitem__(self, table: str) -> DatasetTable:
        if table not in self._tables:
            raise KeyError(f"{self.path}: no table `{table}`; expected {', '.join(self._tables)}")
        return self._tables[table]

    def __iter__(self) -> Iterator[str]:
        return iter(self._tables)

    def __len__(self) -> int:
        return len(self._tables)

    def summary(self) -> Text:
        """What `slipsweep summary` prints: rows by status, ranges of the columns, least gaps."""
        return Text(self._dataset.summary())

    def verify(self, sample: int = 100, seed: int = 0) -> Audit:
        """Solves a sample of rows of every table by an independent method: what `slipsweep verify` prints."""
        text, errors = self._dataset.verify(sample, seed)
        audit = Audit(text)
        audit.errors = errors
        return audit

    def plot(
        self,
        table: str | None = None,
        *,
        where: str | list[str] | None = None,
        x: str | None = None,
        y: str | None = None,
        color: str | None = None,
        width: float | None = None,
    ) -> Picture:
        """The picture of a table, of the only one by default."""
        if table is None and len(self) > 1:
            raise ValueError(f"which table?\n  expected: one of {', '.join(self)}\n  help: plot({next(iter(self))!r})")
        name = next(iter(self)) if table is None else table
        return self[name].plot(where=where, x=x, y=y, color=color, width=width)

    def __repr__(self) -> str:
        lines = [f"  {name}: {doc}; {rows:,} rows" for name, doc, rows in self._dataset.tables]
        return "\n".join([f"{self.path}: dataset {self.name}, made by slipsweep {self.version}", *lines])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{rows:,}</td><td>{html.escape(doc)}</td></tr>"
            for name, doc, rows in self._dataset.tables
        )
        head = "<tr><th>table</th><th>rows</th><th>a row is</th></tr>"
        return f"<p>{html.escape(self.path)}</p><table><thead>{head}</thead><tbody>{rows}</tbody></table>"


def open(path: str | os.PathLike[str]) -> Dataset:
    """The dataset in a folder that `run` or `slipsweep run` wrote, such as `results/granite`."""
    return Dataset(path)
