"""The report: self-contained, escaped, whole with any results absent, clean in a browser."""

from __future__ import annotations

import dataclasses
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

from freeswing.report.material import RESULTS, Material
from freeswing.report.page import PANELS, render_page
from tests.freeswing.report_material import whole_material

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
FIGURES = 11
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
    places = [page.index(f'<section id="{panel.name}">') for panel in PANELS]
    assert places == sorted(places)
    order = "answer ladder free_full sigma motion swings cameras markers dropped provenance"
    assert [panel.name for panel in PANELS] == order.split()


def test_nothing_is_fetched(page: str) -> None:
    addresses = parsed(page).addresses
    outside = [a for a in addresses if not a.startswith(("#", "data:"))]
    assert outside == []
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
    assert page.count("<figure") == page.count("<svg") == FIGURES, page.count("<figure")


def test_the_same_results_give_the_same_page(page: str) -> None:
    assert render_page(whole_material()) == page


@pytest.mark.parametrize("absent", [*RESULTS, "all"])
def test_any_result_may_be_absent(absent: str) -> None:
    names = RESULTS if absent == "all" else (absent,)
    material = dataclasses.replace(whole_material(), **{name: {} for name in names})
    page = render_page(material)
    parsed(page)
    assert "Traceback" not in page


@pytest.mark.parametrize("kind", RESULTS)
def test_results_without_their_lists_still_give_a_page(kind: str) -> None:
    material = dataclasses.replace(Material("bare"), **{kind: {"format": f"freeswing-{kind}/1"}})
    parsed(render_page(material))


def test_a_hostile_title_is_escaped() -> None:
    page = render_page(Material("<img src=x onerror=alert(1)>"))
    assert "<img" not in page


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
@pytest.mark.parametrize("size", ["1000,2400", "390,2400"])
def test_a_browser_shows_it_without_complaint(page: str, tmp_path: Path, size: str) -> None:
    path, picture = tmp_path / "report.html", tmp_path / "shot.png"
    # The script reports what a person would see; the page itself holds none.
    probe = """<script>onload = () => {
      const seen = [...document.querySelectorAll('figure svg')]
        .filter(s => s.getBoundingClientRect().height > 40).length;
      const wide = document.documentElement.scrollWidth > innerWidth + 1;
      console.error('PROBE figures=' + seen + ' wide=' + wide);
    }</script>"""
    path.write_text(page.replace("</body>", f"{probe}</body>"), encoding="utf-8")
    done = subprocess.run(
        [
            str(CHROMIUM),
            *FLAGS,
            f"--user-data-dir={tmp_path / 'profile'}",
            f"--window-size={size}",
            f"--screenshot={picture}",
            path.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert len(console) == 1, done.stderr[-2000:]
    assert f"PROBE figures={FIGURES} wide=false" in console[0], console
    assert picture.stat().st_size > 20_000, picture.stat().st_size
