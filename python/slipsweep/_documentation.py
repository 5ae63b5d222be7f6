"""What `help` shows of the function of a table."""

from typing import Any

OPTION_DOCS = """grid : mapping of axis to values, optional
    Axes of a product, the last one fastest; they multiply the points of the other arguments.
columns : sequence of str, optional
    The columns to compute; by default all but the optional ones.
rtol : float, optional
    Relative accuracy, 1e-13 <= rtol <= 1e-2; by default {rtol}.
velocity_bound : bool
    Whether optimal protocols obey v >= 1.
friction : 'log' or 'regularised'
    Form of the direct effect; 'regularised' holds down to rest, and needs no floor.
units : 'dimensionless' or 'si'
    'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa."""
UNIT_DOC = """unit : {units}, optional
    Unit of alpha_2 and alpha_3: relative to the duration, 1/t_f and 1/t_f^2, or that of the model."""


def has_scale(definition: dict[str, Any]) -> bool:
    """Whether an axis of the table can be given relative to the duration."""
    return any(len(axis["scales"]) > 1 for axis in definition["axes"])


def _words(axis: dict[str, Any]) -> str:
    default = "all" if axis["default_count"] > 1 else axis["words"][0]
    return f"one of {', '.join(axis['words'])}; by default {default}"


def docstring(definition: dict[str, Any]) -> str:
    """What `help` shows of the function of a table."""
    lines = [f"{definition['doc'][0].upper()}{definition['doc'][1:]}: a row for each point.", ""]
    lines += ["Arguments broadcast as in NumPy. A row that has no answer has a status that states why.", "", "Parameters", "----------"]
    for axis in definition["axes"]:
        unit = f", in {axis['unit']}" if axis["unit"] else ""
        kind = "str or sequence of str" if axis["words"] else "array_like"
        legal = _words(axis) if axis["words"] else axis["range"]
        optional = f", default {axis['default']}" if axis["default"] is not None else ""
        lines += [f"{axis['name']} : {kind}{unit}{optional}", f"    {axis['doc']}; {legal}"]
    if has_scale(definition):
        lines += UNIT_DOC.format(units="'1/t_f' or '1'").splitlines()
    rtol = definition["default_rtol"] or 1e-10
    lines += OPTION_DOCS.format(rtol=rtol).splitlines()
    lines += ["", "Returns", "-------", "Table", "    The axes, and these columns:", ""]
    for column in definition["columns"]:
        unit = f", in {column['unit']}" if column["unit"] else ""
        optional = " (only if `columns` names it)" if column["is_optional"] else ""
        lines += [f"    {column['name']}{unit}{optional}", f"        {column['doc']}"]
    lines += ["    status", "        outcome of the row; a number that does not exist is null"]
    return "\n".join(lines)
