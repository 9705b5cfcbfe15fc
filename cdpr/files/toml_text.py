"""Plain values to TOML text (the standard library reads TOML but does not write it)."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TypeGuard

BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(table: Mapping[str, object]) -> str:
    """TOML text of a table; None values are left out, floats are written to full precision.

    Raises:
        ValueError: for a number that is not finite or a value that TOML cannot hold.
    """
    return "\n".join(_table_lines(table, ())) + "\n"


def _table_lines(table: Mapping[str, object], path: tuple[str, ...]) -> Iterator[str]:
    entries = {key: value for key, value in table.items() if value is not None}
    for key, value in entries.items():
        if not (isinstance(value, Mapping) or _is_table_array(value)):
            yield f"{_key(key)} = {_value(value, (*path, key))}"
    for key, value in entries.items():
        name = ".".join(map(_key, (*path, key)))
        if isinstance(value, Mapping):
            yield from ("", f"[{name}]", *_table_lines(value, (*path, key)))
        elif _is_table_array(value):
            for entry in value:
                yield from ("", f"[[{name}]]", *_table_lines(entry, (*path, key)))


def _is_table_array(value: object) -> TypeGuard[Sequence[Mapping[str, object]]]:
    if not isinstance(value, list | tuple) or not value:
        return False
    return all(isinstance(entry, Mapping) for entry in value)


def _key(key: str) -> str:
    return key if BARE_KEY.fullmatch(key) else toml_string(key)


def toml_string(text: str) -> str:
    """A text in quotes, as TOML reads it."""
    # JSON's escapes are TOML's, but for DEL, which TOML wants escaped too.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: object, path: tuple[str, ...]) -> str:
    # NumPy's arrays and scalars, without NumPy: `freeswing --help` imports nothing heavy.
    value = getattr(value, "tolist", lambda: value)()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"{'.'.join(path)}: {value} is not finite and cannot be written")
        return repr(value)
    if isinstance(value, str):
        return toml_string(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(entry, path) for entry in value)}]"
    if isinstance(value, Mapping):
        pairs = (f"{_key(k)} = {_value(v, (*path, k))}" for k, v in value.items() if v is not None)
        return f"{{ {', '.join(pairs)} }}"
    raise ValueError(f"{'.'.join(path)}: TOML has no form for {type(value).__name__}")
