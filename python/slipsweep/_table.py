"""Rows of a table: NumPy columns, Arrow, pandas, polars and xarray."""

import html
import os
import tempfile
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _core

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa
    import xarray as xr

# Rows that a table shows of itself.
SHOWN_ROWS = 10


class Field(NamedTuple):
    """A column: its name, unit, meaning, type (`number`, `word` or `flag`), and whether cells may be missing."""

    name: str
    unit: str
    description: str
    kind: str
    is_nullable: bool


class Text(str):
    """A text that shows its lines."""

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self)}</pre>"


class Picture(str):
    """A picture: the text of its SVG."""

    def __repr__(self) -> str:
        return f"<Picture, {len(self)} bytes of SVG>"

    def _repr_svg_(self) -> str:
        return str(self)

    def save(self, path: str | os.PathLike[str], *, dpi: float = 300) -> None:
        """Writes the picture to a file that ends in .svg, .png or .pdf; `dpi` is for .png."""
        data = _core.picture(str(self), os.fspath(path), dpi)
        with open(path, "wb") as file:
            file.write(data)


class Columns:
    """Columns of equal length: `rows["work"]` is a NumPy array, and polars, pandas, pyarrow and DuckDB read all of them through Arrow."""

    name: str
    shape: tuple[int, ...]

    @property
    def _rows(self) -> _core.Rows:
        raise NotImplementedError

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def fields(self) -> list[Field]:
        """Name, unit, meaning and type of every column."""
        return [Field(*field) for field in self._rows.fields()]

    @property
    def columns(self) -> list[str]:
        """The names of the columns."""
        return [field.name for field in self.fields]

    @property
    def units(self) -> dict[str, str]:
        """The unit of every column of numbers."""
        return {field.name: field.unit for field in self.fields if field.unit}

    @property
    def descriptions(self) -> dict[str, str]:
        """The meaning of every column."""
        return {field.name: field.description for field in self.fields}

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __getitem__(self, column: str) -> Any:
        """The cells of a column in the shape of the arguments, a scalar for scalar arguments. A missing number is NaN, a missing word None.

        Numbers are not copied, so they cannot be changed.
        """
        if not isinstance(column, str):
            raise TypeError(f"columns have names, not {type(column).__name__}: table['work'][0], or table.to_pandas().iloc[0]")
        if self.shape == ():
            only = self._rows.only(column)
            if only is not None:
                return np.float64(only) if isinstance(only, float) else only
        cells = self._flat(column).reshape(self.shape)
        return cells if self.shape else cells[()]

    def _flat(self, column: str) -> npt.NDArray[Any]:
        """The cells of a column, row by row."""
        buffer, words = self._rows.column(column)
        if words is None:
            return _array(buffer, np.float64, len(self))
        places = _array(buffer, np.int32, len(self))
        if words == ["False", "True"]:
            return places.astype(bool) if (places >= 0).all() else np.array([False, True, None])[places]
        cells: npt.NDArray[Any] = np.array([*words, None], dtype=object)[places]
        return cells

    def __arrow_c_schema__(self) -> object:
        return self._rows.__arrow_c_schema__()

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self._rows.__arrow_c_stream__(requested_schema)

    def to_arrow(self) -> "pa.Table":
        """A pyarrow Table, whose fields have the units as metadata."""
        import pyarrow as pa

        return pa.table(self)

    def to_polars(self) -> "pl.DataFrame":
        """A polars DataFrame; its numbers are not copied."""
        import polars as pl

        return pl.DataFrame(self)

    def to_pandas(self) -> "pd.DataFrame":
        """A pandas DataFrame; `attrs` has units and meanings."""
        import pandas as pd

        data: dict[str, Any] = {}
        for field in self.fields:
            if field.kind == "word":
                buffer, words = self._rows.column(field.name)
                data[field.name] = pd.Categorical.from_codes(_array(buffer, np.int32, len(self)), categories=words)
            elif field.kind == "flag" and (flags := self._flat(field.name)).dtype == object:
                data[field.name] = pd.array(flags, dtype="boolean")
            else:
                data[field.name] = self._flat(field.name)
        frame = pd.DataFrame(data)
        frame.attrs = {"units": self.units, "descriptions": self.descriptions}
        return frame

    def to_xarray(self) -> "xr.Dataset":
        """An xarray Dataset: axes that vary are dimensions if the rows are their product, else there is one dimension, `row`.

        Units and meanings are the attributes `units` and `long_name`.
        """
        from ._xarray import dataset

        return dataset(self)

    def _head(self) -> list[list[str]]:
        """Names, units and the first rows."""
        head = Plain(self._rows.head(SHOWN_ROWS))
        fields = self.fields
        cells = [[_shown(cell) for cell in head._flat(field.name)] for field in fields]
        return [[field.name for field in fields], [field.unit for field in fields], *map(list, zip(*cells))]

    def _title(self) -> str:
        rows = len(self)
        return f"{self.name}: {rows:,} {'row' if rows == 1 else 'rows'}"

    def __repr__(self) -> str:
        lines = self._head()
        widths = [max(len(cell) for cell in column) for column in zip(*lines)]
        texts = ["  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip() for line in lines]
        more = ["..."] if len(self) > SHOWN_ROWS else []
        return "\n".join([self._title(), *("  " + text for text in texts + more)])

    def _repr_html_(self) -> str:
        names, units, *rows = self._head()
        head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
        unit = "".join(f"<td><i>{html.escape(unit)}</i></td>" for unit in units)
        body = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
        return (
            f"<p>{html.escape(self._title())}</p><table><thead><tr>{head}</tr><tr>{unit}</tr></thead><tbody>{body}</tbody></table>"
        )


def _array(buffer: _core.Buffer, kind: type[Any], length: int) -> npt.NDArray[Any]:
    # NumPy refuses an empty buffer.
    return np.frombuffer(memoryview(buffer), dtype=kind) if length else np.empty(0, dtype=kind)


def _shown(cell: Any) -> str:
    if isinstance(cell, float):
        return "-" if cell != cell else f"{cell:.9g}"
    return "-" if cell is None else str(cell)


class Plain(Columns):
    """Rows without a name."""

    def __init__(self, rows: _core.Rows) -> None:
        self.__rows = rows
        self.name, self.shape = "rows", (len(rows),)

    @property
    def _rows(self) -> _core.Rows:
        return self.__rows


class Table(Columns):
    """Rows of a table in memory.

    `shape` is that of the arguments after broadcasting, then that of the grid. Rows are in C order. Worker processes can return them; `plot` works
    where they were computed.
    """

    def __init__(self, rows: _core.Rows, name: str, shape: tuple[int, ...]) -> None:
        self.__rows = rows
        self.name = name
        self.shape = shape

    @property
    def _rows(self) -> _core.Rows:
        return self.__rows

    def __reduce__(self) -> tuple[Any, ...]:
        return _from_bytes, (self.__rows.to_bytes(), self.name, self.shape)

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
        with tempfile.TemporaryDirectory() as folder:
            return Picture(self._rows.plot(folder, plot_arguments(where, x, y, color, width)))


def _from_bytes(data: bytes, name: str, shape: tuple[int, ...]) -> Table:
    """The table of `Table.__reduce__`."""
    return Table(_core.Rows.from_bytes(data), name, shape)


def plot_arguments(
    where: str | list[str] | None, x: str | None, y: str | None, color: str | None, width: float | None
) -> tuple[list[str], str | None, str | None, str | None, float | None]:
    """Arguments of a picture as the engine takes them."""
    conditions = [] if where is None else [where] if isinstance(where, str) else list(where)
    return conditions, x, y, color, width
