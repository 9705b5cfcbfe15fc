"""What a driven robot's fit may be trusted for: noise alone is left, and a number is told."""

from __future__ import annotations

import math

# Residuals of a right model are their noise: counts that stand still make 1.1 of it at most.
ABOVE_NOISE = 1.5
# A number whose deviation is more of itself is not an estimate.
LARGEST_SHARE = 0.3


def is_untold(std: float, value: float) -> bool:
    """Whether the data leave a number undetermined."""
    return not math.isfinite(std) or std > LARGEST_SHARE * abs(value)
