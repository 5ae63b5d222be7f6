"""Rows as a labelled xarray Dataset."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._core import __version__

if TYPE_CHECKING:
    import xarray as xr

    from ._table import Columns, Field


def dataset(rows: "Columns") -> "xr.Dataset":
    """The axes that vary as dimensions with coordinates, the others as scalar coordinates."""
    import xarray as xr

    fields = rows.fields
    cells = {field.name: rows._flat(field.name) for field in fields}
    attributes = {field.name: _attributes(field) for field in fields}
    # Only axes and the status have no missing cells.
    axes = [field.name for field in fields if not field.is_nullable and field.name != "status"]
    results = [field.name for field in fields if field.name not in axes]
    steps = {name: _steps(cells[name]) for name in axes}
    varying = [name for name in axes if len(steps[name][0]) != 1]
    scalars: dict[str, Any] = {name: ((), cells[name][0], attributes[name]) for name in axes if name not in varying}
    shape = tuple(len(steps[name][0]) for name in varying)
    order = _order([steps[name][1] for name in varying], shape, len(rows))
    coordinates: dict[str, Any]
    data: dict[str, Any]
    if order is None:
        coordinates = {name: ("row", cells[name], attributes[name]) for name in varying} | scalars
        data = {name: ("row", cells[name], attributes[name]) for name in results}
    else:
        coordinates = {name: (name, steps[name][0], attributes[name]) for name in varying} | scalars
        data = {name: (varying, cells[name][order].reshape(shape), attributes[name]) for name in results}
    return xr.Dataset(data, coordinates, {"table": rows.name, "version": __version__})


def _attributes(field: "Field") -> dict[str, str]:
    """Attributes as the CF conventions name them."""
    attributes = {"units": field.unit, "long_name": field.description}
    return {key: value for key, value in attributes.items() if value}


def _steps(values: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], npt.NDArray[np.intp]]:
    """The different values in the order in which they come, and the place of each row among them."""
    distinct, first, place = np.unique(values, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return distinct[order], rank[place]


def _order(places: list[npt.NDArray[np.intp]], shape: tuple[int, ...], rows: int) -> npt.NDArray[np.intp] | None:
    """The row at each point of the product of the axes; `None` if the rows are not that product."""
    if int(np.prod(shape)) != rows:
        return None
    flat = np.ravel_multi_index(places, shape) if shape else np.zeros(rows, dtype=np.intp)
    order = np.full(rows, -1, dtype=np.intp)
    order[flat] = np.arange(rows)
    return None if (order < 0).any() else order
