"""Kernels on the disk: never the code of another source, whatever else is changed or broken."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from numba.core import config
from numba.core.dispatcher import Dispatcher

from freeswing.cdpr.compiled import kernels
from freeswing.cdpr.compiled.contents import digest_of
from tests.places import ROOT

CALLED = """
from typing import NamedTuple
from freeswing.cdpr.compiled.kernels import kernel
GAIN = 2.0

class Pair(NamedTuple):
    first: float
    second: float

@kernel
def scaled(x):
    return GAIN * x
"""
CALLER = """
from freeswing.cdpr.compiled.kernels import kernel
from called import Pair, scaled

@kernel
def answer(x):
    pair = Pair(x, 10.0)
    return scaled(pair.first)
"""


@pytest.fixture
def kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """An empty folder for compiled kernels, and for nothing else."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "kept"))
    return tmp_path / "kept" / "kernels"


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    """Modules stay until the test's end: a kernel that is read from the disk asks for its own."""
    yield
    for name in ("called", "caller"):
        sys.modules.pop(name, None)


def imported(folder: Path, called: str = CALLED, caller: str = CALLER) -> ModuleType:
    """The caller's module, from files written anew to a folder."""
    folder.mkdir(exist_ok=True)
    for name, text in (("called", called), ("caller", caller)):
        path = folder / f"{name}.py"
        path.write_text(text, encoding="utf-8")
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        code = compile(
            text, str(path), "exec", dont_inherit=True
        )  # a file as old and as long as the last one
        exec(code, sys.modules[name].__dict__)
    return sys.modules["caller"]


def files(kept: Path) -> list[str]:
    return sorted(path.name for path in kept.glob(f"*{kernels.SUFFIX}"))


def hits(module: ModuleType) -> int:
    return sum(module.answer.stats.cache_hits.values())


def test_another_place_and_comment_is_the_same_kernel(kept: Path, tmp_path: Path) -> None:
    assert imported(tmp_path / "a").answer(3.0) == 6.0
    moved = imported(tmp_path / "b", f"# moved down\n{CALLED}", f"\n\n{CALLER}")
    assert moved.answer(3.0) == 6.0
    assert hits(moved) == 1
    assert len(files(kept)) == 2


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("GAIN = 2.0", "GAIN = 4.0", 12.0),
        ("GAIN * x", "GAIN + x", 5.0),
        ("first: float\n    second", "second: float\n    first", 20.0),
        ("@kernel", "@kernel(fastmath=True)", 6.0),
    ],
)
def test_what_is_called_from_another_file_has_changed(
    kept: Path, tmp_path: Path, old: str, new: str, told: float
) -> None:
    assert imported(tmp_path / "a").answer(3.0) == 6.0
    changed = imported(tmp_path / "a", CALLED.replace(old, new))
    assert changed.answer(3.0) == told
    assert hits(changed) == 0
    assert kept.is_dir()


def test_fields_of_an_argument_in_another_order(kept: Path, tmp_path: Path) -> None:
    caller = CALLER.replace("pair = Pair(x, 10.0)", "pair = x")
    module = imported(tmp_path / "a", CALLED, caller)
    assert module.answer(module.Pair(1.0, 5.0)) == 2.0
    turned = CALLED.replace("first: float\n    second", "second: float\n    first")
    changed = imported(tmp_path / "a", turned, caller)
    assert changed.answer(changed.Pair(1.0, 5.0)) == 10.0
    assert hits(changed) == 0
    assert kept.is_dir()


