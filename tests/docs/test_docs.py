"""The documentation's examples run as they stand, and README and CI say the same command."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from freeswing.cdpr.effects import catalogue
from freeswing.main import COMMANDS
from tests.places import ROOT

EXAMPLES = re.findall(
    r"^## (.+?)$.*?^```python\n(.*?)^```",
    (ROOT / "docs" / "api.md").read_text(encoding="utf-8"),
    re.DOTALL | re.MULTILINE,
)


@pytest.mark.parametrize(("title", "code"), EXAMPLES, ids=[title for title, _ in EXAMPLES])
def test_example_runs(title: str, code: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{title}: {done.stderr}"
    assert done.stdout.strip() != "", title


@pytest.mark.slow
def test_it_is_built_without_warnings(tmp_path: Path) -> None:
    pytest.importorskip("mkdocstrings", reason="the extra `docs` is not installed")
    words = ["-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")]
    done = subprocess.run(
        [sys.executable, *words], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr, done.stderr
    assert (tmp_path / "site" / "api.html").is_file()
    reference = (tmp_path / "site" / "reference" / "front.html").read_text(encoding="utf-8")
    assert 'id="freeswing.front.found.Found.plot"' in reference, "docstrings become a reference"
    index = json.loads((tmp_path / "site" / "search" / "search_index.json").read_bytes())
    assert any("swivel" in page["text"] for page in index["docs"]), "and all of it is searched"


def test_every_package_has_an_example() -> None:
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"servo"}
    shown = {title.partition(":")[0] for title, _ in EXAMPLES}
    assert shown == packages


def test_every_command_is_described() -> None:
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert [name for name in COMMANDS if f"| `freeswing {name} " not in text] == []


def test_effects_of_the_contract_are_there() -> None:
    """The other way round nothing is asked: an effect is documented by its own file."""
    contract = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8").split("Effect names:")[1]
    named = set(re.findall(r"`([a-z_]+)`", contract.split(", and from the cameras")[0]))
    assert named, "no effect is named"
    assert named - set(catalogue()) == set()
