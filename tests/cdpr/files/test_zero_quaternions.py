"""The quaternion 0 0 0 0, which programs write where the platform was not seen."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.signal_csv import read_signals
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.files.trajectory_tum import read_tum
from freeswing.cdpr.robot import POSE_COORDINATES


@pytest.mark.parametrize("suffix", ["csv", "tum"])
def test_a_quaternion_of_zeros_is_a_gap_and_all_of_them_an_error(tmp_path, suffix) -> None:
    sep = "," if suffix == "csv" else " "
    head = ["t_s,x_m,y_m,z_m,qw,qx,qy,qz"] if suffix == "csv" else []
    seen = ["1", "0", "0", "0"] if suffix == "csv" else ["0", "0", "0", "1"]
    rows = [[f"0.{k}", "1", "2", "3", *(seen if k != 2 else "0000")] for k in range(5)]
    path = tmp_path / f"run.{suffix}"
    load = read_trajectory if suffix == "csv" else read_tum
    path.write_text("\n".join([*head, *(sep.join(row) for row in rows)]))
    found = load(path)
    assert found.is_known.tolist() == [True, True, False, True, True]
    assert np.isnan(found.values[2]).all()
    line = 4 if suffix == "csv" else 3
    said = f"the quaternion 0 0 0 0 is taken as a gap in 1 sample, first in line {line}"
    assert found.notes == (said,)
    path.write_text("\n".join([*head, *(sep.join([*row[:4], *"0000"]) for row in rows)]))
    with pytest.raises(InputError, match="length is 0, must be 1"):
        load(path)


def test_a_bench_has_no_place_where_it_has_no_turn(tmp_path) -> None:
    """The channel beside it goes on."""
    rows = [["0.0", "1,2,3,1,0,0,0"], ["0.1", "0,0,0,0,0,0,0"], ["0.2", "1,2,3,,,,"]]
    head, path = "t_s,x_m,y_m,z_m,qw,qx,qy,qz,dot_px", tmp_path / "run.csv"
    path.write_text("\n".join([head, *(",".join([*row, "7"]) for row in rows)]))
    found = read_signals(path, ("dot_px",))
    poses = np.array([found.values[name] for name in POSE_COORDINATES])
    assert np.isfinite(poses).all(axis=0).tolist() == [True, False, False]
    assert np.isnan(poses[:, 1:]).all()
    assert found.values["dot_px"].tolist() == [7.0, 7.0, 7.0]
    assert found.notes == ("the quaternion 0 0 0 0 is taken as a gap in 1 sample, first in line 3",)
    path.write_text("\n".join([head, "0.0,1,2,3,0.9,0,0,0,7"]))
    with pytest.raises(InputError, match=r"line 2: the quaternion's length is 0\.9, must be 1"):
        read_signals(path, ("dot_px",))
