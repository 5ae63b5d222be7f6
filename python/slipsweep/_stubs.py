"""`python -m slipsweep._stubs` writes `_tables.pyi`, the types of the functions of tables; with `--check` it fails if that file is not current."""

import sys
from pathlib import Path
from typing import Any

from ._core import tables
from ._documentation import has_scale

HEAD = '''"""A function for each table. Written by `python -m slipsweep._stubs`."""

from collections.abc import Sequence
from typing import Literal

from ._table import Table
from ._types import Grid, Values

__all__ = [{names}]
'''

OPTIONS = """    columns: Sequence[Literal[{columns}]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    friction: Literal["log", "regularised"] = "log",
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table: ...
"""


def stub() -> str:
    """The text of the file."""
    definitions = tables()
    return HEAD.format(names=_quoted(definitions)) + "".join(map(_function, definitions))


def _quoted(definitions: list[dict[str, Any]]) -> str:
    return ", ".join(f'"{definition["name"]}"' for definition in definitions)


def _function(definition: dict[str, Any]) -> str:
    lines = [f"\ndef {definition['name']}(", "    *,"]
    lines += [f"    {axis['name']}: Values | None = ...," for axis in definition["axes"]]
    lines.append("    grid: Grid | None = None,")
    if has_scale(definition):
        lines.append('    unit: Literal["1/t_f", "1"] | None = None,')
    text = "\n".join(lines) + "\n" + OPTIONS.format(columns=_quoted(definition["columns"]))
    return text


def main() -> None:
    """Writes the file, or compares it."""
    path = Path(__file__).with_name("_tables.pyi")
    if sys.argv[1:] != ["--check"]:
        path.write_text(stub(), encoding="utf-8")
    elif not path.is_file() or path.read_text(encoding="utf-8") != stub():
        sys.exit(f"{path}: not current\n  help: python -m slipsweep._stubs")


if __name__ == "__main__":
    main()
