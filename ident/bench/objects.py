"""Bodies that ride on the platform and add up: absolute inertia by mass, centre and own tensor.

A body is ten numbers in its own frame, `BODY_NAMES`: mass, centre of mass, tensor about that
centre. About the platform's P they become mass, first moments and tensor, which simply add.
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Array

_ROWS, _COLUMNS = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
_UNITS = np.zeros((6, 3, 3))  # the tensor's slope by each of its six entries
for _entry, (_row, _column) in enumerate(zip(_ROWS, _COLUMNS, strict=True)):
    _UNITS[_entry, _row, _column] = _UNITS[_entry, _column, _row] = 1.0


def tensor(entries: Array) -> Array:
    """The symmetric matrix of xx yy zz xy xz yz, (3, 3).

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13.
    """
    return np.asarray(np.einsum("k,kij->ij", entries, _UNITS))


def entries(matrix: Array) -> Array:
    """Entries xx yy zz xy xz yz of symmetric matrices, (..., 6)."""
    return np.asarray(matrix[..., _ROWS, _COLUMNS])


def spread(place: Array) -> Array:
    """Tensor of a unit point mass at a place (3,), (3, 3).

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13.
    """
    return np.asarray(place @ place * np.eye(3) - np.outer(place, place))


def moments(body: Array, turn: Array | None = None, shift_m: Array | None = None) -> Array:
    """Mass, first moments and tensor about P of a body, (10,).

    Args:
        body: `BODY_NAMES` values in its own frame, (10,).
        turn: R_platform_body, (3, 3); None: not turned.
        shift_m: its frame's origin in the platform frame, (3,); None: at P.

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13.
    """
    turn = np.eye(3) if turn is None else turn
    shift = np.zeros(3) if shift_m is None else shift_m
    mass, centre = body[0], turn @ body[1:4] + shift
    about_p = turn @ tensor(body[4:]) @ turn.T + mass * spread(centre)
    return np.concatenate([[mass], mass * centre, entries(about_p)])


def moments_slope(body: Array, turn: Array | None = None, shift_m: Array | None = None) -> Array:
    """Derivative of `moments` by the body's ten numbers, (10, 10).

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13, differentiated.
    """
    turn = np.eye(3) if turn is None else turn
    shift = np.zeros(3) if shift_m is None else shift_m
    mass, centre = body[0], turn @ body[1:4] + shift
    found = np.zeros((10, 10))
    found[0, 0] = 1.0
    found[1:4, 0], found[4:, 0] = centre, entries(spread(centre))
    found[1:4, 1:4] = mass * turn
    for axis in range(3):
        step = turn[:, axis]
        both = 2.0 * (step @ centre) * np.eye(3) - np.outer(step, centre) - np.outer(centre, step)
        found[4:, 1 + axis] = mass * entries(both)
    found[4:, 4:] = entries(turn @ _UNITS @ turn.T).T
    return found


def specific(total: Array) -> Array:
    """The nine specific numbers of `INERTIA_NAMES` from moments about P, (9,).

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13.
    """
    return np.asarray(total[1:] / total[0])


def specific_slope(total: Array) -> Array:
    """Derivative of `specific` by the ten moments, (9, 10).

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13, differentiated.
    """
    return np.hstack([-total[1:, None] / total[0], np.eye(9)]) / total[0]


def body_of(mass_kg: float, inertia: Array) -> Array:
    """`BODY_NAMES` values of a mass and its nine specific numbers about P, (10,).

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13.
    """
    centre = inertia[:3]
    central = mass_kg * (tensor(inertia[3:]) - spread(centre))
    return np.concatenate([[mass_kg], centre, entries(central)])
