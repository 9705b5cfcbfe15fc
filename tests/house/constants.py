"""Every number that the product gives a name: held by tests, or listed with why it decides nothing.

`named_numbers` finds them all: names in capitals at the top of a module whose value is a number or
arithmetic of numbers, several in one line too. Those of `tests/house/wreck.py` are held from both
sides; the others stand in `undeciding.toml`, in groups that share one reason.
"""

from __future__ import annotations

import ast
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

from tests.house.test_house import SOURCES, name_of

CAPITALS = re.compile(r"_?[A-Z][A-Z0-9_]*")
ARITHMETIC = (ast.Constant, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop)
LISTS = Path(__file__).with_name("undeciding.toml")
Place = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Undeciding:
    """Numbers that decide nothing, for one reason, as (file, name)."""

    reason: str
    places: tuple[Place, ...]


def is_number(value: ast.expr) -> bool:
    """Whether it is a number, or made of numbers by arithmetic; truth values are none."""
    parts = list(ast.walk(value))
    numbers = [part.value for part in parts if isinstance(part, ast.Constant)]
    plain = all(isinstance(one, int | float) and not isinstance(one, bool) for one in numbers)
    return plain and all(isinstance(part, ARITHMETIC) for part in parts)


def numbers_of(text: str) -> list[str]:
    """Names in capitals that a module's text gives a number, at its top."""
    found = []
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign):
            targets, value = node.targets, node.value
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            targets, value = [node.target], node.value
        else:
            continue
        given = [(one, value) for one in targets]
        for one in targets:
            if isinstance(one, ast.Tuple) and isinstance(value, ast.Tuple):
                given += zip(one.elts, value.elts, strict=True)
        found += [
            one.id
            for one, part in given
            if isinstance(one, ast.Name) and CAPITALS.fullmatch(one.id) and is_number(part)
        ]
    return found


def named_numbers() -> list[Place]:
    """All of the product's, as (file, name)."""
    return [
        (name_of(path), name)
        for path in SOURCES
        for name in numbers_of(path.read_text(encoding="utf-8"))
    ]


def listed() -> dict[str, Undeciding]:
    """What decides nothing, by its group's word."""
    with LISTS.open("rb") as file:
        groups = tomllib.load(file)
    return {word: Undeciding(group.pop("reason"), _places(group)) for word, group in groups.items()}


def _places(files: dict[str, list[str]]) -> tuple[Place, ...]:
    return tuple((file, name) for file, names in files.items() for name in names)
