import json
import os
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freeswing.cdpr.files.documents import (
    InputError,
    Problems,
    Reader,
    dump_toml,
    inside,
    load_toml,
    read_text,
    replace_file,
    write_json,
)
from freeswing.cdpr.files.toml_text import toml_text

scalar = st.one_of(
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(exclude_categories=["Cs"])),
)
key = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8)
table = st.recursive(
    st.dictionaries(key, st.one_of(scalar, st.lists(scalar, max_size=3)), max_size=4),
    lambda inner: st.dictionaries(
        key, st.one_of(scalar, inner, st.lists(inner, min_size=1, max_size=3)), max_size=3
    ),
    max_leaves=6,
)


@given(table)
def test_toml_text_reads_back_equal(values):
    assert tomllib.loads(toml_text(values)) == values


def test_toml_takes_arrays_and_leaves_none_out():
    text = toml_text({"a": np.array([1.0, 2.0]), "b": None, "c": np.float64(0.1), "d": {"e": None}})
    assert tomllib.loads(text) == {"a": [1.0, 2.0], "c": 0.1, "d": {}}


@pytest.mark.parametrize("value", [float("nan"), float("inf"), [1.0, float("nan")]])
def test_toml_refuses_numbers_that_are_not_finite(value):
    with pytest.raises(ValueError, match=r"x\.y: .* not finite"):
        toml_text({"x": {"y": value}})


def test_json_writes_null_for_what_is_not_finite(tmp_path):
    write_json(tmp_path / "r.json", {"a": np.array([1.0, np.nan]), "b": (np.int64(2), np.inf)})
    assert json.loads((tmp_path / "r.json").read_text()) == {"a": [1.0, None], "b": [2, None]}


def test_replace_file_leaves_the_old_file_when_it_cannot_write(tmp_path, monkeypatch):
    path = tmp_path / "a.toml"
    replace_file(path, b"old")

    def no_room(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_room)
    with pytest.raises(InputError, match="No space left"):
        replace_file(path, b"new")
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.toml"]


def test_replace_file_makes_folders(tmp_path):
    replace_file(tmp_path / "results" / "tracks" / "a.csv", b"x")
    assert (tmp_path / "results" / "tracks" / "a.csv").read_bytes() == b"x"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "format: missing"),
        ('format = "freeswing-robot/1"', 'is not "freeswing-target/1"'),
        ('format = "freeswing-target/2"', "newer than"),
        ("format = 3", "'3' is not"),
        ('format = "freeswing-target/1"\na = 1\n[b]\nc = ', "line 4: not TOML"),
        ('format = "freeswing-target/1"\n\na = 1\na = 2', "line 4: a: this key is already given"),
        ('format = "freeswing-target/1"\n[t]\n[t]\n', "line 3"),
        ("a = " + "[" * 100_000, "not TOML"),
        ("a = " + "9" * 5000, "not TOML"),
    ],
)
def test_a_wrong_document_is_named(tmp_path, text, message):
    path = tmp_path / "target.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        load_toml(path, "target")
    assert "target.toml" in str(caught.value)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_document_or_an_input_error(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("any") / "x.toml"
    path.write_bytes(b'format = "freeswing-robot/1"\n' + data)
    try:
        found = load_toml(path, "robot")
    except InputError:
        found = {}
    assert isinstance(found, dict)


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_text(tmp_path / "none", 10)
    with pytest.raises(InputError, match="is not a file"):
        read_text(tmp_path, 10)
    (tmp_path / "big").write_bytes(b"x" * 11)
    with pytest.raises(InputError, match="11 bytes, more than the 10"):
        read_text(tmp_path / "big", 10)
    (tmp_path / "latin").write_bytes(b"a\nb\xe9")
    with pytest.raises(InputError, match="line 2: not UTF-8"):
        read_text(tmp_path / "latin", 10)


def test_byte_order_mark_and_windows_line_ends_are_read(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(b'\xef\xbb\xbfformat = "freeswing-robot/1"\r\nname = "a"\r\n')
    assert load_toml(path, "robot") == {"name": "a"}


def test_dump_and_load_agree(tmp_path):
    dump_toml(tmp_path / "a.toml", {"format": "freeswing-robot/1", "x": [0.1, 2.0]})
    assert load_toml(tmp_path / "a.toml", "robot") == {"x": [0.1, 2.0]}


@pytest.mark.parametrize("bad", ["/etc/passwd", "../x", "a/../../x", "C:\\x", "", " ", "a\0b"])
def test_paths_stay_inside(tmp_path, bad):
    with pytest.raises(InputError, match="mesh: "):
        inside(tmp_path, bad, "mesh")


def test_links_out_of_the_folder_are_refused(tmp_path):
    folder = tmp_path / "session"
    folder.mkdir()
    (folder / "out").symlink_to(tmp_path)
    with pytest.raises(InputError, match="leads out of"):
        inside(folder, "out/robot.toml")
    assert inside(folder, "runs/../a.csv").resolve() == (folder / "a.csv").resolve()


def read(values):
    problems = Problems()
    return Reader(values, problems, "t"), problems


@pytest.mark.parametrize(
    "value", [True, "1", None, [1.0], float("nan"), float("inf"), 10**400, 1e300]
)
def test_what_is_not_a_finite_number_is_recorded(value):
    reader, problems = read({"a": value})
    assert np.isnan(reader.number("a"))
    assert problems.lines[0].startswith("t.a: "), problems.lines


def test_whole_numbers_are_numbers_and_limits_are_told():
    reader, problems = read({"a": 2, "b": -1, "c": 0.0, "d": 5.0})
    assert reader.number("a") == 2.0
    reader.number("b", minimum=0.0)
    reader.number("c", above=0.0)
    reader.number("d", maximum=4.0)
    assert problems.lines == ("t.b: -1 must be >= 0", "t.c: 0 must be > 0", "t.d: 5 must be <= 4")


def test_every_problem_is_recorded_at_once():
    reader, problems = read({"v": [1.0, "x"], "u": [1.0, 1.0, 0.0], "s": "", "k": 1.5, "z": 1})
    reader.vector("v", 3)
    reader.unit_vector("u")
    reader.string("s")
    reader.integer("k")
    reader.strings("names")
    reader.children("cables")
    reader.finish()
    with pytest.raises(InputError) as caught:
        problems.raise_if_any("f.toml")
    for part in ("t.v: 2 entries", "t.u: its length is 1.41", "t.s", "t.k", "t.names", "t.cables"):
        assert part in str(caught.value), part
    assert "t.z: unknown key" in str(caught.value)
    assert str(caught.value).startswith("f.toml: 7 problems")
