"""Geometry, forces, Newton-Euler motion and rest of a platform on its cables, compiled.

Compiled functions are cached in `__pycache__`, in a folder named after the source of all of them:
numba itself would not notice a change in another file that a function has compiled in. They are
imported here, so that the product's own functions keep their place and are compiled once.
"""

import hashlib
import importlib
from pathlib import Path

import numba

_HERE = Path(__file__).parent
_COMPILED = ("geometry", "forces", "dynamics", "newton_euler", "equilibrium", "world")
_SOURCE = b"".join((_HERE / f"{name}.py").read_bytes() for name in _COMPILED)
_DIGEST = hashlib.sha256(_SOURCE).hexdigest()[:12]
_USUAL = numba.config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue, reportPrivateImportUsage]
numba.config.CACHE_DIR = str(_HERE / "__pycache__" / f"compiled-{_DIGEST}")  # pyright: ignore[reportAttributeAccessIssue, reportPrivateImportUsage]
for _name in _COMPILED:
    importlib.import_module(f"{__name__}.{_name}")
numba.config.CACHE_DIR = _USUAL  # pyright: ignore[reportAttributeAccessIssue, reportPrivateImportUsage]
