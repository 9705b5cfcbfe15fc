"""MuJoCo's free motion of an eyelet robot: spatial tendons held at their length, or springs."""

from __future__ import annotations

import mujoco
import numpy as np

from freeswing.cdpr.robot import Robot
from tests.oracle.mechanics.newton_euler import Motion
from tests.oracle.mechanics.world import Array, Body

TIME_STEP_S = 1e-4


def mujoco_swing(
    robot: Robot,
    body: Body,
    position_m: Array,
    quaternion: Array,
    duration_s: float,
    twist: Array | None = None,
    rate_hz: float = 100.0,
    stiffness_ea_n: float = 0.0,
    unstretched_m: Array | None = None,
) -> Motion:
    """The swing from a pose (P, quaternion w x y z) and a twist (base frame, about P).

    Cables keep the lengths that they have at the start. RK4 at 0.1 ms with `solref 0.0002 1`
    holds them to well under a micrometre; `Motion.drift_m` is the largest departure at a sample.
    The soft constraint's force chatters from step to step, so `tensions_n` is NaN.
    With `stiffness_ea_n` above 0 the cables are undamped springs of EA over `unstretched_m` (n,),
    and the drift is their stretch.

    Raises:
        ValueError: when a pulley has a radius (MuJoCo's own pulley is a drum that does not swivel).
    """
    if np.any(robot.radii_m > 0.0):
        raise ValueError(f"pulley radii {robot.radii_m} m: MuJoCo knows eyelets (radius 0) alone")
    cables = _held(robot.n_cables)
    if stiffness_ea_n > 0.0:
        rest = np.ones(robot.n_cables) if unstretched_m is None else unstretched_m
        cables = _springs(stiffness_ea_n, rest)
    model = mujoco.MjModel.from_xml_string(_xml(robot, body, position_m, quaternion, cables))
    data = mujoco.MjData(model)
    _set_twist(data, quaternion, np.zeros(6) if twist is None else np.asarray(twist))
    substeps = round(1.0 / (rate_hz * TIME_STEP_S))
    samples = round(duration_s * rate_hz) + 1
    poses, twists = np.empty((samples, 7)), np.empty((samples, 6))
    tensions, drift = np.full((samples, robot.n_cables), np.nan), 0.0
    mujoco.mj_forward(model, data)
    start_lengths = data.ten_length.copy()
    for k in range(samples):
        if k > 0:
            mujoco.mj_step(model, data, substeps)
            mujoco.mj_forward(model, data)
        poses[k] = data.qpos
        twists[k] = _base_twist(data)
        drift = max(drift, float(np.max(np.abs(data.ten_length - start_lengths))))
    times = np.arange(samples) / rate_hz
    return Motion(times, poses[:, :3], poses[:, 3:], twists, tensions, drift)


def _set_twist(data: mujoco.MjData, quaternion: Array, twist: Array) -> None:
    """MuJoCo's free joint has its linear velocity in the world, its angular one in the body."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, np.asarray(quaternion, dtype=float))
    data.qvel[:3] = twist[:3]
    data.qvel[3:] = rotation.reshape(3, 3).T @ twist[3:]


def _base_twist(data: mujoco.MjData) -> Array:
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
    return np.concatenate([data.qvel[:3], rotation.reshape(3, 3) @ data.qvel[3:]])


def _xml(robot: Robot, body: Body, position_m: Array, quaternion: Array, cables: str) -> str:
    """The MJCF model; MuJoCo takes the inertia tensor about the centre of mass, body axes."""
    moment = body.inertia_com
    full = _row(moment[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    anchors = "".join(
        f'<site name="d{k}" pos="{_row(c.entry_m)}"/>' for k, c in enumerate(robot.cables)
    )
    ends = "".join(
        f'<site name="a{k}" pos="{_row(c.attachment_m)}"/>' for k, c in enumerate(robot.cables)
    )
    return f"""
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{TIME_STEP_S}" integrator="RK4" gravity="{_row(robot.gravity_m_s2)}"
          tolerance="1e-14" iterations="200"><flag contact="disable"/></option>
  <worldbody>
    {anchors}
    <body name="platform" pos="{_row(position_m)}" quat="{_row(quaternion)}">
      <freejoint/>
      <inertial mass="{body.mass_kg!r}" pos="{_row(body.com_m)}" fullinertia="{full}"/>
      {ends}
    </body>
  </worldbody>
  {cables}
</mujoco>"""


def _held(n: int) -> str:
    tendons = "".join(f'<spatial name="c{k}">{_line(k)}</spatial>' for k in range(n))
    holds = "".join(
        f'<tendon tendon1="c{k}" polycoef="0 0 0 0 0" solref="0.0002 1"/>' for k in range(n)
    )
    return f"<tendon>{tendons}</tendon><equality>{holds}</equality>"


def _springs(stiffness_ea_n: float, unstretched_m: Array) -> str:
    springs = "".join(
        f'<spatial stiffness="{stiffness_ea_n / rest!r}" springlength="0 {rest!r}">'
        f"{_line(k)}</spatial>"
        for k, rest in enumerate(map(float, unstretched_m))
    )
    return f"<tendon>{springs}</tendon>"


def _line(k: int) -> str:
    return f'<site site="d{k}"/><site site="a{k}"/>'


def _row(values: Array) -> str:
    return " ".join(repr(float(v)) for v in np.asarray(values).ravel())
