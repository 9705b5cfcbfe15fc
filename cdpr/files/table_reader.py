"""Typed reading of one table of a document; what is wrong is recorded, not raised."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from unicodedata import category

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.problems import Problems

Array = NDArray[np.float64]

UNIT_TOLERANCE = 1e-6
MOST_TABLES = 10_000
LARGEST_NUMBER = 1e12


class Reader:
    """Reads keys of a table and records every problem under the key's full name.

    A value that is missing or wrong comes back as a placeholder of the right type (NaN, "", 0);
    call `problems.raise_if_any` before using what was read.
    """

    def __init__(self, table: Mapping[str, object], problems: Problems, where: str = "") -> None:
        self.table = table
        self.problems = problems
        self.where = where
        self._asked: set[str] = set()

    def __contains__(self, key: str) -> bool:
        return key in self.table

    def name(self, key: str) -> str:
        """Full name of a key, such as `cables[2].entry_m`."""
        return f"{self.where}.{key}" if self.where else key

    def add(self, key: str, text: str) -> None:
        """Record a problem of `key`."""
        self.problems.add(self.name(key), text)

    def raw(self, key: str, *, required: bool = True) -> object | None:
        """The value as it stands, None when absent (recorded when required)."""
        self._asked.add(key)
        value = self.table.get(key)
        if value is None and required:
            self.add(key, "missing")
        return value

    def number(
        self,
        key: str,
        *,
        minimum: float = -math.inf,
        above: float = -math.inf,
        maximum: float = math.inf,
    ) -> float:
        """A required finite number in [minimum, maximum] and > above."""
        value = self.raw(key)
        if value is None:
            return math.nan
        return self._checked(key, value, minimum, above, maximum)

    def optional_number(
        self,
        key: str,
        *,
        minimum: float = -math.inf,
        above: float = -math.inf,
        maximum: float = math.inf,
    ) -> float | None:
        """As `number`, None when absent."""
        value = self.raw(key, required=False)
        return None if value is None else self._checked(key, value, minimum, above, maximum)

    def integer(self, key: str, *, minimum: int | None = None, maximum: int | None = None) -> int:
        """A required whole number."""
        value = self.raw(key)
        if value is None:
            return 0
        if isinstance(value, bool) or not isinstance(value, int):
            self.add(key, f"{_shown(value)} is not a whole number")
            return 0
        if minimum is not None and value < minimum:
            self.add(key, f"{_shown(value)} must be >= {minimum}")
        if maximum is not None and value > maximum:
            self.add(key, f"{_shown(value)} must be <= {maximum}")
        return value

    def string(self, key: str, *, choices: Sequence[str] = ()) -> str:
        """A required non-empty text, one of `choices` if any are given."""
        value = self.raw(key)
        return "" if value is None else self._text(key, value, choices)

    def optional_string(self, key: str, *, choices: Sequence[str] = ()) -> str | None:
        """As `string`, None when absent."""
        value = self.raw(key, required=False)
        return None if value is None else self._text(key, value, choices)

    def vector(self, key: str, length: int | None) -> Array:
        """A required list of finite numbers; `length` None takes any length."""
        value = self.raw(key)
        placeholder = np.full(length or 0, np.nan)
        return placeholder if value is None else self._vector(key, value, length)

    def optional_vector(self, key: str, length: int | None) -> Array | None:
        """As `vector`, None when absent."""
        value = self.raw(key, required=False)
        return None if value is None else self._vector(key, value, length)

    def unit_vector(self, key: str, length: int = 3, tolerance: float = UNIT_TOLERANCE) -> Array:
        """A required vector of length 1 within `tolerance`, normalised exactly."""
        vector = self.vector(key, length)
        norm = float(np.linalg.norm(vector))
        if math.isfinite(norm) and abs(norm - 1.0) > tolerance:
            self.add(key, f"its length is {norm:.9g}, must be 1 within {tolerance:g}: normalise it")
        return vector / norm if norm > 0.0 else np.full(length, np.nan)

    def strings(self, key: str, *, required: bool = True) -> tuple[str, ...]:
        """A list of texts; empty when absent."""
        value = self.raw(key, required=required)
        if value is None:
            return ()
        if not isinstance(value, list) or not all(isinstance(entry, str) for entry in value):
            self.add(key, f"{_shown(value)} is not a list of texts")
            return ()
        return tuple(value)

    def child(self, key: str, *, required: bool = True) -> Reader | None:
        """The table under `key`, None when absent or not a table."""
        value = self.raw(key, required=required)
        if value is None:
            return None
        if not isinstance(value, dict):
            self.add(key, f"{_shown(value)} is not a table")
            return None
        return Reader(value, self.problems, self.name(key))

    def children(self, key: str, *, required: bool = True) -> tuple[Reader, ...]:
        """The tables of the array `[[key]]`, counted from 1 in messages; empty when absent."""
        value = self.raw(key, required=required)
        if value is None:
            return ()
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            self.add(key, f"must be tables, each headed [[{self.name(key)}]]")
            return ()
        if len(value) > MOST_TABLES:
            self.add(key, f"{len(value)} tables, more than the {MOST_TABLES} read here")
            return ()
        return tuple(
            Reader(entry, self.problems, f"{self.name(key)}[{count}]")
            for count, entry in enumerate(value, start=1)
        )

    def finish(self) -> None:
        """Record every key that nothing asked for."""
        for key in self.table:
            if key not in self._asked:
                known = ", ".join(sorted(self._asked))
                self.add(_printable(key), f"unknown key; known here: {known}")

    def _checked(
        self, key: str, value: object, minimum: float, above: float, maximum: float
    ) -> float:
        number = self.finite(key, value)
        if number < minimum:
            self.add(key, f"{number:g} must be >= {minimum:g}")
        if number <= above:
            self.add(key, f"{number:g} must be > {above:g}")
        if number > maximum:
            self.add(key, f"{number:g} must be <= {maximum:g}")
        return number

    def finite(self, key: str, value: object) -> float:
        """`value` as a finite number; NaN, and recorded under `key`, where it is none."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.add(key, f"{_shown(value)} is not a number")
            return math.nan
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self.add(key, f"{_shown(value)} is not a finite number")
            return math.nan
        if abs(number) > LARGEST_NUMBER:
            self.add(key, f"{number:g} is beyond {LARGEST_NUMBER:g}: check the unit")
            return math.nan
        return number

    def _vector(self, key: str, value: object, length: int | None) -> Array:
        wanted = "numbers" if length is None else f"{length} numbers"
        if not isinstance(value, list):
            self.add(key, f"{_shown(value)} is not a list of {wanted}")
            return np.full(length or 0, np.nan)
        if length is not None and len(value) != length:
            self.add(key, f"{len(value)} entries, must be {wanted}")
            return np.full(length, np.nan)
        return np.array([self.finite(f"{key}[{i}]", entry) for i, entry in enumerate(value)])

    def _text(self, key: str, value: object, choices: Sequence[str]) -> str:
        if not isinstance(value, str) or not value.strip():
            self.add(key, f"{_shown(value)} is not a (non-empty) text")
            return ""
        if any(category(letter) == "Cc" for letter in value):
            self.add(key, f"{value!r} holds a control character: leave it out")
            return ""
        if choices and value not in choices:
            self.add(key, f"{_shown(value)} must be one of {', '.join(choices)}")
        return value


def _shown(value: object) -> str:
    """A short printable form of a value from a file."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 10**18:
        return "a number of more than 18 digits"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return f"a list of {len(value)}" if len(value) > 6 else f"[{', '.join(map(_shown, value))}]"
    return _printable(repr(value))


def _printable(text: str) -> str:
    clean = "".join(letter if letter.isprintable() else "?" for letter in text)
    return clean if len(clean) <= 60 else f"{clean[:57]}..."
