"""This machine's processor, as LLVM compiles for it."""

from __future__ import annotations

from functools import cache
from typing import Any

import llvmlite.binding as llvm


def engine_of(text: str, optimised: int) -> Any:
    """Machine code of a module; it lives as long as the engine does.

    Args:
        text: in LLVM's intermediate language.
        optimised: LLVM's level, 0 to 3.
    """
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), _machine(optimised))
    engine.finalize_object()
    return engine


@cache
def _initialised() -> None:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()


def _machine(optimised: int) -> Any:
    """A description of this processor; an engine owns its own, and frees it."""
    _initialised()
    features = llvm.get_host_cpu_features().flatten()
    cpu = llvm.get_host_cpu_name()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=cpu, features=features, opt=optimised)
