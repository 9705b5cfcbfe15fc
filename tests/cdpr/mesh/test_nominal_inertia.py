import numpy as np
import pytest
import trimesh

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.mesh.nominal_inertia import platform_from_mesh
from tests.places import SAMPLES

SIZE = np.array([0.4, 0.3, 0.1])
CENTRE = np.array([0.02, -0.05, 0.2])
VOLUME = float(np.prod(SIZE))


def box(scale=1.0):
    mesh = trimesh.creation.box(SIZE)
    mesh.apply_translation(CENTRE)
    mesh.apply_scale(scale)
    return mesh


def box_inertia():
    """Closed form: about the centre, then Steiner."""
    moments = np.diag(SIZE**2) / 12.0 + np.outer(CENTRE, CENTRE)
    return (np.trace(moments) * np.eye(3) - moments)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("cm", 1e2), ("mm", 1e3)])
@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
def test_a_box_has_its_closed_form_inertia(tmp_path, unit, scale, suffix):
    path = tmp_path / f"box.{suffix}"
    box(scale).export(path)
    platform = platform_from_mesh(path, unit, density_kg_m3=1000.0)
    assert platform.mass_kg == pytest.approx(1000.0 * VOLUME, rel=1e-5)
    assert np.allclose(platform.com_m, CENTRE, atol=1e-6), platform.com_m
    assert np.allclose(platform.specific_inertia_m2, box_inertia(), atol=1e-7), platform


def test_mass_is_taken_or_stays_unknown(tmp_path):
    box().export(tmp_path / "box.stl")
    assert platform_from_mesh(tmp_path / "box.stl", mass_kg=3.0).mass_kg == 3.0
    assert platform_from_mesh(tmp_path / "box.stl").mass_kg is None
    with pytest.raises(InputError, match="not both"):
        platform_from_mesh(tmp_path / "box.stl", mass_kg=3.0, density_kg_m3=1.0)


def open_box():
    mesh = box()
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    return mesh


def inverted_box():
    mesh = box()
    mesh.invert()
    return mesh


def half_inverted_box():
    mesh = box()
    mesh.faces = np.where(np.arange(12)[:, None] < 4, mesh.faces[:, ::-1], mesh.faces)
    return mesh


@pytest.mark.parametrize(
    ("mesh", "unit", "message"),
    [
        (open_box(), "m", "not closed"),
        (inverted_box(), "m", "wind inwards"),
        (half_inverted_box(), "m", "some triangles face inwards"),
        (box(1e3), "m", "400 m long with mesh_unit = 'm'"),
        (box(), "mm", "0.0004 m long with mesh_unit = 'mm'"),
        (box(), "feet", "mesh_unit 'feet' must be one of"),
    ],
)
def test_a_mesh_without_a_volume_is_refused(tmp_path, mesh, unit, message):
    mesh.export(tmp_path / "body.stl")
    with pytest.raises(InputError, match=message):
        platform_from_mesh(tmp_path / "body.stl", unit)


@pytest.mark.parametrize("name", ["body.stl", "body.ply", "body.obj", "body.off", "body.step"])
@pytest.mark.parametrize(
    "data", [b"", b"solid x\nendsolid x\n", b"ply\nformat ascii 1.0\n", b"\0" * 84]
)
def test_damaged_meshes_are_refused(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=name):
        platform_from_mesh(tmp_path / name)


ROBOT = """format = "freeswing-robot/1"
name = "r"
[platform]
mesh = "cad/body.stl"
mesh_unit = "mm"
{more}
[[cables]]
name = "1"
entry_m = [0, 0, 2]
pulley_radius_m = 0
attachment_m = [0, 0, 0.3]
"""


def test_a_robot_file_takes_its_platform_from_a_mesh(tmp_path):
    (tmp_path / "cad").mkdir()
    box(1e3).export(tmp_path / "cad" / "body.stl")
    path = tmp_path / "robot.toml"
    path.write_text(ROBOT.format(more="density_kg_m3 = 500"))
    platform = read_robot(path).platform
    assert platform.mass_kg == pytest.approx(500.0 * VOLUME, rel=1e-5)
    assert np.allclose(platform.specific_inertia_m2, box_inertia(), atol=1e-7)
    path.write_text(ROBOT.format(more="com_m = [0.021, -0.05, 0.2]"))
    assert read_robot(path).platform.com_m.tolist() == [0.021, -0.05, 0.2]


