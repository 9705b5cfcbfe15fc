"""The package among a user's own files: nothing in the working folder is taken for a part of it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from tests.places import ROOT

FLOORS = ("calib", "cdpr", "excite", "freeswing", "homing", "ident", "servo", "vision")
OWN_NAMES = tuple(name for name in FLOORS if name != "freeswing")
EVERY_MODULE = """
import importlib, pkgutil, sys
import freeswing
names = [m.name for m in pkgutil.walk_packages(freeswing.__path__, "freeswing.")]
names = [name for name in names if not name.endswith("__main__")]
for name in names:
    importlib.import_module(name)
print(len(names), freeswing.__file__)
print(sorted(set(sys.modules) & set(sys.argv[1:])))
"""


@pytest.fixture
def own_files(tmp_path: Path) -> Path:
    """A working folder whose modules are called like the rooms of the house, and must stay out."""
    folder = tmp_path / "mine"
    folder.mkdir()
    for name in OWN_NAMES:
        (folder / f"{name}.py").write_text(
            f"raise SystemExit('the user\\'s own {name}.py was imported')\n", encoding="utf-8"
        )
    return folder


def run(python: str | Path, words: list[str], folder: Path, path: str = ""):
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    if path:
        environment["PYTHONPATH"] = path
    return subprocess.run(
        [str(python), *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_ones_own_modules_do_not_break_the_command(own_files: Path) -> None:
    done = run(sys.executable, ["-m", "freeswing", "--help"], own_files, str(ROOT))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "usage: freeswing" in done.stdout, done.stdout


def test_ones_own_modules_are_never_imported(own_files: Path) -> None:
    words = ["-c", EVERY_MODULE, *OWN_NAMES]
    done = run(sys.executable, words, own_files, str(ROOT))
    assert done.returncode == 0, done.stdout + done.stderr
    told, top_level = done.stdout.splitlines()
    assert int(told.split()[0]) > 250, told
    assert top_level == "[]", f"imported from the top: {top_level}"


def test_a_checkout_without_symbolic_links_says_so(tmp_path: Path) -> None:
    """As git leaves it where links are not allowed: small files that hold the links' targets."""
    package = tmp_path / "freeswing"
    package.mkdir()
    shutil.copy(ROOT / "freeswing" / "__init__.py", package)
    (package / "cdpr").write_text("../cdpr", encoding="utf-8")
    done = run(sys.executable, ["-c", "import freeswing"], tmp_path, str(tmp_path))
    assert done.returncode == 1, done.stdout
    assert "git config core.symlinks true" in done.stderr, done.stderr


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel built from a copy of what git holds, so that nothing is left in the tree."""
    folder = tmp_path_factory.mktemp("wheel")
    copy = folder / "copy"
    for name in (*FLOORS, "pyproject.toml", "README.md", "LICENSE"):
        source = ROOT / name
        if source.is_dir():
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(source, copy / name, symlinks=True, ignore=ignored)
        else:
            shutil.copy(source, copy / name)
    words = ["-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(folder), str(copy)]
    done = run(sys.executable, words, folder)
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("*.whl")
    return built


@pytest.mark.slow
def test_the_wheel_holds_each_module_once_below_one_name(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"freeswing"}, tops
    modules = {name for name in names if name.endswith(".py")}
    here = {
        path.relative_to(ROOT).as_posix()
        for floor in FLOORS
        for path in (ROOT / floor).rglob("*.py")
    }
    expected = {p if p.startswith("freeswing/") else f"freeswing/{p}" for p in here}
    assert modules == expected, modules ^ expected
    assert "freeswing/py.typed" in names, "all below one name carry types by it"
    assert any(name.endswith("report/page.html") or name.endswith(".css") for name in names), names


@pytest.mark.slow
def test_an_installed_wheel_works_beside_ones_own_modules(
    wheel: Path, own_files: Path, tmp_path: Path
) -> None:
    """An empty environment that borrows the dependencies alone from this one."""
    home = tmp_path / "environment"
    done = run(sys.executable, ["-m", "venv", str(home)], tmp_path)
    assert done.returncode == 0, done.stderr
    python = home / ("Scripts" if os.name == "nt" else "bin") / "python"
    done = run(python, ["-m", "pip", "install", "--quiet", "--no-deps", str(wheel)], tmp_path)
    assert done.returncode == 0, done.stderr
    site = run(python, ["-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], tmp_path)
    borrowed = sysconfig.get_path("purelib")
    (Path(site.stdout.strip()) / "borrowed.pth").write_text(f"{borrowed}\n", encoding="utf-8")
    done = run(python, ["-m", "freeswing", "--help"], own_files)
    assert done.returncode == 0, done.stdout + done.stderr
    done = run(python, ["-c", EVERY_MODULE, *OWN_NAMES], own_files)
    assert done.returncode == 0, done.stdout + done.stderr
    told, top_level = done.stdout.splitlines()
    assert str(home) in told, f"not the installed one: {told}"
    assert top_level == "[]", f"imported from the top: {top_level}"
    robot, swing = ROOT / "samples" / "undeclared-drag" / "robot.toml", own_files / "swing.csv"
    words = ["-m", "freeswing", "simulate", str(robot), str(swing), "--duration-s", "1"]
    done = run(python, [*words, "--lengths-m", "1.3,1.26,1.57,1.56"], own_files)
    assert done.returncode == 0, done.stdout + done.stderr
    assert swing.is_file()
