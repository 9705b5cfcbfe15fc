"""What the house looks like: few files a room, short files and functions, all rooms named."""

from __future__ import annotations

import ast
import subprocess
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from tests.places import ROOT

FLOORS = ("calib", "cdpr", "excite", "freeswing", "homing", "ident", "servo", "vision")
MOST_FILES = 16
KINDS = (".py", ".md", ".html", ".css", ".js", ".svg", ".ipynb", ".toml", ".json", ".npz")
MOST_FILE_LINES = 400
MOST_FUNCTION_LINES = 80
MEAN_COMPLEXITY = 2.5

# What ruff's C901 counts.
BRANCHES = (ast.If, ast.For, ast.While, ast.AsyncFor, ast.ExceptHandler, ast.match_case)


def sources() -> list[Path]:
    """Python files of the product, each once: symlinks are not followed."""
    return [path for floor in FLOORS for path in _walk(ROOT / floor, ".py")]


def _walk(folder: Path, *endings: str) -> list[Path]:
    found = []
    for path in sorted(folder.iterdir()):
        if path.is_dir() and not path.is_symlink() and path.name != "__pycache__":
            found += _walk(path, *endings)
        elif path.name.endswith(endings) and not path.is_symlink():
            found.append(path)
    return found


SOURCES = sources()
FUNCTIONS = [
    (path, node)
    for path in SOURCES
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
]


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def test_there_is_a_house() -> None:
    assert len(SOURCES) > 250, len(SOURCES)
    assert len(FUNCTIONS) > 1500, len(FUNCTIONS)


def test_no_room_is_crowded() -> None:
    rooms = [ROOT / name for name in (*FLOORS, "benchmarks", "docs", "tests")]
    files = [path for room in rooms for path in _walk(room, *KINDS)]
    counts = Counter(path.parent for path in files if path.name != "__init__.py")
    crowded = {name_of(p): n for p, n in counts.items() if n > MOST_FILES}
    assert crowded == {}, crowded


def test_every_room_says_what_lives_there() -> None:
    rooms = {path.parent for path in SOURCES}
    silent = [
        name_of(room)
        for room in rooms
        if not (room / "__init__.py").is_file()
        or not ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8")))
    ]
    assert silent == [name_of(ROOT / "freeswing")] or silent == [], silent


def test_no_file_is_long() -> None:
    lines = {name_of(p): len(p.read_text(encoding="utf-8").splitlines()) for p in SOURCES}
    long = {name: n for name, n in lines.items() if n > MOST_FILE_LINES}
    assert long == {}, long


def test_no_function_is_long() -> None:
    lines = {f"{name_of(p)}:{f.name}": (f.end_lineno or 0) - f.lineno + 1 for p, f in FUNCTIONS}
    long = {name: n for name, n in lines.items() if n > MOST_FUNCTION_LINES}
    assert long == {}, f"over {MOST_FUNCTION_LINES} lines: {long}"


def complexity(function: ast.AST) -> int:
    """McCabe's number: branches plus one."""
    return 1 + sum(isinstance(node, BRANCHES) for node in ast.walk(function))


def test_functions_are_simple_on_the_whole() -> None:
    """Ruff holds the greatest (C901, at most 15); this is the mean."""
    mean = sum(complexity(function) for _, function in FUNCTIONS) / len(FUNCTIONS)
    assert mean <= MEAN_COMPLEXITY, f"mean complexity {mean:.2f}"


def test_no_file_is_pardoned_by_the_linter() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        ignores = tomllib.load(file)["tool"]["ruff"]["lint"]["per-file-ignores"]
    assert [name for name in ignores if name.endswith(".py")] == []
    noqa = [name_of(p) for p in SOURCES if "noqa: C901" in p.read_text(encoding="utf-8")]
    assert noqa == [], noqa


@pytest.mark.parametrize("floor", [name for name in FLOORS if name != "freeswing"])
def test_floors_are_reached_through_the_package(floor: str) -> None:
    """`import freeswing.<floor>` finds the folder at the top, whatever lies in the way."""
    link = ROOT / "freeswing" / floor
    assert link.resolve() == (ROOT / floor).resolve(), link
    kept = subprocess.run(
        ["git", "ls-files", "-s", f"freeswing/{floor}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if kept.returncode == 0 and kept.stdout:
        assert kept.stdout.startswith("120000"), f"not a symbolic link in git: {kept.stdout}"
