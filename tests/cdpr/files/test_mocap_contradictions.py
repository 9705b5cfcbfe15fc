"""What a motion-capture export says of itself and does not hold, through `freeswing convert`."""

from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.mocap.text_exports import refuse_other_rate
from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.files.trajectory_files import read_recording
from freeswing.main import main
from tests.cdpr.files.test_mocap_exports import EXPORTS, PLACES, motive, qualisys, vicon

COUNTED = motive().replace("Length Units", "Total Exported Frames,2,Length Units")


def converted(folder: Path, name: str, text: str) -> int:
    (folder / name).write_text(text, encoding="utf-8")
    return main(["convert", str(folder / name), str(folder / "markers.trc")])


def german(text: str) -> str:
    return text.replace(",", ";").replace(".", ",")


HELD = {
    **EXPORTS,
    "counted.csv": COUNTED,
    "german.csv": german(motive()),
    "tabs.csv": vicon("\t"),
    "notes.csv": motive().replace("Take Name,T", 'Take Name,T,Take Notes,"high, fast"'),
}


@pytest.mark.parametrize("name", HELD)
def test_markers_of_each_program_are_converted(tmp_path: Path, name: str) -> None:
    assert converted(tmp_path, name, HELD[name]) == 0
    found = read_recording(tmp_path / "markers.trc")
    assert np.allclose(found.positions_m, PLACES, atol=1e-4)
    assert np.allclose(found.times_s[1] - found.times_s[0], 1.0 / 120.0, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("cut.csv", COUNTED.replace("Frames,2", "Frames,900"), "announces 900 frames, but 2 rows"),
        ("cut.tsv", qualisys().replace("FRAMES\t2", "FRAMES\t900"), "announces 900 frames"),
        ("space.csv", f"{motive()}".replace("Units,Meters", "Units,Meters,Coordinate Space,Local"),
         "Coordinate Space is 'Local'"),
        ("rate.tsv", qualisys().replace("FREQUENCY\t120", "FREQUENCY\t240"), "states 240 Hz"),
    ],
)  # fmt: skip
def test_what_a_header_contradicts_is_refused(tmp_path: Path, capsys, name, text, why) -> None:
    assert converted(tmp_path, name, text) == 2
    assert why in capsys.readouterr().err


def test_markers_too_far_apart_for_a_platform_are_said(tmp_path: Path, capsys) -> None:
    text = vicon().replace("mm", "m")
    assert converted(tmp_path, "vicon.csv", text) == 0
    assert "states another unit than its numbers have" in capsys.readouterr().err
    assert converted(tmp_path, "vicon.csv", vicon()) == 0
    assert not capsys.readouterr().err


@pytest.mark.parametrize(("seconds", "off"), [(1000.0, 1e-3), (0.2, 1e-3 + 2e-4 / 0.2)])
def test_times_are_held_to_the_rate_and_to_how_they_are_printed(seconds, off) -> None:
    """Four decimals of seconds count twice, at both ends."""
    times = np.linspace(0.0, seconds, 101)
    refuse_other_rate("a.csv", times, 100.0 / seconds / (1.0 + 0.94 * off))
    with pytest.raises(InputError, match="times step at"):
        refuse_other_rate("a.csv", times, 100.0 / seconds / (1.0 + 1.06 * off))


def test_frames_left_out_are_of_the_same_rate() -> None:
    times = np.delete(np.arange(100) / 50.0, [3, 4, 40])
    refuse_other_rate("a.csv", times, 50.0)
