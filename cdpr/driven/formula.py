"""Lengths written as text: + - * / ( ) sin cos sqrt of numbers and named lengths, nothing else."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

LONGEST_TEXT = 200  # no length needs more; keeps a hostile file from nesting too deep
FUNCTIONS = ("sin", "cos", "sqrt")
ALLOWED = "numbers, names, + - * / ( ) sin cos sqrt"
_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
}


@dataclass(frozen=True, slots=True)
class Formula:
    """A number, or an expression in named lengths and angles.

    Attributes:
        text: as the file has it.
        names: the names that it uses, in alphabetical order.
    """

    text: str
    names: tuple[str, ...]

    @classmethod
    def of(cls, source: object) -> Formula:
        """The formula of a number or a text of a file.

        Raises:
            ValueError: for anything but `ALLOWED`, naming what was found.
        """
        if isinstance(source, bool) or not isinstance(source, int | float | str):
            raise ValueError(f"{str(source)[:40]!r} is neither a number nor an expression")
        if not isinstance(source, str):
            return cls(repr(float(source)), ())
        if len(source) > LONGEST_TEXT:
            raise ValueError(f"{len(source)} letters, more than the {LONGEST_TEXT} read here")
        names: set[str] = set()
        _check(_parsed(source), source, names)
        found = cls(source.strip(), tuple(sorted(names)))
        return found if names else cls(repr(float(found.at({}))), ())

    @property
    def is_number(self) -> bool:
        """Whether no name is used."""
        return not self.names

    def at(self, names: Mapping[str, Any], functions: Any = math) -> Any:
        """The value where the names have these values.

        Args:
            names: numbers, or expressions of a symbolic engine.
            functions: what has `sin`, `cos` and `sqrt` for them: `math`, `casadi`.

        Raises:
            ValueError: when a number divides by zero or leaves the domain of sqrt.
            KeyError: for a name that is not there.
        """
        try:
            return _value(_parsed(self.text), names, functions)
        except (ZeroDivisionError, OverflowError, ValueError) as error:
            raise ValueError(f"{self.text!r} has no value: {error}") from error


def _parsed(text: str) -> ast.expr:
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ValueError(f"{text[:60]!r} is not an expression; use {ALLOWED}") from error


def _check(node: ast.expr, text: str, names: set[str]) -> None:
    """Record the names used; refuse everything that is not arithmetic."""
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return
        case ast.Name(id=name):
            names.add(name)
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=inner):
            _check(inner, text, names)
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
            _check(left, text, names)
            _check(right, text, names)
        case ast.Call(func=ast.Name(id=name), args=[inner], keywords=[]) if name in FUNCTIONS:
            _check(inner, text, names)
        case _:
            part = ast.unparse(node)[:40]
            raise ValueError(f"{part!r} in {text[:60]!r} is not understood; use {ALLOWED}")


def _value(node: ast.expr, names: Mapping[str, Any], functions: Any) -> Any:
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name):
            return names[name]
        case ast.UnaryOp(op=operator, operand=inner):
            value = _value(inner, names, functions)
            return -value if isinstance(operator, ast.USub) else value
        case ast.BinOp(left=left, op=operator, right=right):
            pair = (_value(side, names, functions) for side in (left, right))
            return _OPERATORS[type(operator)](*pair)
        case ast.Call(func=ast.Name(id=name), args=[inner]):
            return getattr(functions, name)(_value(inner, names, functions))
    raise ValueError(f"{ast.dump(node)[:60]} is no formula")
