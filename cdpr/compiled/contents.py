"""What a compiled function is made of, as one digest: another digest, another machine code.

Numba compiles a function from its bytecode and from the values that its global names have at that
moment, and puts the functions that it calls into the same machine code. All of that is read here,
through every function that it calls in whatever module; texts of files, their places and times do
not matter. What cannot be read is refused, never left out.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic

# Their versions are a part of every key (`kernels.surroundings`).
KNOWN = ("builtins", "cmath", "llvmlite", "math", "numba", "numpy")
_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(Ellipsis), slice, range)
_PLAIN_TYPES = (
    types.Boolean,
    types.Number,
    types.NoneType,
    types.UnicodeType,
    types.Literal,
    types.SliceType,
    types.RangeType,
    types.Omitted,
    types.Array,
)


class Unreadable(TypeError):
    """A function depends on something that its digest could miss."""


def digest_of(kernel: Dispatcher) -> bytes:
    """Digest of a compiled function and of all that goes into its machine code, 32 bytes.

    Numba goes on with what it compiled first, whatever becomes of a global value afterwards: a
    function that has changed since it was first read in this process is refused.

    Raises:
        Unreadable: it has, or it uses a global value of a kind that is not read here.
    """
    whole = hashlib.sha256()
    kernels, places = [kernel], {id(kernel): 0}
    for one in kernels:  # which grow while they are read
        reader = _Reader()
        reader.kernel(one)
        own = reader.sum.digest()
        if _first.setdefault(one, own) != own:
            raise Unreadable(f"{one.py_func.__qualname__} has changed since it was compiled")
        whole.update(own)
        for called in reader.called:
            if places.setdefault(id(called), len(kernels)) == len(kernels):
                kernels.append(called)
            whole.update(b"%d," % places[id(called)])
    return whole.digest()


def signature_digest(arguments: tuple[Any, ...]) -> bytes:
    """Digest of the types of a call's arguments, fields of named tuples included, 32 bytes.

    Raises:
        Unreadable: an argument is of a kind that is not read here.
    """
    reader = _Reader()
    for one in arguments:
        reader.type(one)
    return reader.sum.digest()


_first: WeakKeyDictionary[Dispatcher, bytes] = WeakKeyDictionary()


@lru_cache(maxsize=4096)
def _fixed(code: CodeType) -> bytes:
    """What the code object alone says, its constants aside."""
    told = (code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
    counts = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
    return repr((code.co_name, told, counts, code.co_exceptiontable)).encode()


class _Reader:
    """Reads one function's values into a sum; those that it calls are listed as they come."""

    def __init__(self) -> None:
        self.sum = hashlib.sha256()
        self.called: list[Dispatcher] = []

    def say(self, *words: object) -> None:
        for word in words:
            data = word if isinstance(word, bytes) else str(word).encode()
            self.sum.update(b"%d:" % len(data) + data)

    def kernel(self, kernel: Dispatcher) -> None:
        """What numba is told beside the function, and what Python made of it."""
        options = kernel.targetoptions
        for name in sorted(options):
            self.say(name)
            self.value(options[name])
        self.function(kernel.py_func)

    def function(self, function: FunctionType) -> None:
        self.say("function", function.__module__, function.__qualname__)
        self.value(function.__defaults__)
        self.value(tuple(sorted((function.__kwdefaults__ or {}).items())))
        for cell in function.__closure__ or ():
            self.value(cell.cell_contents)
        self.code(function.__code__, function.__globals__)

    def code(self, code: CodeType, names: dict[str, Any]) -> None:
        self.say("code", _fixed(code))
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                self.code(constant, names)
            else:
                self.value(constant)
        for name in code.co_names:  # attributes too: one that is called as a global does no harm
            if name in names:
                self.say(name)
                self.value(names[name])

    def value(self, value: Any) -> None:
        """A global value, a constant, an option."""
        kind = type(value)
        if isinstance(value, Dispatcher):
            self.say("kernel")
            self.called.append(value)
        elif kind in _PLAIN:
            self.say(kind.__name__, repr(value))
        elif isinstance(value, np.generic):
            self.say(value.dtype.str, value.tobytes())
        elif kind is np.ndarray and not value.dtype.hasobject:
            self.say("array", value.dtype.descr, value.shape, value.strides, value.tobytes())
        elif isinstance(value, (tuple, list)):
            self.several(kind, tuple(value))
        elif kind in (set, frozenset):
            self.several(kind, tuple(sorted(value, key=repr)))
        elif kind is dict:
            self.several(kind, tuple(value.items()))
        elif isinstance(value, _Intrinsic):
            self.function(value._defn)
        else:
            self.named(value)

    def several(self, kind: type, values: tuple[Any, ...]) -> None:
        self.say(len(values))
        self.named(kind)
        for one in values:
            self.value(one)

    def named(self, value: Any) -> None:
        """What its name tells all about: of a known library, or a class of named fields."""
        fields = getattr(value, "_fields", None)
        if isinstance(value, type) and issubclass(value, tuple) and fields is not None:
            self.say("fields", value.__module__, value.__qualname__, fields)
            self.value(tuple(value._field_defaults.items()))  # pyright: ignore[reportAttributeAccessIssue]
            return
        if isinstance(value, ModuleType):
            module, name = value.__name__, ""
        elif isinstance(value, (type, FunctionType, BuiltinFunctionType, np.ufunc)):
            module = getattr(value, "__module__", None) or "numpy"
            name = getattr(value, "__qualname__", value.__name__)
        elif isinstance(value, types.Type):
            return self.type(value)
        else:
            module, name = "", type(value).__qualname__
        if module.partition(".")[0] not in KNOWN:
            raise Unreadable(f"{module} {name}: a global that a kernel's digest cannot read")
        return self.say("known", module, name)

    def type(self, kind: Any) -> None:
        """A numba type."""
        if isinstance(kind, types.BaseNamedTuple):
            self.named(kind.instance_class)  # pyright: ignore[reportAttributeAccessIssue]
        if isinstance(kind, types.BaseTuple):
            self.say("tuple", len(kind))
            for one in kind.types:  # pyright: ignore[reportAttributeAccessIssue]
                self.type(one)
        elif isinstance(kind, _PLAIN_TYPES):
            self.say(type(kind).__name__, kind.name)
        else:
            raise Unreadable(f"{kind}: an argument that a kernel's digest cannot read")
