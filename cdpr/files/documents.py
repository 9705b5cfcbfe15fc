"""Reading and writing the program's documents: TOML in, TOML and JSON out, files replaced whole."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.cdpr.files.problems import DataError, InputError, Problems
from freeswing.cdpr.files.table_reader import Reader
from freeswing.cdpr.files.toml_text import toml_text
from freeswing.cdpr.system.confine import inside
from freeswing.cdpr.system.drafts import draft_of

__all__ = [
    "DataError",
    "InputError",
    "Problems",
    "Reader",
    "dump_toml",
    "inside",
    "load_json",
    "load_toml",
    "plain_json",
    "read_bytes",
    "read_text",
    "replace_file",
    "write_json",
]

MOST_TOML_BYTES = 2 * 2**20
FORMAT_NUMBER = 1
MOST_REPEATED_KEYS = 20


def read_bytes(path: Path | str, most_bytes: int) -> bytes:
    """The whole of a regular file of at most `most_bytes`.

    Raises:
        InputError: when it is absent, not a regular file, unreadable or larger.
    """
    path = Path(path)
    try:
        if not path.exists():
            raise InputError(f"{path}: no such file")
        if not path.is_file():
            raise InputError(f"{path}: is not a file")
        size = path.stat().st_size
        if size > most_bytes:
            raise InputError(f"{path}: {size} bytes, more than the {most_bytes} bytes read here")
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    if len(data) > most_bytes:
        raise InputError(f"{path}: more than the {most_bytes} bytes read here")
    return data


def read_text(path: Path | str, most_bytes: int) -> str:
    """The whole of a UTF-8 text file, byte-order mark dropped.

    Raises:
        InputError: as `read_bytes`, and when it is not UTF-8 text.
    """
    data = read_bytes(path, most_bytes)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}: line {line}: not UTF-8 text; save the file as UTF-8") from error


def load_json(path: Path | str, kind: str, most_bytes: int, remedy: str) -> dict[str, Any]:
    """The table of one of the program's JSON documents.

    Args:
        path: the file.
        kind: its `format`.
        most_bytes: no more are read.
        remedy: where such a file comes from.

    Raises:
        InputError: as `read_text`, and when it is not JSON or of another format.
    """
    text = read_text(path, most_bytes)
    try:
        table = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON ({error}); {remedy}") from error
    found = table.get("format") if isinstance(table, dict) else type(table).__name__
    if not isinstance(table, dict) or found != kind:
        raise InputError(f"{path}: format is {found!r}, must be {kind!r}; {remedy}")
    return table


def load_toml(path: Path | str, kind: str, problems: Problems | None = None) -> dict[str, object]:
    """The tables of a TOML document, without its `format` key.

    Args:
        path: the file.
        kind: what `format = "freeswing-<kind>/1"` must say.
        problems: takes the repeated keys (each is left out but for its first value), so that the
            caller can report them with everything else; without it they raise here.

    Raises:
        InputError: unreadable, not TOML (the line is named), of another kind or a newer number.
    """
    text = read_text(path, MOST_TOML_BYTES)
    repeated = problems if problems is not None else Problems()
    table = _parse(Path(path), text, repeated)
    if problems is None:
        repeated.raise_if_any(path)
    _check_format(path, table.pop("format", None), kind)
    return table


def dump_toml(path: Path | str, table: Mapping[str, object]) -> None:
    """Write a TOML document; `table` holds its `format` key. The file is replaced whole."""
    replace_file(path, toml_text(table).encode())


def write_json(path: Path | str, table: Mapping[str, object]) -> None:
    """Write a JSON document; a number that is not finite becomes null. Replaced whole."""
    text = json.dumps(plain_json(table), indent=1, ensure_ascii=False, allow_nan=False)
    replace_file(path, f"{text}\n".encode())


def replace_file(path: Path | str, data: bytes | Iterable[bytes]) -> None:
    """Put `data`, at once or in pieces, at `path` whole or not at all; folders above are made.

    Raises:
        InputError: when the file cannot be written.
    """
    path = Path(path)
    try:
        with draft_of(path) as file:
            file.writelines([data] if isinstance(data, bytes) else data)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error


def _parse(path: Path, text: str, repeated: Problems) -> dict[str, object]:
    """TOML tables of `text`; lines that repeat a key are recorded and skipped."""
    lines = text.replace("\r\n", "\n").split("\n")
    for _ in range(MOST_REPEATED_KEYS):
        try:
            return tomllib.loads("\n".join(lines))
        except tomllib.TOMLDecodeError as error:
            number = _line_number(str(error), len(lines))
            line = lines[number - 1].strip()
            is_repeat = "Cannot overwrite a value" in str(error)
            if not is_repeat or not re.match(r"[\w.\"' -]+=", line):
                raise InputError(
                    f"{path}: line {number}: not TOML: {error}: {line[:80]!r}"
                ) from error
            key = line.partition("=")[0].strip()
            repeated.add(f"line {number}: {key}", "this key is already given above")
            lines[number - 1] = ""
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}: not TOML: {str(error)[:120]}") from error
    raise InputError(f"{path}: more than {MOST_REPEATED_KEYS} repeated keys")


def _line_number(message: str, n_lines: int) -> int:
    found = re.search(r"at line (\d+)", message)
    return min(int(found.group(1)), n_lines) if found else n_lines


def _check_format(path: Path | str, found: object, kind: str) -> None:
    wanted = f"freeswing-{kind}/{FORMAT_NUMBER}"
    if found is None:
        raise InputError(f'{path}: format: missing; the first line must be format = "{wanted}"')
    match = (
        re.fullmatch(r"freeswing-([a-z-]+)/(\d{1,9})", found) if isinstance(found, str) else None
    )
    if match is None or match.group(1) != kind:
        raise InputError(f'{path}: format: {str(found)[:60]!r} is not "{wanted}"')
    if int(match.group(2)) != FORMAT_NUMBER:
        newer = "newer than" if int(match.group(2)) > FORMAT_NUMBER else "not"
        raise InputError(
            f"{path}: format: {found!r} is {newer} the {wanted!r} that this version reads; "
            "update freeswing"
        )


def plain_json(value: object) -> object:
    """Plain JSON values; numbers that are not finite become None."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain_json(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain_json(entry) for entry in value]
    return value
