"""Names for cameras that other programs only know by topics, paths or numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

# last words of a topic that say what is sent, not by whom
_OF_IMAGES = ("image_raw", "image_rect", "image_mono", "image_color", "image", "raw", "compressed")


def distinct_names(paths: Sequence[Sequence[str]], keys: Sequence[str]) -> list[str]:
    """One name a camera: the last part of its path that differs between all of them.

    Args:
        paths: parts of a topic or of a file's path, one list a camera.
        keys: what the file calls the cameras itself; serve where the paths do not tell.
    """
    told = [_without_image(parts) for parts in paths]
    if all(told):
        for place in range(-1, -1 - min(len(parts) for parts in told), -1):
            names = [parts[place] for parts in told]
            if len(set(names)) == len(names):
                return names
        joined = ["_".join(parts) for parts in told]
        if len(set(joined)) == len(joined):
            return joined
    return list(keys)


def by_number(keys: Sequence[str]) -> list[str]:
    """cam0, cam1, cam2, ... cam10 in the order of their numbers, whatever order they came in."""
    return sorted(keys, key=lambda key: [int(n) for n in re.findall(r"\d+", key)] or [-1])


def _without_image(parts: Sequence[str]) -> list[str]:
    kept = [part for part in parts if part]
    while len(kept) > 1 and kept[-1].lower() in _OF_IMAGES:
        kept.pop()
    return kept
