"""Controllers as the loop steps them: an error in, a wrench out, and what became of it."""

from __future__ import annotations

from typing import Protocol

from freeswing.servo.synthesis.state_space import Array


class Regulator(Protocol):
    """What the loop asks of a controller."""

    def wrench(self, error: Array, asked: Array, new: bool) -> Array:
        """The change of wrench, (6,).

        Args:
            error: pose asked for minus pose, (6,).
            asked: the pose asked for, (6,).
            new: whether the error was measured just now.
        """
        ...

    def applied(self, wrench: Array) -> None:
        """What of it the motors could give, (6,)."""
        ...
