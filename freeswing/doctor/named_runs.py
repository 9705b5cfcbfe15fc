"""Runs that share a fault, in one sentence."""

from __future__ import annotations

from collections.abc import Sequence


def named_runs(names: Sequence[str]) -> str:
    """The first by name, and how many more there are."""
    more = f" (and {len(names) - 1} more runs)" if len(names) > 1 else ""
    return f"run {names[0]}{more}"
