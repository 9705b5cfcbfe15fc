"""Each kind of footage and file that docs/decisions/footage.md lists has its test."""

from __future__ import annotations

import ast
import re

import pytest

from tests.places import ROOT

ROW = re.compile(r"^\| ([\d, ]+) \| .+ \| `([\w/.]+)::(\w+)` \|$", re.MULTILINE)
ROWS = ROW.findall((ROOT / "docs" / "decisions" / "footage.md").read_text(encoding="utf-8"))
POINTS = 15
# Helpers of other test files that call `main(["track", ...])` and `main(["check", ...])`.
COMMANDS = {"main", "track", "findings", "checked"}


def test_no_point_is_left_out() -> None:
    points = {int(number) for numbers, _, _ in ROWS for number in numbers.split(",")}
    assert points == set(range(1, POINTS + 1))
    assert len({(path, name) for _, path, name in ROWS}) == len(ROWS), "a test stands twice"


def called(node: ast.AST, functions: dict[str, ast.FunctionDef], known: set[str]) -> set[str]:
    """Names that a function uses, and those of the file's functions and fixtures that it uses."""
    names = {one.id for one in ast.walk(node) if isinstance(one, ast.Name)}
    names |= {one.arg for one in ast.walk(node) if isinstance(one, ast.arg)}
    for name in names & functions.keys() - known:
        known.add(name)
        names |= called(functions[name], functions, known)
    return names


@pytest.mark.parametrize(("path", "name"), sorted({(path, name) for _, path, name in ROWS}))
def test_it_is_there_and_goes_through_the_command_line(path: str, name: str) -> None:
    tree = ast.parse((ROOT / "tests" / path).read_text(encoding="utf-8"))
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert name in functions
    used = called(functions[name], functions, set())
    assert used & COMMANDS, sorted(used)
