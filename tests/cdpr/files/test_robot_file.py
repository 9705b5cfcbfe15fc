import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.robot_file import read_robot, write_robot
from freeswing.cdpr.robot import Cable, Platform, Robot
from freeswing.cdpr.rotation import exp_rotation
from tests.places import REAL

BOLOGNA = REAL / "bologna-2020" / "robot.toml"

CABLE = """
[[cables]]
name = "{name}"
entry_m = [0.219, -1.316, 0.527]
pulley_radius_m = 0.025
attachment_m = [-0.144, -0.219, 0.264]
swivel_x = [0, 1, 0]
swivel_y = [-0.0, -0, -1]
swivel_z = [-1, -0, -0]
"""
HEAD = """format = "freeswing-robot/1"
name = "r"
gravity_m_s2 = [0.0, 0.0, -9.80665]
free_coordinates = ["x", "y"]
[platform]
mass_kg = 8
com_m = [0.0, 0.0, 0.19]
specific_inertia_m2 = [0.051, 0.069, 0.037, 0.0, 0.0, 0.0]
"""
FOUR = "".join(CABLE.format(name=name) for name in "1234")


def written(tmp_path, text):
    path = tmp_path / "robot.toml"
    path.write_text(text)
    return path


def complaint(tmp_path, text):
    with pytest.raises(InputError) as caught:
        read_robot(written(tmp_path, text))
    return str(caught.value)


def random_robot(rng, n_cables, radius, free):
    axes = exp_rotation(rng.normal(size=(n_cables, 3)))
    cables = tuple(
        Cable(f"c{i}", rng.normal(size=3), radius, rng.normal(size=3), *axes[i])
        for i in range(n_cables)
    )
    points = rng.normal(size=(20, 3))
    moments = points.T @ points / 20
    tensor = np.trace(moments) * np.eye(3) - moments
    inertia = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    platform = Platform(2.0, points.mean(axis=0), inertia)
    return Robot("random", cables, rng.normal(size=3), free, platform)


def same(a, b):
    plain = a.name == b.name and a.free_coordinates == b.free_coordinates
    plain &= [c.name for c in a.cables] == [c.name for c in b.cables]
    pairs = [
        (a.gravity_m_s2, b.gravity_m_s2),
        (a.entries_m, b.entries_m),
        (a.attachments_m, b.attachments_m),
        (a.radii_m, b.radii_m),
        (a.swivel_axes, b.swivel_axes),
        (a.inertia, b.inertia),
    ]
    return plain and all(np.allclose(x, y, rtol=0.0, atol=1e-15) for x, y in pairs)


@given(st.integers(0, 2**32 - 1), st.integers(1, 8), st.booleans())
def test_what_is_written_reads_back(tmp_path_factory, seed, n_cables, auto):
    free = (
        None if auto and n_cables < 6 else ("x", "y", "z", "phi", "theta")[: max(6 - n_cables, 0)]
    )
    robot = random_robot(np.random.default_rng(seed), n_cables, 0.02 * (seed % 3), free)
    path = tmp_path_factory.mktemp("robot") / "robot.toml"
    write_robot(path, robot)
    assert same(robot, read_robot(path)), path.read_text()


def test_the_plain_file_reads(tmp_path):
    robot = read_robot(written(tmp_path, HEAD + FOUR))
    assert robot.n_cables == 4
    assert robot.platform.mass_kg == 8.0
    assert robot.free_coordinates == ("x", "y")


