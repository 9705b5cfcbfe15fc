"""Two phones: H.264 at 29.97 Hz, variable, started apart, rolling shutters, one upside down.

The swings are those of `tests.samples.make_filmed`, from the independent integrator; the phones'
recordings are squeezed and stamped here as phones do it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import write_cameras
from freeswing.cdpr.files.documents import dump_toml
from freeswing.cdpr.measured.target import write_target
from freeswing.demo.rig import base_tags, demo_target
from freeswing.vision.render.render_scene import Renderer, Scene, motion_of
from tests.oracle.recorded import session_files as files
from tests.oracle.recorded.sessions import make_scene
from tests.oracle.scenes.robots import declared_robot, true_body
from tests.oracle.scenes.runs import draw_run
from tests.samples import make_filmed as filmed

RATE_HZ = 30000 / 1001
TICK = Fraction(1, 90000)


@dataclass(frozen=True)
class Phone:
    """How a phone records.

    Attributes:
        started_s: base time of its first frame.
        line_time_s: of its rolling shutter, in the upright picture.
        turn_deg: as its container says.
        dropped: share of frames that it loses.
        jitter_s: half width of how frames come early or late.
    """

    started_s: float
    line_time_s: float = 0.0
    turn_deg: int = 0
    dropped: float = 0.0
    jitter_s: float = 0.0


def film(
    path: Path, camera: Camera, scene: Scene, phone: Phone, seconds: float, rng: np.random.Generator
) -> None:
    """One recording, `<camera>.mp4`."""
    count = int(seconds * RATE_HZ)
    stamps = np.arange(count) / RATE_HZ + rng.uniform(-1.0, 1.0, count) * phone.jitter_s
    keep = rng.random(count) >= phone.dropped
    keep[[0, 1]] = True
    stamps = stamps[keep] - stamps[0]
    true = replace(camera, clock_offset_s=phone.started_s, line_time_s=phone.line_time_s)
    frames = Renderer(true, scene, filmed.LOOK, filmed.SEED).frames(stamps)
    write_phone_video(path, frames, stamps, phone.turn_deg)


def write_phone_video(
    path: Path,
    frames: Iterable[np.ndarray],
    stamps_s: np.ndarray,
    turn_deg: int = 0,
    **options: str,
) -> None:
    """H.264 in mp4, pictures stored turned against what the file says."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(30000, 1001))
        stream.options = {"preset": "medium", "crf": "18", "tune": "grain"}
        stream.pix_fmt = "yuv420p"
        stream.codec_context.thread_count = 2  # x264's pictures depend on it: one a core by default
        stream.codec_context.time_base = stream.time_base = TICK
        if turn_deg:
            stream.set_display_rotation(-turn_deg)
        opened = False
        for frame, stamp in zip(frames, stamps_s, strict=True):
            stored = np.ascontiguousarray(np.rot90(frame, turn_deg // 90))
            if not opened:
                stream.height, stream.width = stored.shape
                opened = True
            picture = av.VideoFrame.from_ndarray(stored, format="gray").reformat(format="yuv420p")
            picture.pts, picture.time_base = round(float(stamp) / float(TICK)), TICK
            container.mux(stream.encode(picture))
        container.mux(stream.encode())


def write_session(folder: Path, phones: dict[str, Phone], seconds: float, roles=filmed.ROLES):
    """A whole session without stamps; gives the truth: the body."""
    rng = np.random.default_rng(filmed.SEED)
    robot, body = declared_robot("bologna-4"), true_body("bologna-4", rng)
    scene = make_scene(robot, body, {}, rng)
    cameras = [replace(c, clock_offset_s=0.0) for c in filmed.cameras()]
    tables = []
    late = max(phone.started_s for phone in phones.values())
    for count, role in enumerate(roles, start=1):
        name = f"swing-{count:02d}" if role == "identify" else f"check-{count:02d}"
        run = draw_run(scene, rng, late + seconds + 0.4, filmed.SPLINE_HZ)
        motion = filmed._trajectory(run)
        world = Scene((*filmed._still(), *filmed._platform()), motion_of(motion))
        for camera in cameras:
            place = folder / "runs" / name / f"{camera.name}.mp4"
            own = phones[camera.name]
            film(place, camera, world, own, late + seconds - own.started_s, rng)
        told = run.world.length + rng.normal(0.0, filmed.LENGTH_NOISE_M, robot.n_cables)
        tables.append(filmed._run_table(name, role, told))
        tables[-1].pop("window_s")
    files.write_robot(folder / "robot.toml", robot)
    write_target(folder / "target.toml", demo_target())
    write_cameras(folder / "cameras.toml", tuple(cameras))
    surveyed = [
        {"family": t.family, "id": t.id, "corners_base_m": np.round(t.corners_platform_m, 6)}
        for t in base_tags()
    ]
    dump_toml(
        folder / "session.toml",
        {
            "format": "freeswing-session/1",
            "name": "phones",
            "robot": "robot.toml",
            "target": "target.toml",
            "cameras": "cameras.toml",
            "frame_rate_hz": 30.0,
            "calibration": {"base_tags": surveyed},
            "runs": tables,
        },
    )
    return body
