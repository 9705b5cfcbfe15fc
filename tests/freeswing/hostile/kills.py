"""Commands killed at random moments: the next one gives the same bytes and leaves nothing behind.

    python -m tests.freeswing.hostile.kills               # 50 kills over all stages
    python -m tests.freeswing.hostile.kills track report  # of these alone

Each stage is run once in peace, then killed again and again into one results folder at moments
drawn from its duration, and at last let run. Exit status 1 names what differs, what draft was left
and what process lived on.
"""

from __future__ import annotations

import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from freeswing.cdpr.system.drafts import is_draft
from tests.places import SAMPLES
from tests.vision.loops import small_cameras, write_looped_session

# What a format says of the clock.
CLOCK = {"homing.json": re.compile(rb'"seconds": [^,\n]*')}
MOST_ANEW = 20
LIVES_ON_S = 5.0  # workers look for their parent twice a second


@dataclass(frozen=True)
class Stage:
    """A command that is killed.

    Attributes:
        name: as it is asked for.
        session: sample folder, or `looped` for a film.
        words: the command, its flags after the session.
        kills: how often.
        before: commands whose results it needs.
    """

    name: str
    session: str
    words: tuple[str, ...]
    kills: int
    before: tuple[tuple[str, ...], ...] = ()


STAGES = (
    Stage("check", "three-cables", ("check",), 4),
    Stage("calibrate", "filmed", ("calibrate",), 5),
    Stage("track", "looped", ("track", "--workers", "2"), 10),
    Stage("overlay", "looped", ("track", "--workers", "1", "--overlay"), 4, (("track",),)),
    Stage("identify", "three-cables", ("identify",), 8),
    Stage(
        "diagnose",
        "three-cables",
        ("diagnose", "--only", "translational_drag", "--workers", "2"),
        6,
        (("identify",),),
    ),
    Stage("report", "three-cables", ("report",), 4, (("identify",),)),
    Stage("export", "three-cables", ("export", "--urdf", "--mass-kg", "3"), 3, (("identify",),)),
    Stage("board", "filmed", ("board", "--format", "pdf", "--format", "png"), 3),
    Stage("home", "homing", ("home",), 3),
)


def cut_short(path: Path) -> None:
    """Keeps three runs to identify from and one to check by: the stages are the same."""
    if not path.is_file():
        return
    head, *runs = path.read_text(encoding="utf-8").split("[[runs]]")
    fitted = [run for run in runs if 'role = "identify"' in run][:3]
    checked = [run for run in runs if 'role = "validate"' in run][:1]
    path.write_text("[[runs]]".join([head, *fitted, *checked]), encoding="utf-8")


def words_of(words: tuple[str, ...], session: Path, results: Path) -> list[str]:
    command, *flags = words
    start = [sys.executable, "-m", "freeswing", command, str(session), "--quiet"]
    return [*start, "--results", str(results), *flags]


def files_of(folder: Path) -> dict[str, bytes]:
    """All that is in a results folder."""
    found = sorted(path for path in folder.rglob("*") if path.is_file())
    told = {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}
    return {n: CLOCK[n].sub(b"", data) if n in CLOCK else data for n, data in told.items()}


def survivors(session_id: int) -> list[str]:
    """Processes of a killed command that still live."""
    listed = subprocess.run(
        ["ps", "-eo", "sid=,stat=,pid=,args="], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    rows = [line.split(None, 3) for line in listed]
    return [" ".join(row[2:]) for row in rows if row[0] == str(session_id) and row[1][0] != "Z"]


def killed(words: list[str], after_s: float) -> tuple[bool, list[str]]:
    """Starts a command and kills it; whether it was still at work, and who lives on."""
    with subprocess.Popen(
        words, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        try:
            process.wait(after_s)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
    until = time.monotonic() + LIVES_ON_S
    while (left := survivors(process.pid)) and time.monotonic() < until:
        time.sleep(0.1)
    return process.returncode == -signal.SIGKILL, left


def whole_run(words: list[str]) -> float:
    """Seconds that a command takes in peace."""
    begun = time.monotonic()
    subprocess.run(words, check=True, capture_output=True)
    return time.monotonic() - begun


def differences(peace: Path, war: Path) -> list[str]:
    """Which files of two results folders are not the same."""
    one, other = files_of(peace), files_of(war)
    wrong = [f"{name} differs" for name in sorted(one) if other.get(name) != one[name]]
    return wrong + [f"{name} is left" for name in sorted(set(other) - set(one))]


def wrong_with(stage: Stage, session: Path, folder: Path, chance: random.Random) -> list[str]:
    """What a stage's kills left wrong; a command that ends before its kill begins anew."""
    begin, peace, war = folder / "begin", folder / "peace", folder / "war"
    begin.mkdir(parents=True)
    for words in stage.before:
        whole_run(words_of(words, session, begin))
    shutil.copytree(begin, peace)
    lasts = whole_run(words_of(stage.words, session, peace))
    wrong, hits, drafts, anew = [], 0, 0, 0
    shutil.copytree(begin, war)
    while hits < stage.kills and anew < MOST_ANEW:
        begun = time.monotonic()
        after_s = chance.uniform(0.0, lasts)
        was_at_work, left = killed(words_of(stage.words, session, war), after_s)
        wrong += [f"kill {hits + 1}: {line} lives on" for line in left]
        drafts += sum(is_draft(path.name) for path in war.rglob("*"))
        hits += was_at_work
        if not was_at_work:
            lasts = min(lasts, time.monotonic() - begun)
            wrong += differences(peace, war)
            shutil.rmtree(war)
            shutil.copytree(begin, war)
            anew += 1
    whole_run(words_of(stage.words, session, war))
    wrong += differences(peace, war)
    print(  # noqa: T201
        f"{stage.name:10} {hits:2} killed at work, {drafts} drafts met, {1 + anew} times whole, "
        f"{len(files_of(peace)):3} files, {lasts:5.1f} s: {len(wrong)} wrong",
        *wrong,
        sep="\n    ",
        flush=True,
    )
    return wrong


def main() -> int:
    asked = sys.argv[1:]
    stages = [stage for stage in STAGES if not asked or stage.name in asked]
    chance, wrong = random.Random(22), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for stage in stages:
            session = folder / "sessions" / stage.session
            if stage.session == "looped" and not session.exists():
                write_looped_session(session, small_cameras(2), 450)
            elif not session.exists():
                shutil.copytree(SAMPLES / stage.session, session)
                cut_short(session / "session.toml")
            wrong += wrong_with(stage, session, folder / stage.name, chance)
    print(f"{sum(stage.kills for stage in stages)} kills: {len(wrong)} wrong")  # noqa: T201
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
