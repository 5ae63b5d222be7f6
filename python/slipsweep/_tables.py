"""A function for each table, made of the definition of the table."""

from collections.abc import Callable
from typing import Any

from ._call import call, define
from ._core import tables
from ._documentation import docstring, has_scale
from ._table import Table

# What every function takes besides the axes of its table.
OPTIONS = (
    "columns=None, rtol=None, velocity_bound=True, friction='log', units='dimensionless', "
    "mu_0=None, l=None, v_0=None, normal_stress=None"
)


def function(definition: dict[str, Any]) -> Callable[..., Table]:
    """The function of a table."""
    name, axes = definition["name"], [axis["name"] for axis in definition["axes"]]
    given = ", ".join(f"{axis['name']}={_default(axis)}" for axis in definition["axes"])
    unit = ", unit=None" if has_scale(definition) else ""
    source = (
        f"def {name}(*, {given}, grid=None{unit}, {OPTIONS}):\n"
        f"    return call({name!r}, ({', '.join(axes)},), grid, {'unit' if unit else 'None'}, columns, rtol,\n"
        f"                (velocity_bound, friction, units, mu_0, l, v_0, normal_stress))\n"
    )
    space: dict[str, Any] = {"call": call, "inf": float("inf")}
    exec(source, space)
    made: Callable[..., Table] = space[name]
    made.__doc__ = docstring(definition)
    made.__module__ = "slipsweep"
    return made


def _default(axis: dict[str, Any]) -> str:
    return repr(axis["default"])


__all__ = []
for _definition in tables():
    define(_definition)
    globals()[_definition["name"]] = function(_definition)
    __all__.append(_definition["name"])
