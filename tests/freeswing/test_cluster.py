"""Work handed to a Dask cluster: the same results to the byte, and plain words without one."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.main import main
from freeswing.workers import cluster as front
from tests.places import SAMPLES

if TYPE_CHECKING:
    from distributed import LocalCluster

NOBODY = "tcp://127.0.0.1:9"


def local_cluster(n_workers: int) -> LocalCluster:
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    return distributed.LocalCluster(
        n_workers=n_workers, threads_per_worker=1, dashboard_address=":0"
    )


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A scheduler with two workers, processes of this machine."""
    with local_cluster(2) as cluster:
        yield cluster.scheduler_address


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The filmed sample with its true cameras, so that nothing has to be calibrated."""
    folder = tmp_path_factory.mktemp("cluster") / "filmed"
    shutil.copytree(SAMPLES / "filmed", folder)
    shutil.copy(folder / "truth" / "cameras.toml", folder / "cameras.toml")
    return folder


def files_of(folder: Path) -> dict[str, bytes]:
    """What a command left behind; pieces are kept by the time stamps of a copy and left out."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and ".sightings" not in path.parts
    }


def run_both_ways(words: list[str], results: tuple[Path, Path], address: str) -> None:
    here, there = results
    assert main([*words, "--results", str(here), "--quiet", "--workers", "1"]) == 0
    assert main([*words, "--results", str(there), "--quiet", "--cluster", address]) == 0
    assert files_of(there) == files_of(here)


@pytest.mark.slow
def test_one_run_is_tracked_the_same(calibrated: Path, tmp_path: Path, address: str) -> None:
    text = (calibrated / "session.toml").read_text(encoding="utf-8")
    head, first, *_ = text.split("[[runs]]")
    (calibrated / "one.toml").write_text(f"{head}[[runs]]{first}", encoding="utf-8")
    both = (tmp_path / "here", tmp_path / "there")
    run_both_ways(["track", str(calibrated / "one.toml"), "--trust-cameras"], both, address)
    assert "tracks/swing-01.csv" in files_of(both[1])


@pytest.mark.slow
def test_a_session_is_tracked_and_diagnosed_the_same(
    calibrated: Path, tmp_path: Path, address: str
) -> None:
    both = (tmp_path / "here", tmp_path / "there")
    run_both_ways(["track", str(calibrated)], both, address)
    only = [word for name in ("translational_drag", "tether") for word in ("--only", name)]
    run_both_ways(["diagnose", str(calibrated), *only], both, address)
    assert "diagnosis.json" in files_of(both[1])


def test_nobody_answers(
    session: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(front, "ANSWER_WITHIN_S", 0.3)
    assert main(["run", str(session), "--cluster", NOBODY]) == 2
    said = capsys.readouterr().err
    assert "no Dask scheduler answers there within 0.3 s" in said
    assert said.count("\n") == 1, said


@pytest.mark.parametrize("address", ["nowhere", "http://x:1", ":::"])
def test_what_is_no_address(
    session: Path,
    address: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(front, "ANSWER_WITHIN_S", 0.3)
    assert main(["diagnose", str(session), "--cluster", address]) == 2
    assert f"--cluster {address}: no Dask scheduler" in capsys.readouterr().err


def test_dask_is_absent(
    session: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["diagnose", str(session), "--cluster", NOBODY]) == 2
    assert "pip install 'freeswing[cluster]'" in capsys.readouterr().err


def test_a_scheduler_without_workers(session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with local_cluster(0) as cluster:
        assert main(["diagnose", str(session), "--cluster", cluster.scheduler_address]) == 2
    assert "the scheduler has no workers" in capsys.readouterr().err


def test_workers_that_do_not_see_the_session(address: str, tmp_path: Path) -> None:
    with (
        pytest.raises(ValueError, match=r"cannot read .*elsewhere; the session has to lie in"),
        front.connected(address, tmp_path / "elsewhere", tmp_path),
    ):
        pytest.fail("the cluster was taken")


def test_workers_that_are_lost(address: str, tmp_path: Path) -> None:
    from concurrent.futures import CancelledError

    with (
        pytest.raises(DataError, match="its workers were lost in the middle"),
        front.connected(address, tmp_path, tmp_path),
    ):
        raise CancelledError
