"""Every failure has a short name that docs/errors.md explains; statuses stand there too."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from freeswing.cdpr.files.problems import DataError, InputError
from freeswing.errors import DISK, MEMORY, NAMES, UNFORESEEN, name_of_module, short_name
from freeswing.main import main
from tests.house.test_house import SOURCES
from tests.places import ROOT, SAMPLES

PAGE = (ROOT / "docs" / "errors.md").read_text(encoding="utf-8")
RAISED = ("InputError", "DataError", "UnusableRunError", "ValueError")


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts if parts[0] == "freeswing" else ("freeswing", *parts))


def raises(path: Path) -> bool:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return any(
        isinstance(node, ast.Raise)
        and isinstance(node.exc, ast.Call)
        and isinstance(node.exc.func, ast.Name)
        and node.exc.func.id in RAISED
        for node in ast.walk(tree)
    )


def test_every_room_that_raises_has_a_name() -> None:
    modules = [module_of(path) for path in SOURCES if raises(path)]
    assert len(modules) > 100, len(modules)
    assert [one for one in modules if name_of_module(one) == UNFORESEEN] == []


def test_the_page_explains_these_names_and_no_others() -> None:
    explained = set(re.findall(r"^\| `([a-z-]+)` \|", PAGE, re.MULTILINE))
    assert explained == {*NAMES.values(), DISK, MEMORY, UNFORESEEN}


def test_links_of_the_page_lead_somewhere() -> None:
    for place in re.findall(r"\]\(([a-z-]+(?:/[a-z-]+)?\.md)\)", PAGE):
        assert (ROOT / "docs" / place).is_file(), place


def short(words: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    status = main(words)
    said = capsys.readouterr().err
    told = re.search(r"^freeswing: \[([a-z-]+)\] ", said, re.MULTILINE)
    assert told, said
    return status, told[1]


def test_names_as_a_user_meets_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert short(["check", str(tmp_path / "none")], capsys) == (2, "file")
    assert main(["new", str(tmp_path / "lab"), "--kind", "trifilar", "--quiet"]) == 0
    assert short(["new", str(tmp_path / "lab")], capsys) == (2, "usage")
    assert short(["identify", str(tmp_path / "lab")], capsys) == (2, "keys")
    assert short(["check", str(SAMPLES / "homing")], capsys) == (2, "file")
    words = ["simulate", str(SAMPLES / "two-cables" / "robot.toml"), str(tmp_path / "x.csv")]
    assert short([*words, "--lengths-m", "0.2,0.2"], capsys)[1] == "model"


def test_a_failure_said_again_keeps_its_name() -> None:
    inner = outer = None
    try:
        try:
            raise DataError("within")
        except DataError as failure:
            inner = failure
            raise DataError("around") from failure
    except DataError as failure:
        outer = failure
    assert short_name(inner) == short_name(outer) == UNFORESEEN, "raised outside the program"
    assert short_name(OSError(28, "no space left")) == DISK
    assert short_name(MemoryError()) == MEMORY
    assert short_name(ZeroDivisionError()) == UNFORESEEN
    assert short_name(InputError("x")) == UNFORESEEN
