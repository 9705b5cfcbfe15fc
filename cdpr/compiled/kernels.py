"""Compiled functions that come ready, or are compiled once and kept by their content.

`@kernel` is `numba.njit` that releases the interpreter's lock, with a cache of its own. Numba's
lies beside each source file and knows that file alone: a clone, another environment or another
folder compiles all anew, and a change in a function that is called from another file goes unseen.
Here the machine code's name on the disk is a digest of all that goes into it
(`cdpr.compiled.contents`), of the arguments' types, the processor, and the versions of what
compiles. So files are never out of date, only unused; any number of environments share them.

Processes that want the same kernel at once take turns: one compiles it, the others read it.

They are looked for among those that come with the program (`docs/decisions/installing.md`), then in
the user's cache folder, where new ones are put.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core import config
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.misc.appdirs import user_cache_dir

from freeswing.cdpr.compiled.contents import Unreadable, digest_of, signature_digest
from freeswing.cdpr.system.drafts import draft_of

READY = Path(__file__).with_name("ready")
"""Kernels that came with the program, compiled for `LEVELS`."""
SUFFIX = ".kernel"
_CHECKED = hashlib.sha256().digest_size
# Levels of the x86-64 psABI, the best first, and what each demands beyond those after it.
LEVELS = {
    "x86-64-v4": "avx512bw avx512cd avx512dq avx512f avx512vl",
    "x86-64-v3": "avx avx2 bmi bmi2 cx16 f16c fma lzcnt movbe popcnt sahf sse3 sse4.1 sse4.2 ssse3"
    " xsave",
}
# What else of numba's settings changes the machine code.
_SETTINGS = (
    "BOUNDSCHECK",
    "DEBUGINFO_DEFAULT",
    "FULL_TRACEBACKS",
    "LLVM_REFPRUNE_FLAGS",
    "LLVM_REFPRUNE_PASS",
    "LOOP_VECTORIZE",
    "OPT",
    "SLP_VECTORIZE",
    "USING_SVML",
)


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """A function compiled at its first call, or read from the disk; numba's options beside.

    Source:
        Lam, Pitrou, Seibert 2015, Numba: a LLVM-based Python JIT compiler.
    """
    if function is None:
        return lambda one: kernel(one, **options)
    compiled: Any = numba.njit(nogil=True, **options)(function)
    if not config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue]
        compiled._cache = Kept(compiled)
        compiled.compile = _compiled_in_turn(compiled._cache, compiled.compile)
    return compiled


def _compiled_in_turn(kept: Kept, usual: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A dispatcher's `compile` that ends the turn which `Kept.load_overload` began."""

    def compiled(signature: Any) -> Any:
        try:
            return usual(signature)
        finally:
            kept.end_turns()

    return compiled


def user_folder() -> Path:
    """Where kernels compiled here are kept: in NUMBA_CACHE_DIR if set, else the user's cache."""
    told: str = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]
    return Path(told or user_cache_dir("freeswing", appauthor=False)) / "kernels"


def comes_ready() -> bool:
    """Whether this processor can run what came with the program, and nobody asked for other."""
    return not config.CACHE_DIR and READY.is_dir() and bool(levels_here())  # pyright: ignore[reportAttributeAccessIssue]


def made_for(path: Path) -> bool:
    """Whether a kernel's file was made by the same versions and settings as are here."""
    return path.name.split("-")[-2:-1] == [_around()]


def is_kept(compiled: Any) -> bool:
    """Whether machine code of a kernel as it now is lies on the disk, for any arguments."""
    try:
        pattern = f"{_stem(compiled, digest_of(compiled))}*{SUFFIX}"
    except Unreadable:
        return False
    return any(any(folder.glob(pattern)) for folder in (READY, user_folder()))


@cache
def surroundings() -> bytes:
    """What compiles, beside the function: versions and settings that change the machine code."""
    versions = (numba.__version__, llvmlite.__version__, np.__version__, sys.version_info[:2])
    abi = (sys.implementation.cache_tag, getattr(sys, "abiflags", ""))
    settings = [(name, getattr(config, name, None)) for name in _SETTINGS]
    return repr((versions, abi, settings)).encode()


@cache
def _around() -> str:
    return hashlib.sha256(surroundings()).hexdigest()[:8]


@cache
def levels_here() -> tuple[str, ...]:
    """Those of `LEVELS` whose code this processor can run, the best first."""
    features = llvm.get_host_cpu_features()
    has = {
        level: all(features.get(name, False) for name in needs.split())
        for level, needs in LEVELS.items()
    }
    names = tuple(LEVELS)
    return tuple(name for k, name in enumerate(names) if all(has[one] for one in names[k:]))


