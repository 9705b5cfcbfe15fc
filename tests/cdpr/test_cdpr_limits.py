"""What is decided of robots, meshes and motions, on both sides of every limit, on made numbers."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from freeswing.cdpr.driven.model import build_driven
from freeswing.cdpr.effects.forces.tether import EFFECT, place
from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.mesh.nominal_inertia import _check_body, _check_size
from freeswing.cdpr.mesh.separate_bodies import _touches
from freeswing.cdpr.model.undefined_poses import domain_problems
from freeswing.cdpr.simulation import simplified_newton
from tests.cdpr.driven_robots import INCA


@pytest.mark.parametrize(("n_cables", "told"), [(5, "need n >= "), (6, "effect is named twice")])
def test_a_driven_robot_has_six_cables(n_cables, told):
    robot = SimpleNamespace(name="odd", n_cables=n_cables)
    with pytest.raises(ValueError, match=told):
        build_driven(robot, ("tether", "tether"))


def test_coulomb_friction_turns_its_sign_within_a_tenth_of_a_radian_a_second(tmp_path):
    lines = [line for line in INCA.read_text().splitlines() if "coulomb_width" not in line]
    (tmp_path / "robot.toml").write_text("\n".join(lines))
    motors = read_robot(tmp_path / "robot.toml").drive.motors
    widths = {motor.formulas[6].text for motor in motors}
    assert widths == {"0.1"}


def test_a_tether_pulls_as_stated_seven_tenths_of_the_spread_below_the_entries():
    """There its stiffness and its rest share change nothing; beside it they do."""
    corners = [[3.0, 0.0, 1.0], [-3.0, 0.0, 1.0], [0.0, 4.0, 1.0], [0.0, -4.0, 1.0]]
    spread = np.sqrt(np.mean([9.0, 9.0, 16.0, 16.0]))

    def force(below, values):
        instant = SimpleNamespace(
            cables=[SimpleNamespace(entry=ca.SX(corner)) for corner in corners],
            rotation=ca.SX.eye(3),
            zeta=ca.SX([0.0, 0.0, 1.0 - below * spread, 0.0, 0.0, 0.0]),
            force_at=lambda _, told: told,
        )
        assert place(instant).shape == (3, 1)
        return np.array(ca.DM(EFFECT.wrench(instant, ca.SX(values)))).ravel()

    pull = [0.3, -0.2, 0.5]
    for stiffness, rest in ((0.0, 0.0), (5.0, 0.3), (15.0, 0.9)):
        there = force(0.7, [stiffness, *pull, rest, 0.0, 0.0, 0.0])
        assert np.allclose(there, pull, atol=1e-6)
    assert not np.allclose(force(0.72, [5.0, *pull, 0.3, 0.0, 0.0, 0.0]), pull, atol=0.01)


@pytest.mark.parametrize(("size_m", "refused"), [(97.0, False), (103.0, True)])
def test_a_platform_is_shorter_than_a_hundred_metres(size_m, refused):
    body = SimpleNamespace(volume=1.0)
    mesh = SimpleNamespace(
        is_watertight=True,
        is_winding_consistent=True,
        extents=np.array([1.0, size_m, 2.0]),
        volume=1.0,
        split=lambda only_watertight: [body],
    )
    if refused:
        with pytest.raises(InputError, match=r"expected 0\.001 to"):
            _check_body("made.stl", mesh, "m")
        return
    _check_body("made.stl", mesh, "m")


def open_box() -> np.ndarray:
    """Five sides of a cube about the origin, wound outwards, open above, (10, 3, 3)."""
    faces = []
    for axis, side in ((0, 1), (0, -1), (1, 1), (1, -1), (2, -1)):
        u, v = np.roll(np.eye(3), -axis, axis=0)[1:]
        middle = side * np.eye(3)[axis]
        a, b, c, d = (middle + s * u + t * v for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
        both = [[a, b, c], [a, c, d]]
        faces += both if side > 0 else [face[::-1] for face in both]
    return np.array(faces)


@pytest.mark.parametrize(("height", "inside"), [(-0.2, True), (0.45, False)])
def test_three_quarters_of_a_turn_are_inside(height, inside):
    """An open box winds 0.87 times round the lower point, 0.72 times round the upper one."""
    point = np.array([[0.0, 0.0, height]])
    bounds = np.array([[-2.0] * 3, [2.0] * 3])
    tiny = point + 1e-4 * np.eye(3)
    body = SimpleNamespace(bounds=bounds, vertices=point, triangles=tiny[None])
    box = SimpleNamespace(bounds=bounds, triangles=open_box())
    assert _touches(body, box) == inside


@pytest.mark.parametrize(("cosine", "named"), [(1.05e-3, 0), (0.95e-3, 1)])
def test_angles_end_six_hundredths_of_a_degree_before_ninety(monkeypatch, cosine, named):
    monkeypatch.setattr("freeswing.cdpr.model.undefined_poses._cable_problems", lambda *_: [])
    pose = np.array([[0.0, 0.0, 0.0, 0.0, np.arccos(cosine), 0.0]])
    assert len(domain_problems(SimpleNamespace(), pose, np.zeros(0))) == named


@pytest.mark.parametrize(("ratio", "near"), [(0.68, True), (0.72, False)])
def test_a_motion_is_near_while_changes_shrink_to_seven_tenths(monkeypatch, ratio, near):
    changes = iter(ratio ** np.arange(20.0))
    monkeypatch.setattr(simplified_newton, "_from", lambda aimed, *_: aimed)
    monkeypatch.setattr(simplified_newton, "_at_nodes", lambda *_: (0.0, 0.0))
    monkeypatch.setattr(simplified_newton, "only", lambda *_: None)
    monkeypatch.setattr(simplified_newton, "evaluate", lambda *_: [np.zeros((1, 4, 6))])
    answer = np.zeros((1, 24))
    answer[0, 0] = 1.0
    monkeypatch.setattr(
        simplified_newton.Surroundings, "_answer", lambda *_: next(changes) * answer
    )
    aimed = SimpleNamespace(
        steps_s=np.ones(1),
        starts_s=np.zeros(1),
        inertia=np.zeros(9),
        values=np.zeros(0),
        model=SimpleNamespace(acceleration=None),
    )
    around = object.__new__(simplified_newton.Surroundings)
    settled = around._settled(
        aimed, np.zeros(12), np.zeros((1, 4, 6)), 0.1 / simplified_newton.SETTLED
    )
    assert (settled is not None) == near


@pytest.mark.parametrize(
    ("times", "stated", "doubted"),
    [(28.0, True, False), (32.0, True, True), (7.5, False, False), (8.5, False, True)],
)
def test_a_mesh_that_is_of_another_size_than_its_cables(times, stated, doubted):
    """Larger or smaller; a unit that was stated is doubted later."""
    for size_m in (times, 1.0 / times):
        with pytest.raises(InputError, match="say the unit") if doubted else nullcontext():
            _check_size("a.stl", size_m, "m", stated, 1.0)
