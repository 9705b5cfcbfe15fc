"""doctor, completion, colours, and a machine's words from every command."""

from __future__ import annotations

import inspect
import io
import json
import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from numba.core import config

from freeswing.cdpr.compiled import kernels
from freeswing.cdpr.compiled.kernels import SUFFIX
from freeswing.console import _write, has_colours
from freeswing.doctor import machine
from freeswing.doctor.kept_kernels import _kept, kernel_findings
from freeswing.main import COMMANDS, main
from tests.places import ROOT


def test_the_machine_that_runs_the_tests_is_fit(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["format"] == "freeswing-doctor/1"
    told = {one["subject"]: one for one in document["findings"]}
    assert {"python", "numpy", "codecs", "cores", "memory", "kernels"} <= set(told)
    assert [one for one in document["findings"] if one["level"] == "error"] == []
    assert "h264" in json.dumps(document)


def test_what_is_missing_is_an_error_with_its_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(machine, "NEEDED", {"numpy-of-nowhere": "numpy_of_nowhere"})
    monkeypatch.setattr(machine, "READ", ("h264", "film_of_nowhere"))
    assert main(["doctor"]) == 1
    said = capsys.readouterr()
    assert "pip install numpy-of-nowhere" in said.out
    assert "cannot read film_of_nowhere" in said.out
    assert "not usable here: numpy-of-nowhere" in said.err


@pytest.mark.parametrize(("size_gb", "level"), [(1.99, "warning"), (2.01, "note")])
def test_memory_from_both_sides(
    monkeypatch: pytest.MonkeyPatch, size_gb: float, level: str
) -> None:
    told = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": round(size_gb * 1e9 / 4096)}
    monkeypatch.setattr(machine.os, "sysconf", told.__getitem__)
    assert machine._memory().level == level


def test_kernels_that_cannot_be_kept_are_said(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    assert _kept(False).text.startswith("0 compiled ones")
    (tmp_path / "kernels" / f"one{SUFFIX}").write_bytes(b"")
    assert _kept(False).text.startswith("1 compiled ones")
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "kernels" / f"one{SUFFIX}"))
    assert _kept(False).level == "warning"


def test_kernels_that_came_ready_are_said_with_why_they_are_not_used(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def told() -> str:
        return next(kernel_findings()).sentence()

    monkeypatch.setattr(kernels, "READY", tmp_path)
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setattr(kernels, "levels_here", lambda: ("x86-64-v3",))
    assert "none came" in told()
    (tmp_path / f"one-0-elsewhere-1{SUFFIX}").write_bytes(b"")
    assert "other versions" in told()
    (tmp_path / f"two-0-{kernels._around()}-1{SUFFIX}").write_bytes(b"")
    assert told() == "kernels that are ready: 2 came with the program (0.0 MB)"
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    assert "NUMBA_CACHE_DIR" in told()
    monkeypatch.setattr(kernels, "levels_here", lambda: ())
    assert "x86-64-v3" in told()


def test_a_cluster_that_is_not_there_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("distributed")
    assert main(["doctor", "--cluster", "nowhere"]) == 1
    assert re.search(r"error +cluster: .*nowhere", capsys.readouterr().out)


BASH = shutil.which("bash")


@pytest.mark.skipif(BASH is None, reason="bash is not installed")
@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        (["dia"], "diagnose"),
        (["identify", "--weigh"], "--weighting"),
        (["new", "x", "--kind", "tri"], "trifilar"),
    ],
)
def test_bash_completes(typed: list[str], offered: str, tmp_path: Path) -> None:
    script = tmp_path / "complete.bash"
    done = subprocess.run(
        [sys.executable, "-m", "freeswing", "completion", "bash"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    script.write_text(done.stdout, encoding="utf-8")
    words = " ".join(["freeswing", *typed])
    code = (
        f"source {script}; COMP_WORDS=({words}); COMP_CWORD={len(typed)}; "
        '$(complete -p freeswing | sed "s/.*-F \\([^ ]*\\) .*/\\1/"); echo "${COMPREPLY[@]}"'
    )
    shown = subprocess.run(
        [str(BASH), "--norc", "-c", code], capture_output=True, text=True, check=True
    )
    assert offered in shown.stdout.split(), (shown.stdout, shown.stderr)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_colours_are_for_terminals_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    pipe, terminal = io.StringIO(), Terminal()
    for stream in (pipe, terminal):
        _write(stream, "error   run a: [late] by 3 ms", "bold red")
    assert pipe.getvalue() == "error   run a: [late] by 3 ms\n"
    assert "\x1b[1;31merror" in terminal.getvalue()
    assert "[late] by 3 ms" in terminal.getvalue()
    monkeypatch.setenv("NO_COLOR", "1")
    assert not has_colours(terminal)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_speaks_json(name: str) -> None:
    source = inspect.getsource(import_module(f"freeswing.commands.{COMMANDS[name]}.{name}"))
    assert "say_json(" in source or "show_file(" in source, name


def test_the_pages_name_what_a_shell_needs() -> None:
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert 'eval "$(freeswing completion bash)"' in text
    assert os.linesep in text
