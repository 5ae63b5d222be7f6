"""A dict as the text of a spec."""

import json
import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np


def text(spec: Mapping[str, Any]) -> str:
    """TOML with the keys and values of a dict: mappings of the top level are tables, lists of mappings are blocks."""
    lines = [f"{_key(key)} = {_value(value)}" for key, value in spec.items() if not _is_table(value)]
    for key, value in spec.items():
        if not _is_table(value):
            continue
        blocks, header = (value, f"[[{_key(key)}]]") if isinstance(value, (list, tuple)) else ([value], f"[{_key(key)}]")
        for block in blocks:
            lines += ["", header, *(f"{_key(name)} = {_value(one)}" for name, one in block.items())]
    return "\n".join(lines) + "\n"


def _is_table(value: object) -> bool:
    is_blocks = isinstance(value, (list, tuple)) and bool(value) and all(isinstance(one, Mapping) for one in value)
    return isinstance(value, Mapping) or is_blocks


def _key(key: object) -> str:
    return json.dumps(str(key), ensure_ascii=False)


def _value(value: object) -> str:
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (str, os.PathLike)):
        return json.dumps(os.fspath(value), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(one)}" for key, one in value.items()) + " }"
    if isinstance(value, Iterable):
        return "[" + ", ".join(_value(one) for one in value) + "]"
    raise ValueError(f"{value!r} has no place in a spec\n  expected: numbers, strings, lists and dicts\n  help: convert it")
