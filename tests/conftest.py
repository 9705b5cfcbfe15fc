"""For all tests: examples are bounded in number, never by the clock of a loaded machine.

They are the same in every run: a change is judged by what it does, not by what was drawn that day.
`--hypothesis-profile explore` draws anew, for whoever looks for more.
"""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("same-examples", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None)
settings.load_profile("same-examples")
