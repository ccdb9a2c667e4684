"""The page: well formed, in need of nothing else, with links that lead somewhere."""

import base64
import re
import shutil
import subprocess
from dataclasses import replace
from hashlib import sha256
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote, urljoin, urlparse

import numpy as np
import pandas as pd
import pytest

import orchestrator
from orchestrator import gallery, tables
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.report import page as page_module
from orchestrator.report import remarks, style
from orchestrator.report.figures import bed
from orchestrator.report.page import Limits, Paragraphs, Section, Table
from orchestrator.report.results import Results
from orchestrator.report.style import Figure
from orchestrator.runs.files import Folder
from tests.report.conftest import only, write
from tests.small_study import TITLE
from tests.waiting import HANGS_S

VOID = {"meta", "img", "br", "link", "input", "hr", "source"}


class Page(HTMLParser):
    """Tags with their attributes, texts by tag, and a check of nesting."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.text = ""
        self.texts: dict[str, str] = {}
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not {"style", "script"} & set(self.open):
            self.text += data
        for tag in self.open[-1:]:
            self.texts[tag] = self.texts.get(tag, "") + data

    def all(self, tag: str, attribute: str) -> list[str]:
        return [values[attribute] for name, values in self.tags if name == tag]


@pytest.fixture(scope="module")
def html(page: Path) -> str:
    return page.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def parsed(html: str) -> Page:
    return Page(html)


def test_page_needs_nothing_else(html: str, parsed: Page) -> None:
    kinds = [src.split(",")[0] for src in parsed.all("img", "src")]
    folded = html.count("<code>python -m orchestrator report DIR --all</code>")
    assert (set(kinds), folded) == ({"data:image/svg+xml;utf8"}, 1)
    assert re.search(r"[1-9]\d* more figures, drawn on demand", parsed.text)
    assert not {"link", "iframe", "object"} & {tag for tag, _ in parsed.tags}
    scripts = [values for tag, values in parsed.tags if tag == "script"]
    assert [one.get("type") for one in scripts] == [
        "application/json",
        None,
    ]
    assert not any("src" in one for one in scripts)
    assert not {"url(", "@import"} & set(parsed.texts["style"].split())
    assert not any("://" in href for href in parsed.all("a", "href"))
    assert "default-src 'none'" in html
    # no other script than the page's own may run
    script = html[html.rindex("<script>") + 8 : html.rindex("</script>")]
    digest = base64.b64encode(sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in html


def test_the_first_screen_answers(html: str, parsed: Page) -> None:
    order = [html.index(text) for text in (
        'aria-label="On this page"', "point of first motion", "Where the numbers come from",
        'id="bed-alpha15"', 'id="thresholds"', "<th", 'id="limits"', 'id="figures"', 'id="shields"',
        'id="failed"', 'id="methods"', "<summary>All parameters", 'id="files"',
    )]  # fmt: skip
    assert order == sorted(order)
    assert all(parsed.all("img", "alt"))
    levels = [int(tag[1]) for tag, _ in parsed.tags if tag in ("h1", "h2", "h3")]
    assert levels[0] == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))
    anchors = {values["id"] for _, values in parsed.tags if "id" in values}
    inside = [href[1:] for href in parsed.all("a", "href") if href.startswith("#")]
    assert set(inside) <= anchors


def test_what_a_user_wrote_is_text(html: str, parsed: Page) -> None:
    assert "<script>alert" not in html
    assert parsed.texts["title"].startswith(TITLE)
    assert f"Study “{TITLE}”" in parsed.text
    assert "# </pre><b>" in parsed.texts["pre"]
    assert "it <b>died</b>" in parsed.text
    assert not [values for tag, values in parsed.tags if tag == "b" and not values]


def test_links_lead_to_what_is_there(
    page: Path, parsed: Page, results: Results
) -> None:
    (page.parent / "tables").mkdir(exist_ok=True)
    targets = set()
    for href in (one for one in parsed.all("a", "href") if not one.startswith("#")):
        address = urlparse(urljoin(page.as_uri(), href))
        assert address.scheme == "file"
        targets.add(Path(unquote(address.path)))
    folders = {page.parent / "cases" / name for name in results.plan.cases}
    assert folders <= targets
    assert all(path.is_dir() for path in targets if not path.suffix)
    assert all(path.is_file() for path in targets if path.suffix == ".svg")
    sheets = [path for path in targets if path.suffix == ".csv"]
    tables = {path.stem for path in sheets if path.parent.name == "tables"}
    assert tables == {"columns", *results.tables}
    numbers = [path for path in sheets if path.parent.name == "figures"]
    assert numbers
    assert all(path.is_file() for path in numbers)


def test_same_results_give_the_same_bytes(results: Results, tmp_path: Path) -> None:
    heap = only(results, "pile")
    pages = []
    for name in ("one", "two"):
        out = tmp_path / name
        out.mkdir()
        (out / "cases").symlink_to(results.cases)
        pages.append(write(heap, out, {}).parent)
    for path in (pages[0] / "figures").iterdir():
        assert path.read_bytes() == (pages[1] / "figures" / path.name).read_bytes(), (
            path.name
        )
    first, second = ((folder / "report.html").read_bytes() for folder in pages)
    assert first == second


def test_page_without_results(results: Results, tmp_path: Path) -> None:
    none = {name: pd.DataFrame() for name in results.tables}
    asked = {name: results.tables[name] for name in ("scenes", "methods")}
    empty = replace(results, tables={**none, **asked})
    (tmp_path / "cases").mkdir()
    failures = dict.fromkeys(results.plan.cases, "no solver")
    parsed = Page(
        write(replace(empty, cases=tmp_path / "cases"), tmp_path, failures).read_text(
            "utf-8"
        )
    )
    assert "No case has given a result." in parsed.text
    assert parsed.text.count("no solver") == len(failures)
    assert not [href for href in parsed.all("a", "href") if href.startswith("cases/c")]


def test_symbols_have_an_index_and_names_of_columns_none() -> None:
    typeset = page_module.typeset
    assert typeset("τ_c of ρ_sol") == "τ<sub>c</sub> of ρ<sub>sol</sub>"
    assert typeset("column frozen_bed") == "column frozen_bed"
    assert typeset("why_not; Re_p, U_e") == "why_not; Re<sub>p</sub>, U<sub>e</sub>"
    assert typeset("`--tolerance 0` runs") == "<code>--tolerance 0</code> runs"


def test_a_figure_that_fails_costs_that_figure_and_a_line(
    results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise MemoryError("26.5 GiB for <an array>")

    monkeypatch.setattr(bed, "read_steps", fail)
    (tmp_path / "cases").symlink_to(results.cases)
    html = write(only(results, "pile"), tmp_path, {}).read_text(encoding="utf-8")
    assert 'id="shields"' in html
    assert 'id="bed-alpha15"' not in html
    assert "26.5 GiB for &lt;an array&gt;" in html


BROWSER = shutil.which("chromium")
PROBE = """<script>addEventListener("load", () => {
  const root = document.documentElement, box = (name) => document.querySelector(name).getBoundingClientRect();
  const slider = document.querySelector("input[type=range]");
  slider.value = slider.max; slider.dispatchEvent(new Event("input"));
  root.dataset.bottom = Math.round(box("figure.head .bed-box").bottom);
  root.dataset.card = Math.round(box(".card").bottom);
  root.dataset.wide = root.scrollWidth;
});</script>"""


@pytest.mark.skipif(not BROWSER, reason="no chromium here")
def test_in_a_browser_the_slider_moves_grains_above_the_fold(
    page: Path, results: Results, tmp_path: Path
) -> None:
    html = page.read_text(encoding="utf-8")
    # the policy lets no other script run: the probe comes without it
    start, end = html.index("<meta http-equiv"), html.index('<meta name="viewport"')
    (tmp_path / "page.html").write_text(
        html[:start] + PROBE + html[end:], encoding="utf-8"
    )
    shown = {}
    for width in (1280, 500):
        dom = _dom(tmp_path / "page.html", width)
        shown[width] = {
            name: int(dom.split(f'data-{name}="')[1].split('"')[0])
            for name in ("bottom", "card", "wide")
        }
        moved = results.tables["pile_curve"]["moved"].max()
        count = results.tables["pile_curve"]["count"].max()
        assert f": {moved} of {count} entrained (" in dom
    # card and picture are above the fold, and nothing is wider than the screen
    assert shown[1280]["bottom"] < 800
    assert shown[1280]["wide"] <= 1280
    assert shown[500]["wide"] <= 500


LONG = """<script>addEventListener("load", () => {
  const root = document.documentElement, tables = [...document.querySelectorAll("table")];
  const all = (name) => document.querySelectorAll(name).length;
  const table = document.querySelector("section:nth-of-type(2) table");
  const first = () => table.tBodies[0].rows[0].cells[1].textContent;
  const head = table.tHead.rows[0].cells[1];
  root.dataset.tools = all(".tools");
  head.querySelector("button").click();
  root.dataset.rising = first() + head.getAttribute("aria-sort");
  head.querySelector("button").click();
  root.dataset.falling = first() + head.getAttribute("aria-sort");
  const filter = document.querySelector(".tools input");
  filter.value = "bed 2";
  filter.dispatchEvent(new Event("input"));
  root.dataset.found = document.querySelector(".tools [role]").textContent;
  dispatchEvent(new Event("beforeprint"));
  root.dataset.printed = [...table.tBodies[0].rows].filter((row) => !row.hidden).length;
});</script>"""


@pytest.mark.skipif(not BROWSER, reason="no chromium here")
def test_in_a_browser_a_long_table_sorts_and_filters(tmp_path: Path) -> None:
    values = ["−3.5 … 2", "above 12", "1.0 × 10", "—", *map(str, range(100, 118))]
    names = [f"bed {number}" for number in range(len(values))]
    table = pd.DataFrame({"bed": names, "wind, m/s": values})
    sections = [
        Section("Short", [Table.of(table[:5])]),
        Section("Long", [Table.of(table)]),
    ]
    page_module.write_experiment(SPEED, sections, Folder(tmp_path), "page.html", {})
    html = (tmp_path / "page.html").read_text(encoding="utf-8")
    start, end = html.index("<meta http-equiv"), html.index('<meta name="viewport"')
    path = tmp_path / "long.html"
    path.write_text(html[:start] + LONG + html[end:], encoding="utf-8")
    dom = _dom(path, 1280)
    told = dict(re.findall(r'data-(\w+)="([^"]*)"', dom.split(">", 2)[1]))
    assert told == {
        "tools": "1",
        "rising": "−3.5&nbsp;…&nbsp;2ascending",
        "falling": "117descending",
        "found": "3 of 22 rows",
        "printed": "22",
    }


def _dom(path: Path, width: int) -> str:
    """What a browser makes of a page."""
    command = [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
               f"--window-size={width},800", f"--user-data-dir={path.parent / 'profile'}",
               path.as_uri()]  # fmt: skip
    ended = subprocess.run(command, capture_output=True, text=True, timeout=HANGS_S)
    return ended.stdout


GRAIN = "grain = { diameter = 1e-3 }\nmethod.kind = 'pivot'\n"


@pytest.fixture
def studies(tmp_path: Path) -> Path:
    """A directory with two finished studies."""
    for name in ("one", "two & more"):
        (tmp_path / "study.toml").write_text(f"title = '{name}'\n{GRAIN}")
        orchestrator.run(tmp_path / "study.toml", out=tmp_path / "all" / name)
    return tmp_path / "all"


def test_gallery_of_studies_is_written_anew(studies: Path) -> None:
    (studies / gallery.NAME).write_text("an earlier one")
    (studies / "mine.html").write_text("mine")
    gallery.write_gallery(studies)
    assert (studies / "mine.html").read_text() == "mine"
    html = (studies / gallery.NAME).read_text("utf-8")
    assert '<a href="two%20%26%20more/report.html">two &amp; more</a>' in html
    # the first number of each card with its interval, and the verdict
    card = orchestrator.open(studies / "one").card
    number = card.numbers[0]
    words = " ".join(html.split())
    assert words.count(f"{number.figure} <small>{number.unit}</small>") == 2
    assert words.count(f'<span class="ends">{number.interval}</span>') == 2
    assert words.count(card.worth.word[1:]) == 2
    assert words.count('="data:image/svg+xml') == 2
    assert "2 result pages" in words
    gallery.write_gallery(studies)
    assert (studies / gallery.NAME).read_text("utf-8") == html
    with pytest.raises(InputError, match="no study with a page"):
        gallery.write_gallery(studies / "one")


def test_a_study_of_another_version_costs_its_own_sentences(studies: Path) -> None:
    older = dict(orchestrator.open(studies / "one").tables)
    every = tables.missing({"single_grain": pd.DataFrame()})
    older["single_grain"] = older["single_grain"].drop(columns=every)
    tables.write_tables(older, Folder(studies / "one"), "tables")
    with pytest.raises(OrchestratorError, match=f"{len(every) - 3} more columns"):
        orchestrator.open(studies / "one")
    html = gallery.write_gallery(studies).read_text(encoding="utf-8")
    assert html.count("another version of this program wrote them") == 1
    asked = "At what wind does a grain of 1\u00a0mm start to move?"
    assert html.count(asked) == 1


def test_a_fault_of_the_program_is_not_told_as_another_version(
    studies: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def misspelt(_: object) -> object:
        return dict[str, object]()["usable"]

    monkeypatch.setattr(remarks, "remarks", misspelt)
    with pytest.raises(KeyError, match="usable"):
        _ = orchestrator.open(studies / "one").answer


SPEED = "Speed & <accuracy>"


def test_page_of_an_experiment_holds_all_of_its_sections(tmp_path: Path) -> None:
    figures = []
    for name in ("first", "second"):
        canvas = style.canvas(1.0)
        canvas.subplots().plot([0, 1])
        figures.append(Figure(name, f"The {name}", f"What <{name}> shows.", (), canvas))
    table = pd.DataFrame(
        {"level": ["a", "b"], "tau_c": [0.123456, np.nan], "same": [True, False]}
    )
    text = Paragraphs("One V_f.\n\nAnother <b>paragraph</b>.")
    sections = [
        Section("What was run", [figures[0], text]),
        Section(
            "Found", [Limits(["No more than <this>."]), figures[1], Table.of(table)]
        ),
    ]
    page_module.write_experiment(
        SPEED, sections, Folder(tmp_path), "page.html", {"liggghts": "3.8"}
    )
    parsed = Page((tmp_path / "page.html").read_text(encoding="utf-8"))
    assert parsed.texts["title"] == parsed.texts["h1"] == SPEED
    assert parsed.texts["h2"] == "What was runFoundFiles"
    assert parsed.texts["h3"] == "Figure 1. The firstFigure 2. The second"
    for said in (
        "Another <b>paragraph</b>.",
        "What <second> shows.",
        "No more than <this>.",
    ):
        assert said in parsed.text
    cells = parsed.texts["td"]
    # the first cell of a row is its head
    assert cells.startswith("0.1235yes—no")
    assert "3.8" in cells
    heads = parsed.texts["th"]
    assert all(name in heads for name in ("level", "b", "liggghts", "matplotlib"))
    assert [src.split(",")[0] for src in parsed.all("img", "src")] == [
        "data:image/png;base64"
    ] * 2
    files = {path.name for path in (tmp_path / "figures").iterdir()}
    assert files == {
        f"{name}.{ending}"
        for name in ("first", "second")
        for ending in ("csv", "png", "svg")
    }
    hrefs = parsed.all("a", "href")
    assert {f"figures/{name}" for name in files} <= {*hrefs}


def test_the_address_of_a_figure_is_its_text(html: str, page: Path) -> None:
    first = re.search(r'href="(figures/[^"]+)"><img src="([^"]+)"', html)
    assert first is not None
    kind, _, text = first[2].partition(",")
    assert kind == "data:image/svg+xml;utf8"
    assert "\n" not in text
    assert "#" not in text
    shown = unquote(text)
    kept = (page.parent / first[1]).read_text(encoding="utf-8")
    assert re.sub(r"[\s\"']+", " ", shown) == re.sub(r"[\s\"']+", " ", kept)