def test_a_value_changed_in_the_process_is_kept_nowhere(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = imported(tmp_path / "a")
    assert module.answer(3.0) == 6.0
    before = files(kept)
    monkeypatch.setitem(module.scaled.py_func.__globals__, "GAIN", 4.0)
    module.answer(3)
    assert files(kept) == before


def test_a_global_of_an_unknown_kind_is_kept_nowhere(kept: Path, tmp_path: Path) -> None:
    caller = CALLER.replace("@kernel", "OTHER = object()\n\n@kernel").replace(
        "(x):", "(x, o=OTHER):"
    )
    module = imported(tmp_path / "a", caller=caller)
    with pytest.raises(TypeError, match="object"):
        digest_of(module.answer)
    assert not kernels.is_kept(module.answer)
    assert not kept.exists()


def test_damaged_and_unwritable(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert imported(tmp_path / "a").answer(3.0) == 6.0
    for path in kept.glob(f"*{kernels.SUFFIX}"):
        path.write_bytes(path.read_bytes()[:-7] + b"damaged")
    again = imported(tmp_path / "a")
    assert again.answer(3.0) == 6.0
    assert hits(again) == 0
    assert kernels.is_kept(again.answer)
    (tmp_path / "file").touch()
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "file"))
    assert imported(tmp_path / "a").answer(3.0) == 6.0


PROGRAM = "import sys; sys.path.insert(0, sys.argv[1]); from caller import answer; " + (
    "print(answer(3.0), sum(answer.stats.cache_hits.values()))"
)


def started(folder: Path, **more: str) -> subprocess.Popen[str]:
    """Another process that calls the kernel and tells the answer and how often it was read."""
    told = {"NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_CACHE_DIR"}
    usual = {name: value for name, value in os.environ.items() if name not in told}
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(folder)],
        cwd=ROOT,
        env=usual | more,
        stdout=subprocess.PIPE,
        text=True,
    )


def test_two_processes_write_at_once(kept: Path, tmp_path: Path) -> None:
    imported(tmp_path / "a")
    there = {"NUMBA_CACHE_DIR": str(kept.parent)}
    both = [started(tmp_path / "a", **there) for _ in range(2)]
    said = Counter(process.communicate()[0] for process in both)
    assert said == {"6.0 0\n": 1, "6.0 1\n": 1}, "both have compiled it"
    assert len(files(kept)) == 2
    third = imported(tmp_path / "a")
    assert third.answer(3.0) == 6.0
    assert hits(third) == 1


@pytest.mark.skipif(not kernels.levels_here(), reason="another processor")
def test_what_comes_ready_is_read_and_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    imported(tmp_path / "a")
    made = {"NUMBA_CPU_NAME": kernels.levels_here()[-1], "NUMBA_CPU_FEATURES": ""}
    assert started(tmp_path / "a", NUMBA_CACHE_DIR=str(tmp_path), **made).communicate()[0]
    ready = tmp_path / "kernels"
    names = files(ready)
    ready.chmod(0o555)
    monkeypatch.setattr(kernels, "READY", ready)
    monkeypatch.setattr(kernels, "user_folder", lambda: tmp_path / "file" / "none")
    (tmp_path / "file").touch()
    monkeypatch.setattr(config, "CACHE_DIR", "")
    module = imported(tmp_path / "a")
    assert kernels.comes_ready()
    assert module.answer(3.0) == 6.0
    assert hits(module) == 1
    changed = imported(tmp_path / "a", CALLED.replace("GAIN = 2.0", "GAIN = 4.0"))
    assert changed.answer(3.0) == 12.0
    assert hits(changed) == 0
    monkeypatch.setattr(kernels, "levels_here", lambda: ())
    older = imported(tmp_path / "a")
    assert older.answer(3.0) == 6.0
    assert hits(older) == 0
    assert files(ready) == names


FLOORS = ("calib", "cdpr", "servo", "vision")


def test_every_kernel_of_the_program_can_be_kept() -> None:
    found = 0
    for path in sorted(path for floor in FLOORS for path in (ROOT / floor).rglob("*.py")):
        if "\n@kernel" not in path.read_text(encoding="utf-8"):
            continue
        name = ".".join(("freeswing", *path.relative_to(ROOT).with_suffix("").parts))
        module = importlib.import_module(name)
        for one in vars(module).values():
            if isinstance(one, Dispatcher):
                assert len(digest_of(one)) == 32
                assert isinstance(vars(one)["_cache"], kernels.Kept), one
                found += 1
    assert found > 100