def test_a_robot_file_names_its_mesh_problem(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(ROBOT.format(more=""))
    with pytest.raises(InputError, match=r"platform\.mesh: .*no such file"):
        read_robot(path)
    path.write_text(ROBOT.format(more="").replace("cad/body.stl", "../body.stl"))
    with pytest.raises(InputError, match=r"platform\.mesh: .*leads out of"):
        read_robot(path)


def _two_boxes(path, offset, invert=False, scale=1.0):
    one, other = trimesh.creation.box((0.2, 0.2, 0.1)), trimesh.creation.box((0.1, 0.1, 0.05))
    other.apply_translation(offset)
    if invert:
        other.invert()
    both = trimesh.util.concatenate([one, other])
    both.apply_scale(scale)
    both.export(path)
    return path


@pytest.mark.parametrize(
    ("offset", "invert", "told"),
    [
        ([0.1, 0.0, 0.0], False, "bodies 1 and 2 of 2.*overlap"),
        ([0.0, 0.0, 0.0], False, "overlap"),
        ([0.4, 0.0, 0.0], True, "body 2 of 2, about \\(0.4, 0, 0\\) m, is inside out"),
    ],
)
def test_bodies_that_overlap_or_are_inside_out_are_named(tmp_path, offset, invert, told):
    path = _two_boxes(tmp_path / "two.stl", offset, invert)
    with pytest.raises(InputError, match=told):
        platform_from_mesh(path)


def test_hollow_spaces_and_neighbours_are_bodies(tmp_path):
    hollow = platform_from_mesh(
        _two_boxes(tmp_path / "hollow.stl", [0.0, 0.0, 0.0], invert=True), density_kg_m3=1000.0
    )
    apart = platform_from_mesh(
        _two_boxes(tmp_path / "apart.stl", [0.4, 0.0, 0.0]), density_kg_m3=1000.0
    )
    np.testing.assert_allclose([hollow.mass_kg, apart.mass_kg], [3.5, 4.5], rtol=1e-6)


@pytest.mark.parametrize(
    ("size", "unit", "told"),
    [
        (80.0, None, 'no mesh_unit .* mesh_unit = "mm" would make it 0.08 m'),
        (0.4 * 8.2, None, 'mesh_unit = "in" would make it 0.0833 m'),
        (0.4 * 31.0, "m", 'with mesh_unit = "m"'),
        (0.4 / 31.0, "m", 'with mesh_unit = "m"'),
    ],
)
def test_a_body_that_is_not_of_its_cables_size_has_its_unit_questioned(tmp_path, size, unit, told):
    path = tmp_path / "body.stl"
    trimesh.creation.box((size, size / 2, size / 2)).export(path)
    with pytest.raises(InputError, match=told):
        platform_from_mesh(path, unit, span_m=0.4)


@pytest.mark.parametrize(("size", "unit"), [(0.4 * 7.8, None), (0.4 / 7.8, None), (0.4 * 29, "m")])
def test_a_body_of_about_its_cables_size_is_believed(tmp_path, size, unit):
    path = tmp_path / "body.stl"
    trimesh.creation.box((size, size / 2, size / 2)).export(path)
    assert platform_from_mesh(path, unit, span_m=0.4).com_m is not None


def test_accents_in_a_header_are_read(tmp_path):
    path = tmp_path / "latin.stl"
    text = trimesh.creation.box((0.2, 0.2, 0.1)).export(file_type="stl_ascii")
    path.write_bytes(text.replace("solid ", "solid Tr\u00e4ger ", 1).encode("latin-1"))
    np.testing.assert_allclose(platform_from_mesh(path).com_m, 0.0, atol=1e-9)


def test_a_mesh_that_nothing_is_taken_from_is_checked_too(tmp_path):
    text = (SAMPLES / "three-cables" / "robot.toml").read_text()
    path = tmp_path / "robot.toml"
    path.write_text(text.replace("[platform]", '[platform]\nmesh = "/etc"', 1))
    with pytest.raises(InputError, match="must be relative"):
        read_robot(path)
