"""The guide: its numbers are those of the program, its pages end with a command, all is linked."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
import yaml

from freeswing.main import COMMANDS
from freeswing.report.page import PANELS
from tests.places import ROOT

DOCS = ROOT / "docs"
GUIDE = sorted((DOCS / "guide").glob("*.md"))
sys.path.insert(0, str(DOCS / "scripts"))

import make_guide  # noqa: E402  # pyright: ignore[reportMissingImports]


@pytest.mark.parametrize("name", make_guide.QUICK)
def test_a_table_is_what_the_program_computes(name: str) -> None:
    made = make_guide.markdown(make_guide.QUICK[name][1]())
    assert make_guide.in_page(name) == made, f"run docs/scripts/make_guide.py {name}"


@pytest.mark.slow
@pytest.mark.parametrize("name", make_guide.LONG)
def test_a_long_table_is_what_the_program_computes(name: str) -> None:
    made = make_guide.markdown(make_guide.LONG[name][1]())
    assert make_guide.in_page(name) == made, f"run docs/scripts/make_guide.py {name}"


def test_every_table_of_the_pages_is_made_by_the_script() -> None:
    marked = {
        (page.relative_to(DOCS).as_posix(), name)
        for page in GUIDE
        for name in re.findall(r"<!-- table (\S+) -->", page.read_text(encoding="utf-8"))
    }
    assert marked == {(page, name) for name, (page, _) in make_guide.TABLES.items()}


@pytest.mark.parametrize("page", GUIDE, ids=lambda path: path.stem)
def test_a_page_ends_with_its_command(page: Path) -> None:
    last = page.read_text(encoding="utf-8").rstrip().rsplit("```sh\n", 1)[-1]
    assert last.endswith("```"), f"{page.name} ends with no command"
    words = last.split()
    assert words[0] == "freeswing", words
    assert words[1] in COMMANDS, words


def test_what_pages_show_is_there() -> None:
    for page in DOCS.rglob("*.md"):
        text = page.read_text(encoding="utf-8")
        for place in re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text):
            assert (page.parent / place).is_file(), f"{page.name}: {place}"


def test_every_page_is_in_the_navigation() -> None:
    told = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    listed = set(re.findall(r"[\w./-]+\.md", str(told)))
    assert listed == {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")}


def test_the_glossary_knows_the_reports_words() -> None:
    glossary = (DOCS / "glossary.md").read_text(encoding="utf-8").lower()
    shown = " ".join(
        path.read_text(encoding="utf-8")
        for path in (ROOT / "freeswing" / "report").rglob("*")
        if path.suffix in (".py", ".html")
    ).lower()
    words = (
        "noise floor",
        "cost c",
        "σ⊥",
        "σ_w",
        "held-out",
        "full poses",
        "free coordinates",
        "principal axes",
        "radius of gyration",
        "correlation",
        "maximum likelihood",
        "fidim",
        "equilibri",
        "rigid",
        "provenance",
        "residual",
        "bic",
        "probability",
    )
    assert [word for word in words if word not in shown] == [], "no longer a word of the report"
    assert [word for word in words if word not in glossary] == []
    assert len(PANELS) > 8


def test_verdicts_are_those_that_the_program_says() -> None:
    from freeswing.report.panels.answer import verdict
    from freeswing.results.diagnosis import Diagnosis

    page = (DOCS / "guide" / "verdicts.md").read_text(encoding="utf-8")
    assert verdict(None)[0].split(":")[0] in page
    assert verdict(Diagnosis())[0] in page
