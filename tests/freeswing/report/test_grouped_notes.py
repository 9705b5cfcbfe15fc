"""Notes of one kind are one sentence, the largest stands for it, and no run is lost."""

from __future__ import annotations

from freeswing.report.grouped_notes import grouped

LOOSE = "marker {} is not rigid with the others: {} um; all agree to {} um; it is left out"


def test_one_kind_of_note_on_several_runs_is_one_sentence() -> None:
    notes = [
        "run a: " + LOOSE.format("M4", 138, 63),
        "run b: " + LOOSE.format("P", 755, 453),
        "run a: " + LOOSE.format("M1", 99, 63),
        "run b: " + LOOSE.format("M2", 120, 453),
        "free coordinates x, y do not settle the pose",
    ]
    told = grouped(notes)
    assert told == [
        f"run b: {LOOSE.format('P', 755, 453)} (the largest; alike: b again, a (2))",
        "free coordinates x, y do not settle the pose",
    ]


def test_times_are_no_sizes() -> None:
    told = grouped(
        f"run {run}: the sample at {time} s is {size} mrad off its neighbours in {axis}"
        for run, time, size, axis in (("a", 19.27, 31.7, "phi"), ("b", 2.6, 50.8, "chi"))
    )
    assert len(told) == 1
    assert told[0].startswith("run b: the sample at 2.6 s is 50.8 mrad")
    assert told[0].endswith("(the largest; alike: a)")


def test_different_notes_stay_apart_and_repeated_ones_are_told_once() -> None:
    notes = ["run a: its clock is late", "run b: its markers agree to 3 um", "it is cold"]
    assert grouped([*notes, *notes]) == notes