@pytest.mark.skipif(not BOLOGNA.exists(), reason=f"the recorded session {BOLOGNA.parent} is absent")
def test_a_published_geometry_reads():
    assert read_robot(BOLOGNA).radii_m.tolist() == [0.025] * 4


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("entry_m = [0.219, -1.316, 0.527]", "", "cables[1].entry_m: missing"),
        ("entry_m = [0.219,", "entry_m = [", "cables[1].entry_m: 2 entries, must be 3"),
        ("entry_m", "entry_mm", "cables[1].entry_mm: unknown key"),
        ("0.219, -1.316", "nan, -1.316", "cables[1].entry_m[0]: nan is not a finite number"),
        ("0.219, -1.316", "true, -1.316", "cables[1].entry_m[0]: True is not a number"),
        ("= 0.025", "= -0.025", "cables[1].pulley_radius_m: -0.025 must be >= 0"),
        ("swivel_x = [0, 1, 0]", "swivel_x = [0, 1.00001, 0]", "cables[1].swivel_x: its length"),
        ("swivel_x = [0, 1, 0]", "swivel_x = [0, 0.6, 0.8]", "swivel_x, swivel_y: not perpend"),
        ("swivel_z = [-1,", "swivel_z = [1,", "swivel_z: x, y, z are left-handed"),
        ("swivel_z = [-1, -0, -0]", "", "cables[1].swivel_z: missing"),
        ('name = "1"', 'name = "2"', "cables[2].name: '2' is already cables[1]'s"),
        ('["x", "y"]', '["x"]', "free_coordinates: 1 coordinates, must be 6 - n = 2"),
        ('["x", "y"]', '["x", "x"]', "names a coordinate twice"),
        ('["x", "y"]', '["x", "w"]', "'w' is not one of x, y, z"),
        ('["x", "y"]', '"all"', "free_coordinates: 'all' is not a list"),
        ("mass_kg = 8", "mass_kg = 0", "platform.mass_kg: 0 must be > 0"),
        ("0.0, 0.0, 0.19", "0.0, 0.0, 0.3", "specific_inertia_m2: no body has it"),
        ("0.051, 0.069, 0.037", "0.01, 0.069, 0.037", "specific_inertia_m2: no body has it"),
        ("mass_kg = 8", 'mass_kg = 8\nmesh = "../a.stl"\ndensity_kg_m3 = 3', "not both"),
        ("mass_kg = 8", "mesh_unit = 'm'", "platform.mesh: missing"),
        ("-9.80665", "0.0", "gravity_m_s2: is zero"),
        ("-9.80665", "-9806.65", "9806.65 m/s2 are no gravity: this looks like mm/s2"),
        ("-9.80665", "-980.665", "980.665 m/s2 are no gravity: this looks like mm/s2 or cm/s2"),
    ],
)
def test_each_mistake_is_named(tmp_path, old, new, message):
    assert old in HEAD + FOUR
    found = complaint(tmp_path, (HEAD + FOUR).replace(old, new, 1))
    assert message in found, found


def test_all_mistakes_are_named_at_once(tmp_path):
    text = (HEAD + FOUR).replace('name = "r"', "").replace("0.025", "-1", 1)
    text = text.replace("[0, 1, 0]", "[0, 2, 0]", 2) + "colour = 1\nentry_m = [1, 2, 3]\n"
    found = complaint(tmp_path, text)
    wanted = [
        "6 problems",
        "line 46: entry_m: this key is already given",
        "name: missing",
        "cables[1].pulley_radius_m",
        "cables[1].swivel_x",
        "cables[2].swivel_x",
        "cables[4].colour: unknown key",
    ]
    for part in wanted:
        assert part in found, found


@pytest.mark.parametrize("n", [0, 9])
def test_the_number_of_cables_is_1_to_8(tmp_path, n):
    tables = "".join(CABLE.format(name=i) for i in range(n)) or "cables = []"
    head = HEAD.split("[platform]")[0].replace('["x", "y"]', "[]")
    assert f"{n} cables, must be 1 to 8" in complaint(tmp_path, head + tables)


def test_six_cables_leave_no_free_coordinate(tmp_path):
    six = "".join(CABLE.format(name=name) for name in "123456")
    assert "must be 6 - n = 0" in complaint(tmp_path, HEAD + six)
    assert read_robot(written(tmp_path, HEAD.replace('["x", "y"]', "[]") + six)).n_cables == 6
    without = HEAD.replace('free_coordinates = ["x", "y"]', "")
    assert read_robot(written(tmp_path, without + six)).free_coordinates == ()
    assert read_robot(written(tmp_path, without + FOUR)).free_coordinates is None


def test_an_eyelet_needs_no_swivel_frame(tmp_path):
    bare = FOUR.replace("0.025", "0")
    for axis in ("swivel_x = [0, 1, 0]\n", "swivel_y = [-0.0, -0, -1]\n"):
        bare = bare.replace(axis, "")
    axes = read_robot(written(tmp_path, HEAD + bare)).swivel_axes
    assert np.array_equal(axes, np.broadcast_to(np.eye(3), (4, 3, 3)))


@given(st.data())
def test_damaged_files_read_or_are_refused(tmp_path_factory, data):
    text = bytearray((HEAD + FOUR).encode())
    for _ in range(data.draw(st.integers(1, 6))):
        text[data.draw(st.integers(0, len(text) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("robot") / "robot.toml"
    path.write_bytes(bytes(text))
    try:
        n_cables = read_robot(path).n_cables
    except InputError:
        n_cables = 1
    assert 1 <= n_cables <= 8
