import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.measured.target import Marker, Tag, Target, read_target, write_target
from freeswing.cdpr.rotation import exp_rotation, transform

TEXT = """format = "freeswing-target/1"
[[tags]]
family = "tag36h11"
id = 0
size_m = 0.08
q_platform_tag = [1, 0, 0, 0]
t_platform_tag_m = [0.1, 0.2, 0.3]
[[tags]]
family = "tag36h11"
id = 1
size_m = 0.08
q_platform_tag = [0.0, 1.0, 0.0, 0.0]
t_platform_tag_m = [0.0, 0.0, 0.0]
[[markers]]
name = "P"
position_m = [0, 0, 0]
diameter_m = 0.012
"""


def written(tmp_path, text):
    path = tmp_path / "target.toml"
    path.write_text(text)
    return path


def test_corners_run_from_top_left_clockwise_seen_from_the_front(tmp_path):
    target = read_target(written(tmp_path, TEXT))
    front, back = target.tags
    offsets = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * 0.04
    assert np.allclose(front.corners_platform_m, offsets + np.array([0.1, 0.2, 0.3]), atol=1e-15)
    assert np.allclose(back.corners_platform_m, offsets * [1, -1, 1], atol=1e-15)
    top, side = front.corners_platform_m[1] - front.corners_platform_m[0], [0, -0.08, 0]
    assert np.cross(top, side)[2] < 0.0, "clockwise about the outward normal"
    assert target.markers[0].diameter_m == 0.012


@given(st.integers(0, 2**32 - 1))
def test_what_is_written_reads_back(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    poses = transform(exp_rotation(rng.normal(size=(3, 3))), rng.normal(size=(3, 3)))
    tags = tuple(Tag("tag36h11", i, 0.1 * (i + 1), T) for i, T in enumerate(poses))
    markers = (Marker("P", np.zeros(3)), Marker('a "b" é', rng.normal(size=3), 0.02))
    path = tmp_path_factory.mktemp("target") / "target.toml"
    write_target(path, Target(tags, markers))
    found = read_target(path)
    for a, b in zip(tags, found.tags, strict=True):
        assert (a.family, a.id, a.size_m) == (b.family, b.id, b.size_m)
        assert np.allclose(a.T_platform_tag, b.T_platform_tag, atol=1e-14)
    assert found.marker_names == ("P", 'a "b" é')
    assert np.array_equal(found.marker_positions_m[1], markers[1].position_m)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("id = 1", "id = 0", "tags[2]: 'tag36h11 0' is already tags[1]"),
        ("id = 1", "id = 1.5", "tags[2].id: 1.5 is not a whole number"),
        ("id = 1", "id = -1", "tags[2].id: -1 must be >= 0"),
        ("= 0.08", "= 0", "tags[1].size_m: 0 must be > 0"),
        (
            "= 0.08",
            "= 80",
            "80 m, expected 0.0001 to 3 m: millimetres? 0.08 m then",
        ),
        ("= 0.08", "= 3.01", "tags[1].size_m: 3.01 m"),
        ("= 0.08", "= 0.00009", "tags[1].size_m: 9e-05 m"),
        ("0.012", "12", "markers[1].diameter_m: 12 m, expected 0.0001 to 0.5 m: millimetres?"),
        ("[1, 0, 0, 0]", "[2, 0, 0, 0]", "tags[1].q_platform_tag: its length is 2"),
        ("[1, 0, 0, 0]", "[1, 0, 0]", "tags[1].q_platform_tag: 3 entries"),
        ("0.012", "-0.012", "markers[1].diameter_m: -0.012 must be > 0"),
        ('name = "P"', "", "markers[1].name: missing"),
        ("[[markers]]", "[[marker]]", "marker: unknown key"),
    ],
)
def test_each_mistake_is_named(tmp_path, old, new, message):
    with pytest.raises(InputError) as caught:
        read_target(written(tmp_path, TEXT.replace(old, new, 1)))
    assert message in str(caught.value)


@pytest.mark.parametrize(("old", "new"), [("= 0.08", "= 2.99"), ("0.012", "0.49")])
def test_unusual_sizes_are_believed(tmp_path, old, new):
    assert read_target(written(tmp_path, TEXT.replace(old, new, 1))).tags


def test_an_empty_target_is_refused(tmp_path):
    with pytest.raises(InputError, match="at least one tag or marker"):
        read_target(written(tmp_path, 'format = "freeswing-target/1"'))
