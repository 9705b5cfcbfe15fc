"""What stands for a function that a model cannot have."""

from __future__ import annotations

from typing import NoReturn


class Refused:
    """Stands for a function that a model cannot have: every use raises a ValueError that says why.

    Args:
        reason: what is refused, why, and the remedy.
    """

    def __init__(self, reason: str) -> None:
        self._reason = reason

    def __getattr__(self, name: str) -> NoReturn:
        """Refuse, except what Python itself asks for."""
        if name.startswith("__"):
            raise AttributeError(name)
        raise ValueError(self._reason)

    def __call__(self, *_: object) -> NoReturn:
        """Refuse."""
        raise ValueError(self._reason)