def _stem(compiled: Any, digest: bytes) -> str:
    function = compiled.py_func
    module = function.__module__.rpartition(".")[2]
    name = function.__qualname__.replace("<", "").replace(">", "")
    return f"{module}.{name}-{digest.hex()[:16]}-{_around()}-"


def _read(path: Path) -> bytes | None:
    """What `_write` wrote; None where that is absent or damaged."""
    try:
        whole = path.read_bytes()
    except OSError:
        return None
    data = whole[_CHECKED:]
    return data if hashlib.sha256(data).digest() == whole[:_CHECKED] else None


def _write(path: Path, data: bytes) -> None:
    """Keep data at a path, whole or not at all: what cannot be kept is compiled again."""
    with contextlib.suppress(OSError), draft_of(path) as file:
        file.write(hashlib.sha256(data).digest())
        file.write(data)


def _turn(folder: Path, name: str) -> list[tuple[int, int]]:
    """Waits until no other process compiles what has this name; the place that is held, if any.

    Whoever compiles holds what it is at, and then one by one what that calls: as no two kernels
    call each other, none waits in a circle.
    """
    turnstile = _turnstile(folder)
    if turnstile is None:
        return []
    import fcntl

    place = int(hashlib.sha256(name.encode()).hexdigest()[:12], 16)
    try:
        fcntl.lockf(turnstile, fcntl.LOCK_EX, 1, place)
    except OSError:
        return []  # some network disks know no locks: it is compiled beside the other one
    return [(turnstile, place)]


def _give_way(turnstile: int, place: int) -> None:
    import fcntl

    with contextlib.suppress(OSError):
        fcntl.lockf(turnstile, fcntl.LOCK_UN, 1, place)


@cache
def _turnstile(folder: Path) -> int | None:
    """A file whose bytes are locked, one for each name; open as long as the process."""
    if sys.platform == "win32":
        return None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return os.open(folder / "turns", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError:
        return None


@dataclass(frozen=True, slots=True)
class _Name:
    """The name of a kernel's file for this processor, and for levels that it can run."""

    here: str
    levels: list[str]


class Kept(_Cache):
    """A kernel's machine code on the disk, as numba's dispatchers ask for it."""

    def __init__(self, compiled: Any) -> None:
        self._compiled = compiled
        self._is_enabled = True
        self._turns: list[tuple[int, int]] = []

    @property
    def cache_path(self) -> str:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The folder that new ones are put into."""
        return str(user_folder())

    def enable(self) -> None:
        """Read and write."""
        self._is_enabled = True

    def disable(self) -> None:
        """Neither read nor write."""
        self._is_enabled = False

    def flush(self) -> None:
        """Nothing: a file of this content is right, or damaged and not read."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The machine code for a signature; None where there is none, and it is to be compiled."""
        target_context.refresh()
        name = self._name(sig, target_context.codegen().magic_tuple())
        if name is None:
            return None
        places = [READY / level for level in name.levels] if comes_ready() else []
        places.append(user_folder() / name.here)
        data = next(filter(None, map(_read, places)), None)
        if data is None:
            self._turns += _turn(user_folder(), name.here)
            data = _read(user_folder() / name.here)
        if data is None:
            return None
        return CompileResult._rebuild(target_context, *pickle.loads(data))

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        """Keep machine code that may be used in another process; where it cannot, it is not."""
        if data.library.has_dynamic_globals or any(not one.can_cache for one in data.lifted):
            return
        name = self._name(sig, data.codegen.magic_tuple())
        if name is not None:
            _write(user_folder() / name.here, dumps(data._reduce()))

    def end_turns(self) -> None:
        """Let other processes go on that want this kernel."""
        while self._turns:
            _give_way(*self._turns.pop())

    def _name(self, sig: Any, machine: tuple[str, ...]) -> _Name | None:
        if not self._is_enabled:
            return None
        arguments, _ = normalize_signature(sig)
        try:
            whole, types = digest_of(self._compiled), signature_digest(arguments)
        except Unreadable:
            return None
        stem = _stem(self._compiled, whole)
        machines = (machine, *((machine[0], level, "") for level in levels_here()))
        here, *levels = (
            hashlib.sha256(repr((whole, types, one, surroundings())).encode()).hexdigest()[:32]
            for one in machines
        )
        return _Name(f"{stem}{here}{SUFFIX}", [f"{stem}{level}{SUFFIX}" for level in levels])
