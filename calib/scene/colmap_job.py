"""COLMAP's part, in a process of its own: features, matches and a map of the laboratory.

Run as `python -m freeswing.calib.scene.colmap_job FOLDER`, with `job.json` and `images/` in it; it
says what it does on lines `share text` and leaves `map.npz`. Features and matches are kept in
COLMAP's own database, from where a job that was killed goes on.

Source:
    Schoenberger, Frahm 2016, Structure-from-Motion Revisited.
"""

from __future__ import annotations

import itertools
import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.exchange.colmap import HALF_PIXEL
from freeswing.calib.scene.stills import LEAST_IMAGES
from freeswing.cdpr.system.arrays import save_arrays
from freeswing.cdpr.system.lifeline import tie_to

MAP = "map.npz"
FEATURES = 3000  # an image; a camera's place needs some hundreds, matching takes their square
_PAIRS_AT_ONCE = 40
_IMAGES_AT_ONCE = 8
_SEED = 0
_MODELS = 3


def main(folder: Path) -> None:
    """All three steps, what is done already left out."""
    import pycolmap

    tie_to(os.getppid())
    pycolmap.logging.minloglevel = 2
    pycolmap.set_random_seed(_SEED)
    job = json.loads((folder / "job.json").read_text(encoding="utf-8"))
    names: list[str] = job["names"]
    database = folder / "database.db"
    _find_features(database, folder / "images", names, job["model"])
    _match(database, folder / "pairs.txt", names)
    _say(0.6, "mapping")
    models = pycolmap.incremental_mapping(
        database,
        folder / "images",
        folder / "models",
        _mapping(),
        next_image_callback=_Counted(len(names)),
    )
    best = max(models.values(), key=lambda one: one.num_reg_images(), default=None)
    save_arrays(folder / MAP, _arrays(best, names, database))
    _say(1.0, "mapped")


class _Counted:
    """Says how many images are in the map."""

    def __init__(self, count: int) -> None:
        self.count, self.done = count, 2

    def __call__(self) -> None:
        self.done = min(self.done + 1, self.count)
        _say(0.6 + 0.4 * self.done / self.count, f"mapping image {self.done} of {self.count}")


def _find_features(database: Path, images: Path, names: list[str], model: str) -> None:
    import pycolmap

    options = pycolmap.FeatureExtractionOptions()
    options.sift.max_num_features = FEATURES
    options.sift.first_octave = 0
    for place in ("rig", "walk"):
        own = [name for name in names if name.startswith(f"{place}/")]
        for first in range(0, len(own), _IMAGES_AT_ONCE):
            _say(0.3 * (names.index(own[first]) / len(names)), f"features of {own[first]}")
            reader, mode = pycolmap.ImageReaderOptions(), pycolmap.CameraMode.PER_IMAGE
            reader.camera_model = model
            if place == "walk":
                mode = pycolmap.CameraMode.SINGLE
                reader.existing_camera_id = _camera_of(database, own[0])
            some = own[first : first + _IMAGES_AT_ONCE]
            pycolmap.extract_features(
                database, images, some, mode, reader, options, pycolmap.Device.cpu
            )


def _camera_of(database: Path, name: str) -> int:
    """The camera that an image already has there, COLMAP's "none" without."""
    import pycolmap

    none = int(pycolmap.ImageReaderOptions().existing_camera_id)
    if not database.is_file():
        return none
    with pycolmap.Database.open(database) as kept:
        known = {image.name: int(image.camera_id) for image in kept.read_all_images()}
    return known.get(name, none)


def _match(database: Path, listed: Path, names: list[str]) -> None:
    import pycolmap

    pairs = list(itertools.combinations(names, 2))
    verify = pycolmap.TwoViewGeometryOptions()
    verify.ransac.random_seed = _SEED
    pairing = pycolmap.ImportedPairingOptions()
    pairing.match_list_path = listed
    for first in range(0, len(pairs), _PAIRS_AT_ONCE):
        _say(0.3 + 0.3 * first / len(pairs), f"matching pair {first} of {len(pairs)}")
        some = pairs[first : first + _PAIRS_AT_ONCE]
        listed.write_text("".join(f"{a} {b}\n" for a, b in some), encoding="utf-8")
        pycolmap.match_image_pairs(
            database,
            pairing_options=pairing,
            verification_options=verify,
            device=pycolmap.Device.cpu,
        )


def _mapping() -> Any:
    import pycolmap

    options = pycolmap.IncrementalPipelineOptions()
    options.random_seed = options.mapper.random_seed = options.triangulation.random_seed = _SEED
    options.max_num_models = _MODELS
    options.min_model_size = LEAST_IMAGES
    options.extract_colors = False
    return options


def _arrays(model: Any, names: list[str], database: Path) -> dict[str, np.ndarray]:
    """The map as `calib.scene.lab_map.LabMap` reads it; a model of None is empty."""
    import pycolmap

    order = {name: k for k, name in enumerate(names)}
    poses = np.full((len(names), 4, 4), np.nan)
    lens: list[np.ndarray] = [np.zeros(0)] * len(names)
    seen: list[tuple[float, ...]] = []
    points: dict[int, int] = {}
    sizes = _sizes(database)
    for image in [] if model is None else model.images.values():
        if not image.has_pose:
            continue
        k, size = order[image.name], sizes[int(image.image_id)]
        poses[k] = np.eye(4)
        poses[k, :3] = image.cam_from_world().matrix()
        lens[k] = np.array(image.camera.params)
        for row, point in enumerate(image.points2D):
            if point.has_point3D():
                number = points.setdefault(int(point.point3D_id), len(points))
                u, v = point.xy - HALF_PIXEL
                seen.append((k, number, float(u), float(v), float(size[row])))
    width = max(map(len, lens))
    params = np.full((len(names), width), np.nan)
    for k, values in enumerate(lens):
        params[k, : len(values)] = values
    places = np.zeros((len(points), 3))
    if model is not None:
        for number, row in points.items():
            places[row] = model.points3D[number].xyz
    shared = np.zeros((len(names), len(names)))
    with pycolmap.Database.open(database) as kept:
        ids = {int(i.image_id): order[i.name] for i in kept.read_all_images()}
        pairs, counts = kept.read_two_view_geometry_num_inliers()
        for pair, count in zip(pairs, counts, strict=True):
            a, b = (ids[int(one)] for one in pycolmap.pair_id_to_image_pair(pair))
            shared[a, b] = shared[b, a] = count
    return {
        "poses": poses,
        "params": params,
        "seen": np.array(seen, dtype=np.float64).reshape(-1, 5),
        "points": places,
        "shared": shared,
    }


def _sizes(database: Path) -> dict[int, np.ndarray]:
    """Size of each feature of each image: the standard deviation of its blob, px."""
    import pycolmap

    with pycolmap.Database.open(database) as kept:
        found = {}
        for image in kept.read_all_images():
            shapes = np.asarray(kept.read_keypoints(image.image_id))[:, 2:6]
            if shapes.shape[1] == 4:
                turned = np.abs(shapes[:, 0] * shapes[:, 3] - shapes[:, 1] * shapes[:, 2])
                found[int(image.image_id)] = np.sqrt(turned)
            else:
                found[int(image.image_id)] = shapes[:, 0]
    return found


def _say(share: float, text: str) -> None:
    sys.stdout.write(f"{share:.4f} {text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
