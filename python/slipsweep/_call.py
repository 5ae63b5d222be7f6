"""Arguments of the functions of tables: broadcast, and passed to the engine."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ._core import compute
from ._table import Table

_Model: TypeAlias = tuple[bool, str, str, float | None, float | None, float | None, float | None]

# Types of a single number or word, or of the default.
_SCALARS = frozenset((float, int, str, np.float64, type(None)))

_DEFAULT_MODEL: _Model = (True, "log", "dimensionless", None, None, None, None)

# The axes of each table, their defaults, and its axes of words with their number, whose default is all words.
_AXES: dict[str, tuple[str, ...]] = {}
_DEFAULTS: dict[str, tuple[object, ...]] = {}
_ALL_WORDS: dict[str, list[tuple[int, str, int]]] = {}


def define(definition: Mapping[str, Any]) -> None:
    """Remembers the axes of a table."""
    axes = definition["axes"]
    _AXES[definition["name"]] = tuple(axis["name"] for axis in axes)
    _DEFAULTS[definition["name"]] = tuple(axis["default"] for axis in axes)
    _ALL_WORDS[definition["name"]] = [
        (place, axis["name"], axis["default_count"])
        for place, axis in enumerate(axes)
        if axis["default_count"] > 1
    ]


def call(
    name: str,
    values: Sequence[object],
    grid: Mapping[str, object] | None,
    unit: str | None,
    columns: Sequence[str] | None,
    rtol: float | None,
    model: _Model,
) -> Table:
    """The rows of the table `name` at these values of its axes."""
    shape: tuple[int, ...] = ()
    for value in values:
        if type(value) not in _SCALARS:
            values, shape = _broadcast(_AXES[name], values)
            break
    product: list[tuple[str, object]] = []
    if grid is not None:
        product, lengths = _product(grid)
        shape += lengths
        # An axis of the grid takes the place of its default.
        axes = zip(_AXES[name], values, _DEFAULTS[name])
        values = [None if axis in grid and type(value) in _SCALARS and value == default else value for axis, value, default in axes]
    for place, axis, count in _ALL_WORDS[name]:
        if values[place] is None and (grid is None or axis not in grid):
            shape += (count,)
    if unit not in (None, "1", "1/t_f"):
        raise ValueError(f'unit: unknown unit "{unit}"\n  expected: "1/t_f" or "1"\n  help: correct the unit, or remove it')
    if isinstance(columns, str):
        columns = [columns]
    rows = compute(name, values, product, (unit == "1/t_f", columns, rtol, None if model == _DEFAULT_MODEL else model))
    return Table(rows, name, shape)


def _broadcast(axes: Sequence[str], values: Sequence[object]) -> tuple[list[object], tuple[int, ...]]:
    """A number, a word, or the flat values of each axis; and their common shape."""
    arrays = [None if value is None else _array(name, value) for name, value in zip(axes, values)]
    given = [(name, array) for name, array in zip(axes, arrays) if array is not None]
    try:
        shape = np.broadcast_shapes(*(array.shape for _, array in given))
    except ValueError:
        found = ", ".join(f"{name} {array.shape}" for name, array in given if array.ndim)
        expected = "shapes that broadcast as in NumPy"
        help = "give axes of a product in grid=dict(...)"
        raise ValueError(f"arguments of different shapes: {found}\n  expected: {expected}\n  help: {help}") from None
    count = math.prod(shape)
    flat: list[object] = []
    for array in arrays:
        if array is None:
            flat.append(None)
        elif array.size == 1:
            flat.append(array.item())
        else:
            whole = array if array.size == count else np.broadcast_to(array, shape)
            flat.append(_values(whole.ravel()))
    return flat, shape


def _product(grid: Mapping[str, object]) -> tuple[list[tuple[str, object]], tuple[int, ...]]:
    """The values of each axis of a product, and their numbers."""
    product: list[tuple[str, object]] = []
    lengths: list[int] = []
    if not isinstance(grid, Mapping):
        raise ValueError(f"grid: found {type(grid).__name__}\n  expected: axes and their values\n  help: grid=dict(alpha_2=[...])")
    for name, values in grid.items():
        array = _array(name, values)
        if array.ndim > 1:
            raise ValueError(f"grid: {name} has the shape {array.shape}\n  expected: one dimension\n  help: flatten it")
        product.append((name, array.item() if array.size == 1 else _values(array)))
        lengths += array.shape
    return product, tuple(lengths)


def _values(flat: npt.NDArray[Any]) -> object:
    return flat.tolist() if flat.dtype == object else np.ascontiguousarray(flat)


def _array(name: str, value: object) -> npt.NDArray[Any]:
    """Doubles, or words as objects."""
    if isinstance(value, np.ma.MaskedArray):
        value = np.ma.filled(value.astype(float), np.nan)
    array = np.asarray(value)
    kind = array.dtype.kind
    if kind == "f" and array.dtype == np.float64:
        return array
    if kind in "fiu":
        return array.astype(np.float64)
    if kind in "UT" or (kind == "O" and array.size and all(isinstance(word, str) for word in array.flat)):
        return array.astype(object)
    if kind == "O":
        try:
            return np.array([math.nan if one is None else float(one) for one in array.flat]).reshape(array.shape)
        except (TypeError, ValueError):
            pass
    raise ValueError(f"{name}: found {array.dtype}\n  expected: numbers\n  help: convert it to numbers")
