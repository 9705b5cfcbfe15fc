"""Read-only copies of the arrays that frozen dataclasses hold."""

from __future__ import annotations

import numpy as np


def freeze(instance: object, *names: str) -> None:
    """Replace the named array attributes of a frozen dataclass by read-only copies."""
    for name in names:
        array = np.array(getattr(instance, name))
        array.flags.writeable = False
        object.__setattr__(instance, name, array)
