"""The documentation's examples run as they stand, and README and CI say the same command."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
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


def test_formats_and_code_know_the_same_effects() -> None:
    named = set(
        re.findall(
            r"`([a-z_]+)`",
            (ROOT / "docs" / "formats.md")
            .read_text(encoding="utf-8")
            .split("Effect names:")[1]
            .split("New ones follow")[0],
        )
    )
    files = {
        path.stem
        for path in (ROOT / "cdpr" / "effects").glob("*.py")
        if path.stem not in ("__init__", "base")
    }
    assert files - named == set()
