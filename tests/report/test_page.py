"""The page: well formed, in need of nothing else, with links that lead somewhere."""

import base64
import subprocess
import sys
from dataclasses import replace
from hashlib import sha256
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote, urljoin, urlparse

import pandas as pd
import pytest

from orchestrator.report import page as page_module
from orchestrator.report.results import Results
from tests.report.conftest import only, write
from tests.small_study import TITLE

VOID = {"meta", "img", "br", "link", "input", "hr"}


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
    assert kinds == ["data:image/svg+xml;base64"] * 8
    assert not {"link", "iframe", "object"} & {tag for tag, _ in parsed.tags}
    scripts = [values for tag, values in parsed.tags if tag == "script"]
    assert [one.get("type") for one in scripts] == ["application/json", "application/json", None]
    assert not any("src" in one for one in scripts)
    style = parsed.texts["style"]
    assert "url(" not in style
    assert "@import" not in style
    assert '"DejaVu Sans", sans-serif' in style
    assert not any("://" in href for href in parsed.all("a", "href"))
    assert "default-src 'none'" in html


def test_only_the_pages_own_script_may_run(html: str) -> None:
    script = html[html.rindex("<script>") + 8 : html.rindex("</script>")]
    digest = base64.b64encode(sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in html


def test_the_first_screen_answers(html: str, parsed: Page) -> None:
    order = [html.index(text) for text in (
        "times the stress of a single one", 'id="bed-alpha15"', 'id="shields"', 'id="thresholds"',
        'aria-label="Contents"', 'id="figures"', 'id="limits"', "<summary>Parameters",
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
    assert parsed.texts["title"] == parsed.texts["h1"] == TITLE
    assert "# </pre><b>" in parsed.texts["pre"]
    assert "it <b>died</b>" in parsed.text
    assert "b" not in {tag for tag, _ in parsed.tags}


def test_links_lead_to_what_is_there(page: Path, parsed: Page, results: Results) -> None:
    (page.parent / "tables").mkdir(exist_ok=True)
    targets = set()
    for href in (one for one in parsed.all("a", "href") if not one.startswith("#")):
        address = urlparse(urljoin(page.as_uri(), href))
        assert address.scheme == "file"
        targets.add(Path(unquote(address.path)))
    folders = {results.cases / name for name in results.plan.cases}
    assert folders <= targets
    assert all(path.is_dir() for path in targets if path.suffix != ".csv")
    tables = {path.stem for path in targets if path.suffix == ".csv"}
    assert tables == {"columns", *results.tables}


def test_same_results_give_the_same_bytes(results: Results, tmp_path: Path) -> None:
    heap = only(results, "pile")
    pages = []
    for name in ("one", "two"):
        out = tmp_path / name
        out.mkdir()
        (out / "cases").symlink_to(results.cases)
        pages.append(write(heap, out, {}).parent)
    for path in (pages[0] / "figures").iterdir():
        assert path.read_bytes() == (pages[1] / "figures" / path.name).read_bytes(), path.name
    first, second = ((folder / "report.html").read_bytes() for folder in pages)
    assert first == second


def test_page_without_results(results: Results, tmp_path: Path) -> None:
    none = {name: pd.DataFrame() for name in results.tables}
    empty = replace(results, tables={**none, "scenes": results.tables["scenes"]})
    (tmp_path / "cases").mkdir()
    failures = dict.fromkeys(results.plan.cases, "no solver")
    parsed = Page(
        write(replace(empty, cases=tmp_path / "cases"), tmp_path, failures).read_text("utf-8")
    )
    assert "No case has given a result yet" in parsed.text
    assert parsed.text.count("no solver") == len(failures)
    assert not [href for href in parsed.all("a", "href") if href.startswith("cases/c")]


def test_importing_the_report_loads_no_drawing_library() -> None:
    heavy = "{'matplotlib', 'pyvista', 'vtkmodules', 'jinja2', 'pandas'}"
    code = f"import sys, orchestrator.report; sys.exit(bool({heavy} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0


def test_symbols_have_an_index_and_names_of_columns_none() -> None:
    typeset = page_module.typeset
    assert typeset("τ_c of ρ_sol") == "τ<sub>c</sub> of ρ<sub>sol</sub>"
    assert typeset("column frozen_bed") == "column frozen_bed"
    assert typeset("why_not; Re_p, U_e") == "why_not; Re<sub>p</sub>, U<sub>e</sub>"
    assert typeset("`--tolerance 0` runs") == "<code>--tolerance 0</code> runs"
