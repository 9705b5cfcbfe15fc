"""An independent simulator of cable-suspended platforms: truth for the tests and the benchmarks.

Written from mechanics alone (Newton-Euler in maximal coordinates, Lagrange multipliers) and from
MuJoCo; it shares no equation with the product's model, simulation or effects.

- `sessions.make_session`: a session folder with undeclared effects and its sealed truth.
- `cases.manifest`: the benchmark's list of such sessions; `visibility.visibility`: how visible.
- `newton_euler.simulate`, `mujoco_swing.mujoco_swing`: one free motion from a pose and a twist.
- `equilibrium.settle`, `runs.draw_run`: rest poses, releases, runs with all cables taut.

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
_USUAL = numba.config.CACHE_DIR
numba.config.CACHE_DIR = str(_HERE / "__pycache__" / f"compiled-{_DIGEST}")
for _name in _COMPILED:
    importlib.import_module(f"{__name__}.{_name}")
numba.config.CACHE_DIR = _USUAL
