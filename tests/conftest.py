"""For all tests: examples are bounded in number, never by the clock of a loaded machine."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("no-clock", deadline=None)
settings.load_profile("no-clock")
