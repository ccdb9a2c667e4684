"""Figures that are drawn again only where what they were drawn from has changed."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from orchestrator import report
from orchestrator.report import figures, kept, style
from orchestrator.report.figures import FigureKind
from orchestrator.report.kept import KEPT, Drawn
from orchestrator.report.results import Reads, Results
from orchestrator.runs import case, processors
from orchestrator.runs.files import Folder
from tests.report.conftest import changed

Draw = Callable[..., set[str]]


@pytest.fixture(scope="module")
def drawn_once(results: Results, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the study with its figures."""
    folder = tmp_path_factory.mktemp("drawn")
    with style.settings():
        report.write(results, {}, Folder(folder))
    return folder


@pytest.fixture
def draw(tmp_path: Path, drawn_once: Path, monkeypatch: pytest.MonkeyPatch) -> Draw:
    """Write the page anew; the files whose figures were drawn for it."""
    shutil.copytree(drawn_once, tmp_path, dirs_exist_ok=True)
    asked: set[str] = set()
    drawn = figures.drawn

    def noted(results: Results, kind: FigureKind, *settings: bool) -> Drawn:
        asked.add(kind.name)
        return drawn(results, kind, *settings)

    # a second process would note nothing here
    monkeypatch.setattr(processors, "usable_count", lambda: 1)
    monkeypatch.setattr(figures, "drawn", noted)

    def write(results: Results, every: bool = False) -> set[str]:
        asked.clear()
        faults = report.write(results, {}, Folder(tmp_path), every=every)
        assert faults == []
        return {*asked}

    return write


ALL = {kind.name for kind in figures.kinds()}


def bytes_of(folder: Path) -> dict[str, bytes]:
    """The page and the figures."""
    paths = [folder / report.PAGE, *(folder / "figures").iterdir()]
    return {path.name: path.read_bytes() for path in paths}


def sources(folder: Path, name: str) -> set[str]:
    """The files whose figures are drawn from a table."""
    kept = json.loads((folder / KEPT).read_text())
    return {file for file, each in kept.items() if name in each["from"]["tables"]}


def test_what_has_not_changed_is_not_drawn_again(
    results: Results, draw: Draw, tmp_path: Path
) -> None:
    before = bytes_of(tmp_path)
    assert draw(replace(results)) == set()
    assert bytes_of(tmp_path) == before
    (tmp_path / KEPT).unlink()
    assert draw(results) == ALL
    assert bytes_of(tmp_path) == before


def test_a_table_that_has_changed_has_its_figures_drawn_again(
    results: Results, draw: Draw, tmp_path: Path
) -> None:
    before = bytes_of(tmp_path)
    stress = results.tables["wall_stress"]
    factor = stress["ustar_over_ustar0_wall"] * 1.01
    other = changed(results, wall_stress=stress.assign(ustar_over_ustar0_wall=factor))
    of_stress = sources(tmp_path, "wall_stress")
    assert draw(other) == of_stress
    assert {"stress", "flow"} <= of_stress < ALL
    after = bytes_of(tmp_path)
    assert after["shields.svg"] == before["shields.svg"]
    assert draw(results) == of_stress, "what was drawn last counts"
    assert bytes_of(tmp_path) == before


def test_other_code_draws_all_anew(
    results: Results, draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(case, "code_of_all", lambda: "other")
    assert draw(results) == ALL


def test_folded_figures_are_drawn_where_all_are_asked_for(
    results: Results, draw: Draw, tmp_path: Path
) -> None:
    few = {*bytes_of(tmp_path)}
    assert draw(results, every=True) == ALL
    assert few < {*bytes_of(tmp_path)}


def test_another_run_of_a_case_has_the_figures_of_its_files_drawn_again(
    results: Results, draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    (flow,) = results.flows
    digest = case.digest_of_results

    def other(run: case.Case, cases: Path) -> str:
        return "other" if run.name == flow else digest(run, cases)

    monkeypatch.setattr(case, "digest_of_results", other)
    assert draw(results) == {"bed", "flow"}


HARMS: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "half": lambda content: content[: len(content) // 2],
    "another": lambda content: content.replace(b"1", b"2"),
}


@pytest.mark.parametrize("harm", HARMS)
@pytest.mark.parametrize("file", ["figures/shields.svg", KEPT])
def test_a_figure_that_is_not_as_it_was_drawn_is_not_trusted(
    results: Results, draw: Draw, tmp_path: Path, file: str, harm: str
) -> None:
    before = bytes_of(tmp_path)
    path = tmp_path / file
    path.write_bytes(HARMS[harm](path.read_bytes()))
    assert "shields" in draw(results)
    assert bytes_of(tmp_path) == before


def test_a_figure_that_cannot_be_drawn_is_tried_again(
    results: Results, draw: Draw, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / KEPT).unlink()
    drawn = style.drawn_as

    def without_room(figure: style.Figure) -> style.Figure:
        if figure.name == "shields":
            raise MemoryError
        return drawn(figure)

    with monkeypatch.context() as broken:
        broken.setattr(style, "drawn_as", without_room)
        assert len(report.write(results, {}, Folder(tmp_path))) == 1
    assert draw(results) == {"shields"}


def test_whoever_asks_last_has_read_as_much_as_who_asks_first(
    results: Results,
) -> None:
    """What is made once for several figures is noted for each of them."""
    shared = replace(results)
    for kind in figures.kinds():
        with shared.noted() as last:
            [*kind.draw(shared)]
        own = replace(results)
        with own.noted() as first:
            [*kind.draw(own)]
        assert last == first, kind.name
        assert first.tables, kind.name


ASKED = {"name": "a", "text": "b", "tolerance": 0.05, "errors": None}
OTHER_ERRORS = SimpleNamespace(sha256="c")


def _source(folder: Path, monkeypatch: pytest.MonkeyPatch, **changes: Any) -> str:
    """What figures of a small study are drawn from, some of it changed."""
    words: dict[str, Any] = {"code": "d", "version": "1.0", "whole": True}
    words |= {"every": False, "ids": {"case": "e"}, **ASKED, **changes}
    monkeypatch.setattr(case, "code_of_all", lambda: words["code"])
    monkeypatch.setattr(case, "digest_of_results", lambda *_: "f")
    monkeypatch.setattr(case, "is_whole", lambda *_: words["whole"])
    monkeypatch.setattr(metadata, "version", lambda _: words["version"])
    study = SimpleNamespace(**{name: words[name] for name in ASKED})
    plan = SimpleNamespace(ids=words["ids"], cases={"case": None})
    results = SimpleNamespace(study=study, plan=plan, tables={}, cases=folder)
    asked = kept.Kept(Folder(folder), cast(Any, results), {}, every=words["every"])
    return json.dumps(asked.sources(Reads(set(), {"case"})))


@pytest.mark.parametrize(
    "change",
    [
        {"name": "b"},
        {"text": "c"},
        {"tolerance": 0.2},
        {"tolerance": None},
        {"errors": OTHER_ERRORS},
        {"code": "e"},
        {"version": "1.1"},
        {"ids": {"case": "g"}},
        {"whole": False},
        {"every": True},
    ],
    ids=str,
)
def test_all_that_a_figure_is_drawn_from_is_in_its_digest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any]
) -> None:
    before = _source(tmp_path, monkeypatch)
    assert _source(tmp_path, monkeypatch) == before
    assert _source(tmp_path, monkeypatch, **change) != before
