"""Where tests find the samples, and real recordings that are not part of the repository."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SAMPLES = ROOT / "samples"
REAL = Path(os.environ.get("FREESWING_REAL", ROOT.parent / "shared" / "real"))


def needs_real(name: str) -> pytest.MarkDecorator:
    """Skip, and say where it was looked for, where real recordings are not there."""
    folder = REAL / name
    return pytest.mark.skipif(
        not folder.is_dir(), reason=f"no {folder} (set FREESWING_REAL to the recordings' folder)"
    )
