"""MuJoCo's motion of a driven robot: tendons with stiffness, damping, armature and a motor each."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from freeswing.cdpr.robot import Robot
from tests.oracle.mechanics.world import Array

TIME_STEP_S = 2e-4


@dataclass(frozen=True, slots=True)
class DrivenBody:
    """What the oracle needs of a driven robot, in its own words.

    Attributes:
        mass_kg: mass.
        com_m: centre of mass, platform frame, (3,).
        inertia_com: about the centre of mass, (3, 3).
        spring_N_m: k_sp (n,); spring_drum_m: r_pe (n,).
        drum_m: r_pm (n,).
        motor_inertia: j (n,).
        viscous: f_v (n,).
        torque_constant: k_em (n,).
        time_constant_s: tau, the same for all.
    """

    mass_kg: float
    com_m: Array
    inertia_com: Array
    spring_N_m: Array
    spring_drum_m: Array
    drum_m: Array
    motor_inertia: Array
    viscous: Array
    torque_constant: Array
    time_constant_s: float


def mujoco_driven(
    robot: Robot,
    body: DrivenBody,
    pose: Array,
    references_A: Array,
    rate_hz: float,
    start_A: Array,
) -> Array:
    """Poses (n_t, 7) under held current references (n_t, n), from rest; no Coulomb friction.

    A motor of inertia j on a drum of radius r is an armature of j / r^2 on its tendon, its viscous
    friction a damping of f / r^2, its balancing spring a stiffness of k_sp r_pe^2 / r^2 with zero
    rest length; a current pulls with -k_em I / r. RK4 at 0.2 ms, currents among its states: held
    over each step instead, they alone leave 0.5 um and 0.013 mrad at 5 Hz, a quarter at half the
    step.
    """
    model = mujoco.MjModel.from_xml_string(_xml(robot, body, pose))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    data.act[:] = start_A
    per_sample = round(1.0 / (rate_hz * TIME_STEP_S))
    poses = np.empty((len(references_A), 7))
    for k, reference in enumerate(references_A):
        poses[k] = data.qpos
        data.ctrl[:] = reference
        for _ in range(per_sample):
            mujoco.mj_step(model, data)
    return poses


def _xml(robot: Robot, body: DrivenBody, pose: Array) -> str:
    full = _row(body.inertia_com[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    sites = "".join(
        f'<site name="d{k}" pos="{_row(c.entry_m)}"/>' for k, c in enumerate(robot.cables)
    )
    ends = "".join(
        f'<site name="a{k}" pos="{_row(c.attachment_m)}"/>' for k, c in enumerate(robot.cables)
    )
    stiffness = body.spring_N_m * (body.spring_drum_m / body.drum_m) ** 2
    damping, armature = body.viscous / body.drum_m**2, body.motor_inertia / body.drum_m**2
    tendons = "".join(
        f'<spatial name="t{k}" stiffness="{float(stiffness[k])!r}" springlength="0 0" '
        f'damping="{float(damping[k])!r}" armature="{float(armature[k])!r}">'
        f'<site site="d{k}"/><site site="a{k}"/></spatial>'
        for k in range(robot.n_cables)
    )
    gains = -body.torque_constant / body.drum_m
    motors = "".join(
        f'<general tendon="t{k}" gainprm="{float(gains[k])!r}" dyntype="filter" '
        f'dynprm="{body.time_constant_s!r}"/>'
        for k in range(robot.n_cables)
    )
    return f"""
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{TIME_STEP_S}" integrator="RK4" gravity="{_row(robot.gravity_m_s2)}">
    <flag contact="disable"/></option>
  <worldbody>
    {sites}
    <body name="platform" pos="{_row(pose[:3])}" quat="{_row(pose[3:])}">
      <freejoint/>
      <inertial mass="{body.mass_kg!r}" pos="{_row(body.com_m)}" fullinertia="{full}"/>
      {ends}
    </body>
  </worldbody>
  <tendon>{tendons}</tendon>
  <actuator>{motors}</actuator>
</mujoco>"""


def _row(values: Array) -> str:
    return " ".join(repr(float(v)) for v in np.asarray(values).ravel())
