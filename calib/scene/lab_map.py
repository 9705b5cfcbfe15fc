"""A map of the laboratory by COLMAP, in a process that ends in time and can be gone on with."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.calib.camera.lens_models import PARAMETER_NAMES, Array
from freeswing.calib.exchange.colmap import HALF_PIXEL
from freeswing.calib.scene.colmap_job import MAP
from freeswing.calib.scene.stills import Still
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.system.arrays import whole_arrays
from freeswing.cdpr.system.progress import Progress

# An image takes seconds, a pair a tenth of one; ten times as long is a machine that is stuck.
_SECONDS_AN_IMAGE, _SECONDS_A_PAIR, _SECONDS_AT_LEAST = 30.0, 2.0, 300.0
_MOST_MAP_BYTES = 1 << 30
_VERSION = "freeswing-scene/2"


@dataclass(frozen=True, slots=True)
class LabMap:
    """Where images were taken from, and what they see, in a frame and a scale of its own.

    Attributes:
        poses: T_camera_map of every image, NaN where it could not be tied in, (n, 4, 4).
        params: lens of every image, principal points by our convention, (n, k).
        image: image of each sighting, (m,).
        point: point of each sighting, (m,).
        pixels: the sightings, (m, 2).
        size_px: size of the feature's blob in each, (m,).
        points: (n_points, 3).
        shared: matched features of each two images, (n, n).
    """

    poses: Array
    params: Array
    image: np.ndarray
    point: np.ndarray
    pixels: Array
    size_px: Array
    points: Array
    shared: Array

    @property
    def tied(self) -> np.ndarray:
        """Which images are in the map, bool (n,)."""
        return np.isfinite(self.poses[:, 0, 0])


def map_of(
    stills: Sequence[Still], model: str, kept: Path, progress: Progress | None = None
) -> LabMap:
    """The map of these stills, from `kept` where it was made before.

    Args:
        stills: the rig's cameras first.
        model: lens model of all of them.
        kept: folder for COLMAP's files; what other stills left there goes.
        progress: told what is done, and the fraction.

    Raises:
        DataError: COLMAP does not come to an end, or ends with an error.
    """
    key = _key(stills, model)
    folder = kept / key
    if kept.is_dir():
        for other in kept.iterdir():
            if other.name != key and other.is_dir():
                shutil.rmtree(other)
    arrays = whole_arrays(folder / MAP, _MOST_MAP_BYTES)
    if arrays is None:
        _prepare(folder, stills, model)
        _run(folder, len(stills), progress)
        arrays = whole_arrays(folder / MAP, _MOST_MAP_BYTES)
    if arrays is None:
        raise DataError(f"{folder}: COLMAP left no map; delete that folder and calibrate again")
    return _map(arrays, model)


def _map(arrays: dict[str, np.ndarray], model: str) -> LabMap:
    params = np.array(arrays["params"])
    names = PARAMETER_NAMES[model]
    if params.shape[1]:
        params[:, [names.index("cx"), names.index("cy")]] -= HALF_PIXEL
    seen = arrays["seen"]
    return LabMap(
        arrays["poses"],
        params,
        seen[:, 0].astype(int),
        seen[:, 1].astype(int),
        np.ascontiguousarray(seen[:, 2:4]),
        seen[:, 4],
        arrays["points"],
        arrays["shared"],
    )


def _key(stills: Sequence[Still], model: str) -> str:
    digest = hashlib.sha256(f"{_VERSION} {model}".encode())
    for still in stills:
        digest.update(f"{still.file} {still.image.shape};".encode())
        digest.update(np.ascontiguousarray(still.image).tobytes())
    return digest.hexdigest()[:16]


def _prepare(folder: Path, stills: Sequence[Still], model: str) -> None:
    import cv2

    for still in stills:
        path = folder / "images" / still.file
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file():
            path.write_bytes(np.asarray(cv2.imencode(".png", still.image)[1]).tobytes())
    (folder / "models").mkdir(exist_ok=True)
    job = {"model": model, "names": [still.file for still in stills]}
    (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")


def _run(folder: Path, count: int, progress: Progress | None) -> None:
    """The job to its end; its lines are told on."""
    limit = _SECONDS_AT_LEAST + _SECONDS_AN_IMAGE * count + _SECONDS_A_PAIR * count**2 / 2.0
    words = [sys.executable, "-m", "freeswing.calib.scene.colmap_job", str(folder.resolve())]
    with (folder / "job.log").open("wb") as log:
        env = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
        job = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=log, env=env)
        timer = threading.Timer(limit, job.kill)
        timer.start()
        try:
            for line in job.stdout or ():
                share, _, text = line.decode(errors="replace").strip().partition(" ")
                if progress is not None and share.replace(".", "", 1).isdigit():
                    progress(text, min(float(share), 1.0))
            code = job.wait()
            late = not timer.is_alive()
        finally:
            timer.cancel()
            job.kill()
            job.wait()
            if job.stdout is not None:
                job.stdout.close()
    if code == 0:
        return
    if late:
        raise DataError(
            f"COLMAP was not done with {count} images after {limit:.0f} s and was stopped; "
            "calibrate again and it goes on from there, or give it fewer images of the walk"
        )
    lines = (folder / "job.log").read_text(encoding="utf-8", errors="replace").splitlines()
    why = next((line for line in reversed(lines) if line.strip()), "no word")
    raise DataError(f"COLMAP ended with {code}: {why[:200]}; all it said is in {folder}/job.log")
