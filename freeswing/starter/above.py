"""session.toml of a bench that one phone films from above."""

from __future__ import annotations

from freeswing.cdpr.files.toml_text import toml_string
from freeswing.starter.filmed import FAMILY, Filmed, opening_lines
from freeswing.starter.kinds import MISSING

KINDS_ABOVE = ("trifilar", "bifilar")
TARE, WEIGHT, LOADED = 3, 4, 4  # runs of each sort, as docs/guide/bench.md has them


def above_session(name: str, filmed: Filmed, cables: int) -> str:
    """Runs of the empty platform, of a known mass on both sides, and of an object.

    Args:
        name: of the session.
        filmed: camera and rate.
        cables: how many wires.
    """
    lengths = f"cable_lengths_m = [{', '.join([MISSING] * cables)}]"
    camera = filmed.cameras[0]
    lines = [
        *opening_lines(name, filmed.rate_hz),
        "planar = true      # one phone from above: chi, x, y of the printed sheet",
        "",
        "# Glue the sheet flat on the platform, its cross in the middle of the wires' lower ends",
        f"# (P), the {FAMILY} tags' x along the platform's. The phone hangs still above and looks",
        "# down; ten or twenty degrees beside the vertical do no harm. Its lens need not be known:",
        "# there is no cameras.toml.",
        "",
        "[[loads]]          # the object to be measured; without one delete this and its runs",
        'name = "object"',
        f"mass_kg = {MISSING}      # weigh it",
        "mass_std_kg = 0.001",
        "# com_m = [0.0, 0.0, 0.0]   # where its centre of mass should be, with com_std_m = 0.01",
    ]
    for k in range(TARE):
        lines += _run(f"tare-{k + 1}", camera, lengths)
    for k in range(WEIGHT):
        side = "" if k % 2 == 0 else "-"
        lines += _run(f"weight-{k + 1}", camera, lengths)
        lines.append(
            f"payload = {{ mass_kg = {MISSING}, position_m = [{side}{MISSING}, 0.0, 0.0] }}"
            "   # on either side in turn"
        )
    for k in range(LOADED):
        lines += [*_run(f"object-{k + 1}", camera, lengths), 'loads = ["object"]']
    return "\n".join([*lines, ""])


def _run(name: str, camera: str, lengths: str) -> list[str]:
    return [
        "",
        "[[runs]]",
        f"name = {toml_string(name)}",
        'role = "identify"',
        f'video = "runs/{name}"      # {camera}.mp4 in that folder',
        f"{lengths}   # hanging loaded, from bend to bend",
        "cable_lengths_std_m = 0.001",
        "# window_s = [2.0, 32.0]    # from after the hand has let go",
    ]
