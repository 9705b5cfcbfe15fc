"""How findings are told."""

import pytest

from freeswing.doctor.finding import counted, named_runs


@pytest.mark.parametrize(
    ("count", "told"), [(0, "0 findings"), (1, "1 finding"), (7, "7 findings")]
)
def test_findings_are_counted_as_one_says_it(count: int, told: str) -> None:
    assert counted(count) == told


def test_the_first_run_is_named_and_the_others_are_counted() -> None:
    assert named_runs(["a"]) == "run a"
    assert named_runs(["a", "b"]) == "run a (and 1 more run)"
    assert named_runs(["a", "b", "c"]) == "run a (and 2 more runs)"
