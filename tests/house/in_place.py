"""Wrecks constants where they stand in memory: tests are imported once for many of them.

That serves where nothing but functions reads a constant when they are called. What compiled
functions read, what a module or a default makes of it when it is imported, and what a test's own
text names are left to `tests.house.wreck`, which imports the file anew.
"""

from __future__ import annotations

import ast
import gc
import importlib
import os
import sys
from collections.abc import Callable, Sequence
from functools import cache
from multiprocessing import Pipe
from pathlib import Path

from tests.house.test_house import SOURCES
from tests.places import ROOT

Wreck = tuple[str, str, float]
"""File, name and another value of one of its constants."""


def noticed_in_place(tests: str, wrecks: Sequence[Wreck]) -> list[bool]:
    """Which of them turn the tests red, each in a process of its own that has imported them.

    Raises:
        RuntimeError: where the tests are red without any wreck.
    """
    here, there = Pipe(duplex=False)

    def work() -> int:
        pytest_main(["--collect-only", "-q", *tests.split()])
        gc.freeze()
        red = _red(tests, None)
        there.send(None if red else [_red(tests, wreck) for wreck in wrecks])
        return 0

    child = in_child(work)
    there.close()
    try:
        found: list[bool] | None = here.recv()
    except EOFError:
        found = [False] * len(wrecks)
    os.waitpid(child, 0)
    if found is None:
        raise RuntimeError(f"{tests}: red as it is, so it holds nothing")
    return found


def in_child(work: Callable[[], int]) -> int:
    """The number of a process that does this and ends with what it gives."""
    child = os.fork()
    if child == 0:
        code = 3
        try:
            code = work()
        finally:
            os._exit(code)
    return child


def pytest_main(arguments: Sequence[str]) -> int:
    """Runs pytest without a word."""
    import pytest

    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    lean = ["-p", "no:cacheprovider", "-p", "no:unraisableexception", "--tb=no"]
    return int(pytest.main([*lean, *arguments]))


def _red(tests: str, wreck: Wreck | None) -> bool:
    def work() -> int:
        if wreck is not None:
            _wreck(*wreck)
        return pytest_main(["-x", "-q", *tests.split()])

    return os.waitstatus_to_exitcode(os.waitpid(in_child(work), 0)[1]) == 1


def _wreck(file: str, name: str, value: float) -> None:
    """Gives the constant another value in its module and in all that have imported it."""
    parts = Path(file).with_suffix("").parts
    parts = parts[:-1] if parts[-1] == "__init__" else parts
    own = importlib.import_module(
        ".".join(parts if parts[0] == "freeswing" else ("freeswing", *parts))
    )
    before = getattr(own, name)
    for module in list(sys.modules.values()):
        known = getattr(module, "__name__", "").startswith(("freeswing.", "tests."))
        if known and vars(module).get(name) == before:
            setattr(module, name, value)


def can_be_in_place(file: str, name: str, tests: str) -> bool:
    """Whether functions alone read it, none of them compiled, and no test by its name."""
    texts = [(ROOT / path.partition("::")[0]).read_text(encoding="utf-8") for path in tests.split()]
    if any(name in text for text in texts):
        return False
    stem = Path(file).parent.name if file.endswith("__init__.py") else Path(file).stem
    for path, (text, early) in _sources().items():
        reads = path == file or (f"{stem} import" in text and name in text)
        if reads and ("@kernel" in text or "njit" in text or name in early):
            return False
    return True


@cache
def _sources() -> dict[str, tuple[str, frozenset[str]]]:
    """Of each file of the product the text, and the names that are read when it is imported."""
    found = {}
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        found[path.relative_to(ROOT).as_posix()] = text, early_names(text)
    return found


def early_names(text: str) -> frozenset[str]:
    """Names that a file reads outside of functions' bodies."""
    return frozenset(_early(ast.parse(text)))


def _early(node: ast.AST) -> list[str]:
    """Names read outside of functions' bodies: by modules, classes, decorators and defaults."""
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
        return [node.id]
    if isinstance(node, ast.Attribute):
        return [node.attr, *_early(node.value)]
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        parts: list[ast.AST] = [*node.decorator_list, node.args]
    elif isinstance(node, ast.Lambda):
        parts = [node.args]
    else:
        parts = list(ast.iter_child_nodes(node))
    return [name for part in parts for name in _early(part)]
