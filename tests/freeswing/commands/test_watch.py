"""A session that is watched: a new recording becomes a run, and the page shows it."""

from __future__ import annotations

import shutil
from argparse import Namespace
from pathlib import Path

import pytest

from freeswing.commands.session import watch
from freeswing.console import Console
from freeswing.main import build_parser, main
from freeswing.session.new_recordings import next_role, take_in
from freeswing.session.session_file import Session, read_session


def options(session: Path, *flags: str) -> Namespace:
    return build_parser().parse_args(["watch", str(session), *flags])


def watched(found: Namespace, steps: list, monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """What was redone, as the runs' names, while things happen between looks."""
    redone: list[list[str]] = []
    monkeypatch.setattr(
        watch, "_redo", lambda session, *_: redone.append([one.name for one in session.runs])
    )
    left = iter(steps)

    def wait() -> None:
        step = next(left, None)
        if step is None:
            raise KeyboardInterrupt
        step()

    seen = watch.Seen.of(read_session(found.session))
    with pytest.raises(KeyboardInterrupt):
        watch.follow(found, Console(quiet=True), wait, seen)
    return redone


def nothing() -> None:
    """A look at which nothing has happened."""


def test_a_new_recording_is_taken_once_it_is_whole(
    session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = session / "runs"
    whole = (runs / "swing-01.csv").read_bytes()
    steps = [
        nothing,
        lambda: (runs / "swing-02.csv").write_bytes(whole[:5000]),
        lambda: (runs / "swing-02.csv").write_bytes(whole),
        nothing,
        nothing,
    ]
    redone = watched(options(session), steps, monkeypatch)
    assert redone == [["swing-01", "check-01", "swing-02"]], "once, and only when it had settled"
    assert read_session(session).runs[-1].role == "identify"


def test_what_comes_while_it_computes_is_not_missed(
    session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A person goes on swinging while the page is made."""
    runs, redone = session / "runs", []

    def redo(opened: Session, *_: object) -> None:
        redone.append([run.name for run in opened.runs])
        if len(redone) == 1:
            shutil.copy(runs / "swing-01.csv", runs / "swing-03.csv")

    left = iter(["swing-02", *[None] * 6])

    def wait() -> None:
        name = next(left, "end")
        if name == "end":
            raise KeyboardInterrupt
        if name is not None:
            shutil.copy(runs / "swing-01.csv", runs / f"{name}.csv")

    monkeypatch.setattr(watch, "_redo", redo)
    seen = watch.Seen.of(read_session(session))
    with pytest.raises(KeyboardInterrupt):
        watch.follow(options(session), Console(quiet=True), wait, seen)
    assert redone == [
        ["swing-01", "check-01", "swing-02"],
        ["swing-01", "check-01", "swing-02", "swing-03"],
    ]


def test_without_adding_only_what_is_named_counts(
    session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = session / "runs"
    steps = [lambda: shutil.copy(runs / "swing-01.csv", runs / "swing-02.csv"), nothing, nothing]
    redone = watched(options(session, "--no-add"), steps, monkeypatch)
    assert redone == [["swing-01", "check-01"]]


def test_a_file_half_edited_is_waited_over(session: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = session / "session.toml"
    text = file.read_text(encoding="utf-8")
    steps = [
        lambda: file.write_text(text + "[[runs]]\n", encoding="utf-8"),
        nothing,
        lambda: file.write_text(text + "\n# done\n", encoding="utf-8"),
        nothing,
    ]
    assert watched(options(session), steps, monkeypatch) == [["swing-01", "check-01"]]


def test_films_wait_for_all_cameras(session: Path) -> None:
    folder = session / "runs"
    for run in ("filmed-01", "filmed-02"):
        (folder / run).mkdir()
    for name in ("left.mp4", "right.mp4"):
        (folder / "filmed-01" / name).write_bytes(b"x")
    (folder / "filmed-02" / "left.mp4").write_bytes(b"x")
    with (session / "session.toml").open("a", encoding="utf-8") as file:
        file.write('\n[[runs]]\nname = "f"\nrole = "identify"\nvideo = "runs/filmed-01"\n')
    assert take_in(read_session(session), [folder / "filmed-02"]) == []
    (folder / "filmed-02" / "right.mp4").write_bytes(b"x")
    assert take_in(read_session(session), [folder / "filmed-02"]) == ["filmed-02"]
    assert read_session(session).runs[-1].video == folder / "filmed-02"


def test_a_third_is_kept_apart() -> None:
    roles: list[str] = []
    for _ in range(9):
        roles.append(next_role(roles))
    assert roles.count("validate") == 3
    assert roles[:3] == ["identify", "identify", "validate"]


def test_the_page_reads_itself_anew_only_while_it_is_watched(
    session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page, seen = session / "results" / "report.html", []

    def stop(*_: object) -> None:
        seen.append("http-equiv" in page.read_text(encoding="utf-8"))
        raise KeyboardInterrupt

    monkeypatch.setattr(watch, "follow", stop)
    assert main(["watch", str(session), "--workers", "1", "--quiet"]) == 0
    assert seen == [True]
    assert "http-equiv" not in page.read_text(encoding="utf-8")
