"""Separate bodies of one mesh: hollow spaces are meant, overlaps and inside-out bodies are not."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_MOST_POINTS = 300  # of a body that are tried: vertices, edge middles and triangle centres
_MOST_PAIRS = 4_000_000  # points times triangles at once
_INSIDE = 0.75  # of a turn: the winding number is 1 inside a closed surface, 0.5 on it, 0 outside
_MOST_BODIES = 200


def winding_numbers(points: Array, triangles: Array) -> Array:
    """How often a closed surface winds round each point.

    Args:
        points: (n, 3).
        triangles: corners, (m, 3, 3), wound outwards.

    Returns:
        (n,), 1 inside, 0 outside (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 1983, eq. 8).
    """
    chunk = max(1, _MOST_PAIRS // max(len(triangles), 1))
    parts = [_winding(points[k : k + chunk], triangles) for k in range(0, len(points), chunk)]
    return np.concatenate(parts) if parts else np.zeros(0)


def _winding(points: Array, triangles: Array) -> Array:
    a, b, c = np.moveaxis(triangles[None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    volume = np.einsum("nmi,nmi->nm", a, np.cross(b, c))
    below = la * lb * lc + np.einsum("nmi,nmi->nm", a, b) * lc
    below += np.einsum("nmi,nmi->nm", b, c) * la + np.einsum("nmi,nmi->nm", c, a) * lb
    return 2.0 * np.arctan2(volume, below).sum(axis=1) / (4.0 * np.pi)


def problem_of_bodies(mesh: Any) -> str:
    """What is wrong between the bodies of a closed mesh, as a sentence; "" where nothing is.

    A body wound inwards is a hollow space where it lies within another, and inside out elsewhere.
    Two solid bodies that share space would be counted twice there.

    Args:
        mesh: a closed trimesh.Trimesh.
    """
    bodies = mesh.split(only_watertight=False)
    if not 1 < len(bodies) <= _MOST_BODIES:
        return ""
    solid = [k for k, body in enumerate(bodies) if body.volume > 0.0]
    for k in set(range(len(bodies))) - set(solid):
        if not any(_touches(bodies[k], bodies[other]) for other in solid):
            return (
                f"body {k + 1} of {len(bodies)}, {_place(bodies[k])}, is inside out; flip its "
                "normals and export again"
            )
    for one, other in itertools.combinations(solid, 2):
        if _touches(bodies[one], bodies[other]) or _touches(bodies[other], bodies[one]):
            return (
                f"bodies {one + 1} and {other + 1} of {len(bodies)}, {_place(bodies[one])} and "
                f"{_place(bodies[other])}, overlap: what they share would weigh twice; unite them "
                "in the CAD program and export again"
            )
    return ""


def _place(body: Any) -> str:
    return "about ({:.3g}, {:.3g}, {:.3g}) m".format(*body.bounds.mean(axis=0))


def _touches(body: Any, other: Any) -> bool:
    """Whether points of a body's surface lie within another body."""
    low, high = (
        np.maximum(body.bounds[0], other.bounds[0]),
        np.minimum(body.bounds[1], other.bounds[1]),
    )
    if (low >= high).any():
        return False
    corners = body.triangles
    points = np.concatenate([body.vertices, corners.mean(axis=1), corners[:, :2].mean(axis=1)])
    inside_box = ((points >= low) & (points <= high)).all(axis=1)
    chosen = points[inside_box]
    chosen = chosen[:: max(1, len(chosen) // _MOST_POINTS)]
    return bool((winding_numbers(chosen, other.triangles) > _INSIDE).any())
