import numpy as np
import pytest

from freeswing.cdpr.measured.slow_errors import SlowErrors
from freeswing.cdpr.measured.trajectory import Trajectory


def test_a_trajectory_keeps_its_slow_errors_in_every_part_of_it():
    slow = SlowErrors(np.eye(6), 0.5 * np.eye(6), 2.0)
    poses = np.zeros((20, 3)), np.broadcast_to(np.eye(3), (20, 3, 3))
    whole = Trajectory.from_poses(np.arange(20.0), *poses, slow=slow)
    for part in (whole, whole.window(2.0, 9.0), whole.take(np.arange(5)), whole.select(("x", "y"))):
        assert part.slow is slow


@pytest.mark.parametrize("wrong", [{"frame_covariance": np.eye(3)}, {"correlation_s": -1.0}])
def test_slow_errors_of_another_shape_or_time_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        SlowErrors(**({"frame_covariance": np.eye(6), "drift_covariance": np.eye(6)} | wrong))
