"""What `diagnose` says of the directions in which a point is known."""

from freeswing.report.panels.ladder import seen_directions
from freeswing.results.common import SeenDirection


def test_best_and_worst_direction_of_each_point_are_told():
    def one(point, direction, std_m):
        return SeenDirection(point=point, direction=direction, std_m=std_m)

    told = seen_directions(
        (
            one("offset_2", (0.0, 0.6, 0.8), 3e-4),
            one("offset_2", (1.0, 0.0, 0.0), 1e-3),
            one("offset_2", (0.0, -0.8, 0.6), 6e-3),
        )
    )
    assert told == [
        "offset 2: known to 0.300 mm along (0.00, 0.60, 0.80), to 6.00 mm along (0.00, -0.80, 0.60)"
    ]
    assert seen_directions(()) == []
