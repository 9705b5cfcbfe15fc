"""A driven robot as MJCF: tendons with springs, damping, armature, dry friction, a motor each."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.constants import Constants
from freeswing.cdpr.robot import Robot

Array = NDArray[np.float64]

TIME_STEP_S = 2e-4


def driven_mjcf(robot: Robot, numbers: Constants, pose: Array) -> str:
    """The robot for MuJoCo; controls are current references in A, RK4 at 0.2 ms.

    A motor of inertia j on a drum of radius r is an armature of j / r^2 on its tendon, its viscous
    friction a damping of f / r^2, its dry friction a loss of f_c / r, its balancing spring a
    stiffness of k_sp r_pe^2 / r^2 without rest length; a current I pulls with k_em I / r and is a
    first-order lag behind its reference (INCA 2016, eqs. 8-12).

    Args:
        robot: for the names, the limits and whether cables run over pulleys.
        numbers: its constants.
        pose: where the platform begins, (7,).

    Raises:
        ValueError: for swivel pulleys with a radius, which tendons do not have.
    """
    wound = [cable.name for cable in robot.cables if cable.pulley_radius_m > 0.0]
    if wound:
        raise ValueError(
            f"cables {', '.join(wound)} run over pulleys with a radius: MuJoCo's tendons leave "
            "from points alone"
        )
    names = [cable.name for cable in robot.cables]
    radius = numbers.drum_radius_m
    sites = _points("out", names, numbers.entries_m)
    ends = _points("on", names, numbers.attachments_m)
    tendons = "\n    ".join(
        f'<spatial name={quoteattr(f"cable {name}")} springlength="0 0" '
        f'stiffness="{_number(numbers.spring_N_m[k] / radius[k] ** 2)}" '
        f'damping="{_number(numbers.viscous_N_m_s[k] / radius[k] ** 2)}" '
        f'armature="{_number(numbers.inertia_kg_m2[k] / radius[k] ** 2)}" '
        f'frictionloss="{_number(numbers.coulomb_N_m[k] / radius[k])}">'
        f"<site site={quoteattr(f'out {name}')}/><site site={quoteattr(f'on {name}')}/></spatial>"
        for k, name in enumerate(names)
    )
    limits = robot.drive.current_limits_A if robot.drive else np.tile([-np.inf, np.inf], (9, 1))
    motors = "\n    ".join(
        f"<general name={quoteattr(f'motor {name}')} tendon={quoteattr(f'cable {name}')} "
        f'ctrllimited="true" ctrlrange="{_row(limits[k])}" dyntype="filter" '
        f'dynprm="{_number(numbers.time_constant_s[k])}" '
        f'gainprm="{_number(-numbers.torque_constant_N_m_A[k] / radius[k])}"/>'
        for k, name in enumerate(names)
    )
    mass, com, tensor = _about_centre(numbers.body)
    return f"""<mujoco model={quoteattr(robot.name)}>
  <compiler angle="radian"/>
  <option timestep="{TIME_STEP_S}" integrator="RK4" gravity="{_row(numbers.gravity_m_s2)}">
    <flag contact="disable"/>
  </option>
  <worldbody>
    {sites}
    <body name="platform" pos="{_row(pose[:3])}" quat="{_row(pose[3:])}">
      <freejoint/>
      <inertial mass="{_number(mass)}" pos="{_row(com)}" fullinertia="{_row(tensor)}"/>
      {ends}
    </body>
  </worldbody>
  <tendon>
    {tendons}
  </tendon>
  <actuator>
    {motors}
  </actuator>
</mujoco>
"""


def _about_centre(body: Array) -> tuple[float, Array, Array]:
    """Mass, centre, and xx yy zz xy xz yz about the centre of a body given about its origin."""
    mass, com = float(body[0]), body[1:4]
    x, y, z = com
    shift = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    return mass, com, body[4:] - mass * np.array(shift)


def _points(kind: str, names: list[str], points: Array) -> str:
    return "\n    ".join(
        f'<site name={quoteattr(f"{kind} {name}")} pos="{_row(point)}"/>'
        for name, point in zip(names, points, strict=True)
    )


def _number(value: float) -> str:
    return repr(float(value))


def _row(values: Array) -> str:
    return " ".join(_number(value) for value in np.asarray(values).ravel())
