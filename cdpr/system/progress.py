"""How far a long computation is, told to whoever waits for it."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Is told what is being done, and which share of the whole is done, 0 to 1."""
