"""By what readings miss a fit: as noise leaves it, with geometry in doubt, or far off."""

from __future__ import annotations

GOOD_FIT = 9.0  # mean squares over the noise's that readings of some start pose leave at most
# Chi-square a degree of freedom: more than unlucky readings leave.
DOUBTFUL_FIT = 4.0
# Mean squares over the noise's: a geometry that is some millimetres off leaves tens to thousands,
# a wrong start, unit or sign a million and more.
FAR_OFF = 1e4


def is_good(squares: float, degrees: int) -> bool:
    """Whether squares over so many degrees of freedom are what some start pose leaves."""
    return squares < GOOD_FIT * degrees


def is_beyond_doubt(squares: float, degrees: int) -> bool:
    """Whether nothing in the squares asks for errors of the declared geometry."""
    return squares < DOUBTFUL_FIT * degrees


def is_near(squares: float, degrees: int) -> bool:
    """Whether geometry may be off by millimetres, but start, units and signs are right."""
    return squares < FAR_OFF * degrees
