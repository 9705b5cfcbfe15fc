"""For all tests: examples are bounded in number, never by the clock of a loaded machine.

They are the same in every run: a change is judged by what it does, not by what was drawn that day.
`--hypothesis-profile explore` draws anew, for whoever looks for more.

Linear algebra has one thread, as in every command: more of them wait for each other and take the
cores from other tests.
"""

from __future__ import annotations

import os

from hypothesis import settings

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # before any test imports NumPy
    os.environ.setdefault(threads, "1")

settings.register_profile("same-examples", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None)
settings.load_profile("same-examples")
