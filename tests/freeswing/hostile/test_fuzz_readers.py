"""Every reader of files on damaged ones: a result or a sentence, never another exception."""

from __future__ import annotations

import copy
import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.files.trajectory_files import (
    read_recording,
    write_c3d,
)
from freeswing.report.material import read_material
from freeswing.report.page import render_page
from tests.freeswing.hostile.hostile_files import broken
from tests.freeswing.hostile.text_files import CAMERA_FILES, Case, text_cases
from tests.freeswing.report.report_material import whole_material
from tests.places import SAMPLES

EXAMPLES = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
KINDS = (
    *("robot", "target", "homing", "readings", "stamps", "board", "covariance", "csv", "trc"),
    "cameras",
    *CAMERA_FILES,
    *(f"{kind}, told" for kind in CAMERA_FILES),
    "colmap cameras.txt",
    "colmap images.txt",
)


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Case]:
    return text_cases(tmp_path_factory.mktemp("whole"))


def read_or_refuse(path: Path, case: Case) -> None:
    """Reads; an error must be one of the two that a user can cause, and say something."""
    said = "nothing was wrong"
    try:
        case.read(path)
    except (InputError, DataError) as error:
        said = str(error)
    assert 10 < len(said) < 20_000, f"{len(said)} letters: {said[:100]}"


@pytest.mark.parametrize("kind", KINDS)
def test_text_files(kind: str, cases: dict[str, Case], tmp_path: Path) -> None:
    case = cases[kind]
    for other in case.beside:
        shutil.copy(other, tmp_path / other.name)
    path = tmp_path / case.name
    path.write_bytes(case.data)
    case.read(path)  # the file is right before anything is done to it

    @EXAMPLES
    @given(broken(case.data))
    def vandalised(data: bytes) -> None:
        path.write_bytes(data)
        read_or_refuse(path, case)

    vandalised()


DEEP = 100_000
BOMBS = {
    "kalibr": b"cam0:\n  resolution: [1, 1]\n  intrinsics: " + b"[" * DEEP,
    "ros": b"camera_matrix: " + b"{a: " * DEEP,
    "anipose": b"distortions = " + b"[" * DEEP,
    "qualisys": b"<calibration>" + b"<a>" * DEEP,
    "covariance": b'{"format": "freeswing-calibration/1", "covariance": ' + b"[" * DEEP,
    "board": b"target_type: " + b"[" * DEEP,
}
LAUGHS = b"".join(b"a%d: &a%d [*a%d, *a%d]\n" % (k, k, k - 1, k - 1) for k in range(1, 40))


@pytest.mark.parametrize("kind", BOMBS)
def test_what_is_nested_without_end(kind: str, cases: dict[str, Case], tmp_path: Path) -> None:
    path = tmp_path / cases[kind].name
    path.write_bytes(BOMBS[kind])
    read_or_refuse(path, cases[kind])


@pytest.mark.parametrize("kind", ["kalibr", "ros"])
def test_yaml_that_explodes(kind: str, cases: dict[str, Case], tmp_path: Path) -> None:
    path = tmp_path / cases[kind].name
    keys = {"kalibr": b"intrinsics", "ros": b"camera_matrix"}
    inside = b"cam0:\n  resolution: [1, 1]\n  " if kind == "kalibr" else b""
    path.write_bytes(b"a0: &a0 [1, 1]\n" + LAUGHS + inside + keys[kind] + b": *a39\n")
    with pytest.raises(InputError, match="alias"):
        cases[kind].read(path)


def test_xml_that_explodes(cases: dict[str, Case], tmp_path: Path) -> None:
    path = tmp_path / "rig.qca.txt"
    path.write_bytes(b'<!DOCTYPE x [<!ENTITY a "aaaa">]><calibration>&a;</calibration>')
    with pytest.raises(InputError, match="document type"):
        cases["qualisys"].read(path)


def c3d_file(folder: Path) -> bytes:
    recording = read_recording(SAMPLES / "mocap-trc" / "runs" / "swing-01.trc")
    write_c3d(folder / "whole.c3d", recording)
    return (folder / "whole.c3d").read_bytes()


def test_c3d_files(tmp_path: Path) -> None:
    whole = c3d_file(tmp_path)
    case = Case("a.c3d", whole, read_recording)
    path = tmp_path / "a.c3d"

    @EXAMPLES
    @given(st.integers(0, 4000), st.binary(min_size=1, max_size=6), st.integers(0, len(whole)))
    def vandalised(place: int, piece: bytes, kept: int) -> None:
        path.write_bytes((whole[:place] + piece + whole[place + len(piece) :])[: max(kept, 600)])
        read_or_refuse(path, case)

    vandalised()


JUNK = st.sampled_from([None, True, -1, 1e308, "", "x", [], {}, [None], {"a": 1}, [[1, "b"]]])


@pytest.mark.filterwarnings("ignore::RuntimeWarning", "ignore::UserWarning")
@settings(EXAMPLES, max_examples=5)
@given(st.data())
def test_results_that_the_report_reads(tmp_path: Path, data: st.DataObject) -> None:
    """Values anywhere in a result file replaced by others: a page, or which file is wrong."""
    material = whole_material()
    results = tmp_path / "results"
    shutil.rmtree(results, ignore_errors=True)
    results.mkdir()
    for kind in ("calibration", "tracking", "identification", "diagnosis"):
        document = json.loads(json.dumps(getattr(material, kind).to_json()))
        for _ in range(data.draw(st.integers(0, 2))):
            _replace_somewhere(document, data)
        (results / f"{kind}.json").write_text(json.dumps(document), encoding="utf-8")
    try:
        told = render_page(read_material("fuzzed", results))
    except InputError as error:
        told = str(error)
    assert re.search(r"</html>\s*$|\.json", told), told[-200:]


def _replace_somewhere(document: Any, data: st.DataObject) -> None:
    """Goes down at random and puts something else there, or leaves the key out."""
    while True:
        keys = list(document) if isinstance(document, dict) else list(range(len(document)))
        if isinstance(document, dict):
            keys = [key for key in keys if key != "format"]
        if not keys:
            return
        key = data.draw(st.sampled_from(keys))
        child = document[key]
        if isinstance(child, dict | list) and child and data.draw(st.booleans()):
            document = child
            continue
        if isinstance(document, dict) and data.draw(st.booleans()):
            del document[key]
        else:
            document[key] = copy.deepcopy(data.draw(JUNK))
        return
