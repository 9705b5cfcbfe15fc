"""The report: self-contained, escaped, whole with any results absent, clean in a browser."""

from __future__ import annotations

import dataclasses
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from freeswing.report.material import FILES, RESULTS, Material
from freeswing.report.page import PANELS, render_page
from freeswing.report.panels.advice import steps
from freeswing.report.panels.answer import verdict
from freeswing.report.panels.cameras import Cameras
from freeswing.report.panels.ladder import EffectLadder, effect_rows
from freeswing.report.space import enlargement
from freeswing.results.common import FoundEffect
from freeswing.results.diagnosis import Candidate, Diagnosis, Unexplained
from tests.freeswing.report.report_material import whole_material

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-logging=stderr",
    "--v=0",
)
FIGURES = 18
DRAWINGS = 60  # the small ones that wrap on a phone
VOID = {"meta", "link", "br", "img", "hr", "input"}


class Tags(HTMLParser):
    """Checks nesting and collects ids and addresses."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.addresses: list[str] = []
        self.names: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names.append(tag)
        if tag not in VOID:
            self.open.append(tag)
        for key, value in attrs:
            if key == "id":
                self.ids.append(value or "")
            if key in ("src", "href", "xlink:href", "action", "data"):
                self.addresses.append(value or "")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open[-1] == tag, f"</{tag}> closes <{self.open[-1]}>"
        self.open.pop()


def parsed(page: str) -> Tags:
    tags = Tags()
    tags.feed(page)
    tags.close()
    assert tags.open == [], tags.open
    return tags


@pytest.fixture(scope="module")
def page() -> str:
    return render_page(whole_material())


def test_sections_stand_in_reading_order(page: str) -> None:
    shown = [panel.name for panel in PANELS if panel.name not in ("bench", "control")]
    places = [page.index(f'<section id="{name}">') for name in shown]
    assert places == sorted(places)
    assert "The bench" not in page, "neither the section nor its link where nothing is for it"
    order = "answer bench sure ladder geometry change decay next swings cameras markers dropped"
    assert [panel.name for panel in PANELS] == [*order.split(), "control", "provenance"]


def test_cameras_are_no_section_of_other_recordings() -> None:
    without = dataclasses.replace(whole_material(), calibration=None, tracking=None)
    assert "The cameras" not in render_page(without, (Cameras(),))
    nothing = dataclasses.replace(without, identification=None)
    assert "The cameras" in render_page(nothing, (Cameras(),)), "they may still come"


def test_candidates_with_and_without_a_probability_share_a_table() -> None:
    material = whole_material()
    assert material.diagnosis is not None
    first, *others = material.diagnosis.candidates
    candidates = (dataclasses.replace(first, probability=0.9), *others)
    for order in (candidates, candidates[::-1]):
        mixed = dataclasses.replace(material.diagnosis, candidates=order)
        page = render_page(dataclasses.replace(material, diagnosis=mixed), (EffectLadder(),))
        assert "probability (%)" in page


def test_paths_are_drawn_as_large_as_can_be_seen() -> None:
    entries = np.array([[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
    for size_m, factor in ((0.5, 1.0), (0.079, 5.0), (0.081, 2.0), (0.001, 20.0)):
        path = np.array([[0.0, 0.0, 0.0], [size_m, 0.0, 0.0]])
        assert enlargement([path], entries) == factor, size_m


def test_nothing_is_fetched(page: str) -> None:
    addresses = parsed(page).addresses
    outside = {a for a in addresses if not a.startswith(("#", "data:"))}
    assert outside == {"report-parameters.csv", "report-held-out.csv"}, "tables beside the page"
    assert re.findall(r"@import|url\((?!#)", page) == []


def test_ids_are_unique_and_links_lead_somewhere(page: str) -> None:
    tags = parsed(page)
    repeated = {name for name in tags.ids if tags.ids.count(name) > 1}
    assert repeated == set()
    missing = [a for a in tags.addresses if a.startswith("#") and a[1:] not in tags.ids]
    assert missing == []


def test_values_from_files_are_escaped(page: str) -> None:
    assert parsed(page).names.count("script") == 0
    assert "&lt;script&gt;" in page


def test_every_figure_is_there(page: str) -> None:
    assert page.count("<figure") == FIGURES, page.count("<figure")
    assert page.count("<svg") == DRAWINGS, page.count("<svg")


def test_the_same_results_give_the_same_page(page: str) -> None:
    assert render_page(whole_material()) == page


@pytest.mark.parametrize("absent", [*RESULTS, "all"])
def test_any_result_may_be_absent(absent: str) -> None:
    names = RESULTS if absent == "all" else (absent,)
    material = dataclasses.replace(whole_material(), **dict.fromkeys(names))
    page = render_page(material)
    parsed(page)
    assert "Traceback" not in page


@pytest.mark.parametrize("kind", RESULTS)
def test_results_without_their_lists_still_give_a_page(kind: str) -> None:
    bare = FILES[kind][0].from_json({"format": f"freeswing-{kind}/1"})
    material = dataclasses.replace(Material("bare"), **{kind: bare})
    parsed(render_page(material))


def test_a_hostile_title_is_escaped() -> None:
    page = render_page(Material("<img src=x onerror=alert(1)>"))
    assert "<img" not in page


# The report says what a person would see; the page itself holds no script. Headless windows are at
# least 500 px wide, so the page stands in a frame of the width that is asked for.
PROBE = """<script>onload = () => {
  document.querySelectorAll('details').forEach(d => { d.open = OPEN; });
  const seen = [...document.querySelectorAll('figure svg')]
    .filter(s => s.getBoundingClientRect().height > 40).length;
  const wide = [...document.querySelectorAll('body *')]
    .filter(e => !e.closest('thead') && e.getBoundingClientRect().right > innerWidth + 1);
  const cut = [...document.querySelectorAll('figure svg')].filter(s => {
    const whole = s.getBoundingClientRect();
    return [...s.querySelectorAll('text')].some(t => {
      const box = t.getBoundingClientRect();
      return box.left < whole.left - 2 || box.right > whole.right + 2 ||
        box.top < whole.top - 2 || box.bottom > whole.bottom + 2;
    });
  }).length;
  console.error('PROBE cut=' + cut + ' width=' + innerWidth + ' figures=' + seen +
    ' wide=' + wide.length);
}</script>"""


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
@pytest.mark.parametrize("width", [1280, 390])
def test_a_browser_shows_it_without_overflow(page: str, tmp_path: Path, width: int) -> None:
    shown, frame, picture = (tmp_path / name for name in ("shown.html", "frame.html", "shot.png"))
    probe = PROBE.replace("OPEN", "true")
    shown.write_text(page.replace("</body>", f"{probe}</body>"), encoding="utf-8")
    style = f"border:0;width:{width}px;height:2300px"
    frame.write_text(f'<body><iframe src="shown.html" style="{style}"></iframe>', encoding="utf-8")
    done = subprocess.run(
        [
            str(CHROMIUM),
            *FLAGS,
            f"--user-data-dir={tmp_path / 'profile'}",
            f"--window-size={max(width, 500)},2400",
            f"--screenshot={picture}",
            frame.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert len(console) == 1, done.stderr[-2000:]
    assert f"PROBE cut=0 width={width} figures={DRAWINGS} wide=0" in console[0], console
    assert picture.stat().st_size > 20_000, picture.stat().st_size


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_paper_holds_everything(page: str, tmp_path: Path) -> None:
    """Nothing runs over the edge, and what is folded on the screen is printed."""
    pdfium = pytest.importorskip("pypdfium2")
    shown, printed = tmp_path / "shown.html", tmp_path / "printed.pdf"
    shown.write_text(page, encoding="utf-8")
    done = subprocess.run(
        [
            str(CHROMIUM),
            *FLAGS,
            f"--user-data-dir={tmp_path / 'profile'}",
            "--no-pdf-header-footer",
            f"--print-to-pdf={printed}",
            shown.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert printed.is_file(), done.stderr[-2000:]
    words, outside = [], []
    for number, sheet in enumerate(pdfium.PdfDocument(printed)):
        width, height = sheet.get_size()
        text = sheet.get_textpage()
        words.append(text.get_text_range())
        for k in range(text.count_rects()):
            left, bottom, right, top = text.get_rect(k)
            if left < -1 or bottom < -1 or right > width + 1 or top > height + 1:
                outside.append((number, left, right))
    assert outside == []
    whole = re.sub(r"\s", "", " ".join(words))
    assert "ab" * 32 in whole, "the inputs' SHA-256, folded on the screen"
    assert "Residualsoftherunsthatwerefitted" in whole


def test_places_that_are_off_stand_with_what_replaces_them_and_runs_with_their_trust(
    page: str,
) -> None:
    assert "attachment offset of 2" in page
    assert "2.30 ± 3.72; -5.40 ± 5.88; -4.00 ± 3.33" in page
    assert "or anchor offset of 2" in page
    assert ">9.0</td>" in page


def test_what_each_run_loses_stands_beside_what_the_models_lose(page: str) -> None:
    assert "How the swings die away" in page
    row = page[page.index(">swing-7</td>") :]
    assert row.index(">30</td>") < row.index(">0.0</td>")


def test_effects_that_replace_each_other_are_told_of_once() -> None:
    rivals = [("quadratic_drag", "translational_drag"), ("translational_drag", "quadratic_drag")]
    candidates = tuple(
        Candidate(effect=one, verdict="confounded", confounded_with=(other,))
        for one, other in (*rivals, ("gravity_tilt", "anchor_offset"))
    )
    said = verdict(Diagnosis(candidates=candidates))
    assert len(said) == 2
    assert all(said[0].count(name) == 1 for name in ("quadratic drag", "translational drag"))


def test_how_far_values_are_to_be_relied_on_is_said() -> None:
    rest = Unexplained(present=True, signature="1 mrad rms in theta")
    left = dataclasses.replace(rest, reliance="do not rely on these values: why")
    said = verdict(Diagnosis(unexplained=left))
    assert said[-1] == "Do not rely on these values: why."
    assert len(verdict(Diagnosis(unexplained=rest))) == 1


def test_how_stretching_cables_were_fitted_is_a_row() -> None:
    found = FoundEffect(effect="cable_elasticity", motion="with vibration")
    row = {"effect": "cable elasticity", "number": "motion", "value ± 95 %": "with vibration"}
    assert effect_rows(found) == [row]
    assert not effect_rows(FoundEffect(effect="gravity_tilt"))
    slow = "without vibration: cables are as long as their tension makes them"
    for told, said in (("quasi-static: why", f"{slow}; why"), ("quasi-static", slow)):
        (row,) = effect_rows(FoundEffect(effect="cable_elasticity", motion=told))
        assert row["value ± 95 %"] == said


def test_rivals_are_sentences_and_told_of_once_below_the_bars_and_in_the_advice() -> None:
    rivals = [("quadratic_drag", "translational_drag"), ("translational_drag", "quadratic_drag")]
    candidates = tuple(
        Candidate(
            effect=one, verdict="confounded", confounded_with=(other,), experiment="record more"
        )
        for one, other in rivals
    )
    material = dataclasses.replace(whole_material(), diagnosis=Diagnosis(candidates=candidates))
    values = EffectLadder().values(material)
    assert values is not None
    assert values["rivals"] == [
        "Quadratic drag cannot be told from translational drag. Record more"
    ]
    told = [text for text, _ in steps(material) if "rivals" in text]
    assert told == ["To tell quadratic drag from its rivals: record more"]


def test_speeds_of_swings_that_die_away_stand_beside_their_axis(page: str) -> None:
    chart = page[page.index("How the swings die away") :]
    chart = chart[: chart.index("</svg>")]
    assert re.search(r">0\.[0-9]+</text>", chart), re.findall(r">([^<]+)</text>", chart)
