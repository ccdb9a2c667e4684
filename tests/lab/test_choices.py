"""The choices of a study: what they are, what they cost, which share of thresholds they have."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator import plan
from orchestrator.fidelity.decision import as_written, with_criterion
from orchestrator.lab import chart, choices
from orchestrator.lab.choices import OPEN, REFERENCES, TOLERANCES, WITHIN, WRITTEN
from orchestrator.report import style
from orchestrator.study import study
from orchestrator.study.study import Study
from tests import letters

TEXT = """
bed = { kind = "pile", height = 0.01, roughness = "d/30" }
grain = { diameter = 1e-3 }
[axes]
"bed.slope_deg" = [15.0, 20.0]
"""
WATER = """
[[group]]
[[group]]
fluid = { kind = "water" }
grain = { density = 2650.0 }
forces = { law = "bridged" }
[[group]]
bed = { packing = "poured", height = 0.012 }
grain = { sizes = { sigma_g = 1.3 } }
"""


def _study(text: str) -> Study:
    return study.parse(text, name="one", where="one")


def test_each_kind_of_scene_has_its_own_chart() -> None:
    found = choices.kinds(_study(TEXT + WATER))
    names = ["entrainment", "sustained motion", "entrainment, poured beds"]
    assert [kind.name for kind in found] == names
    assert [len(kind.scenes) for kind in found] == [2, 2, 2]
    # the study's own answers are by the criterion that its fluid decides
    for kind in found:
        for choice in (*kind.choices, kind.reference):
            criteria = {one.scene.threshold.criterion for one in choice.answers}
            assert ("sustained" in criteria) == (kind.name == "sustained motion")
    (peeled,) = choices.kinds(_study('method.kind = "peeling"\n' + TEXT))
    assert peeled.name == "entrainment, by peeling"
    # the method is the study's own: the flow alone is a choice
    cells = {one.name for one in peeled.choices if one.fields}
    assert cells == {"20 cells", "40 cells (1.2)", "40 cells"}


def test_every_pair_of_rungs_is_a_choice_once_and_so_is_what_the_study_does() -> None:
    (kind,) = choices.kinds(_study(TEXT))
    pairs = [one for one in kind.choices if one.fields]
    own = [one.name for one in kind.choices if not one.fields]
    assert own == [WRITTEN, OPEN, *(f"tolerance {one:g}" for one in TOLERANCES)]
    # three meshes by four ways to move grains, and the mesh of the reference
    assert len(pairs) == len({one.name for one in pairs}) == 4 * 4
    assert len({one.scenes for one in pairs}) == len(pairs)
    assert kind.reference.scenes not in {one.scenes for one in pairs}
    for one in (*kind.choices, kind.reference):
        assert [answer.asked for answer in one.answers] == list(kind.scenes)
    # a tolerance is what a study does with it, and pays for its checks by DEM
    for one in kind.choices:
        if one.tolerance > 0:
            planned = plan.make(replace(_study(TEXT), tolerance=one.tolerance))
            checks = {each.scene.id for each in planned.checks.values()}
            answers = {each.scene.id for each in planned.decisions.values()}
            assert {each.scene.id for each in one.checks} == checks
            assert {each.scene.id for each in one.answers} == answers


def test_over_a_level_bed_no_flow_is_a_choice() -> None:
    text = TEXT.replace("height = 0.01", 'shape = "flat", length = 0.05')
    text = text.replace('[axes]\n"bed.slope_deg" = [15.0, 20.0]', "")
    (kind,) = choices.kinds(_study(text))
    names = [one.name for one in kind.choices if one.fields]
    assert names == ["pivot", "peeling", "DEM 1 × 3 %", "DEM 2 × 2 %"]
    # and by a method without DEM nothing is a choice
    assert choices.kinds(_study('method.kind = "peeling"\n' + text)) == []


@pytest.mark.parametrize("text", [TEXT, TEXT + WATER])
def test_the_lines_to_write_answer_as_the_choice_does(text: str) -> None:
    """They stand before the groups, as the first table of the file."""
    asked = _study(text)
    for kind in choices.kinds(asked):
        for choice in (kind.reference, *kind.choices):
            if not choice.fields:
                continue
            row = _row(kind.name, choice.name, 1.0, 1.0)
            if choice is kind.reference:
                row = _row(kind.name, REFERENCES, 1.0, 1.0)
            head, *lines = chart.advice(kind, pd.DataFrame([row]), "one.toml")
            assert head.startswith(f"# {kind.name}: 100 % of 8 thresholds within 5 %")
            # scenes that differ in a number of the method have a table each
            blocks = re.split(r"(?m)(?:^# for .*\n)+", "\n".join(lines))
            expected = {one.scene.id for one in choice.answers}
            answered: set[str] = set()
            for block in filter(None, blocks):
                with_lines = _study(text.replace("[axes]", f"{block}\n[axes]", 1))
                asked_now = map(with_criterion, with_lines.scenes)
                answered |= {as_written(one).scene.id for one in asked_now}
            assert expected <= answered, choice.name


@dataclass
class _Runs:
    """Runs whose thresholds and costs are set: those of 20 cells are 4 % high."""

    kind: choices.Kind
    cases: Path = Path()
    lacking: frozenset[str] = field(default_factory=frozenset)

    @property
    def planned(self) -> Any:
        every = self.kind.decisions
        return SimpleNamespace(piles={key: self._pile(every[key]) for key in every})

    def _pile(self, answer: Any) -> Any:
        method = answer.scene.method
        cells = method.flow.cells_per_face
        factor = 1.04 if cells == 20 else 1.0
        if method.kind == "pivot":
            factor *= 1.2
        costs = {f"flow {answer.scene.bed.slope_deg} {cells}": float(cells)}
        if method.is_resolved_in_time:
            costs[f"dem {answer.scene.id}"] = 1000.0
        values = [factor, 2 * factor, math.nan, 3.0]
        if method.kind == "peeling":
            values[-1] = math.nan

        def thresholds(_: Path, fractions: Sequence[float]) -> list[Any]:
            assert len(fractions) == len(values)
            return [SimpleNamespace(tau=value) for value in values]

        runs = [SimpleNamespace(name=name, cost=costs[name]) for name in costs]
        cases = runs if method.is_resolved_in_time else ()
        return SimpleNamespace(
            runs=runs, method=SimpleNamespace(cases=cases), thresholds=thresholds
        )

    def are_done(self, *keys: str) -> bool:
        return not self.lacking.intersection(keys)

    def cpu_s(self, runs: Sequence[Any]) -> float:
        return float(sum(run.cost for run in runs))


@pytest.fixture
def shares(monkeypatch: pytest.MonkeyPatch) -> pd.DataFrame:
    monkeypatch.setattr(choices, "time_alone_s", lambda *_: 0.5)
    (kind,) = choices.kinds(_study(TEXT))
    runs: Any = _Runs(kind)
    return choices.shares([kind], runs)


def test_shares_count_thresholds_and_costs_each_case_once(shares: pd.DataFrame) -> None:
    rows = shares.set_index("choice")
    assert len(rows) == len(shares) == 1 + 16 + 2 + len(TOLERANCES)
    # of four fractions of two scenes one was reached by none
    assert (shares["thresholds"] == 6).all()
    best = rows.loc[REFERENCES]
    assert [best[choices.column(one)] for one in WITHIN] == [1.0] * 5
    assert best["core_s"] == pytest.approx(2 * (80 + 1000))
    coarse = rows.loc["20 cells, DEM 2 × 2 %"]
    # two of three are 4 % high
    found = [coarse[choices.column(one)] for one in WITHIN]
    np.testing.assert_allclose(found, [1 / 3, 1 / 3, 1, 1, 1])
    assert coarse["largest"] == pytest.approx(0.04)
    # peeling does not reach the last fraction, which the reference does
    peeled = rows.loc["40 cells, peeling"]
    assert peeled[choices.column(0.2)] == pytest.approx(2 / 3)
    assert peeled["largest"] == math.inf
    assert peeled["core_s"] == pytest.approx(2 * (40 + 0.5))
    assert rows.loc["40 cells, pivot", choices.column(0.2)] == 1.0
    assert rows.loc["20 cells, pivot", choices.column(0.2)] == pytest.approx(1 / 3)


def test_it_is_told_where_the_reference_itself_is_not_known_within_an_error(
    shares: pd.DataFrame,
) -> None:
    (kind,) = choices.kinds(_study(TEXT))
    errors = []
    for answer in kind.reference.answers:
        fractions = answer.asked.threshold.fractions
        # no run reached the third
        errors += [answer.error_at(fractions[at]) for at in (0, 1, 3)]
    for within in WITHIN:
        known = np.mean([error is not None and error <= within for error in errors])
        column = choices.column_of_reference(within)
        assert shares[column].tolist() == [known] * len(shares)
        with style.settings():
            (ax,) = chart.draw(shares, [within]).axes
        (line,) = [each for each in ax.lines if each.get_gid() == "reference"]
        assert np.asarray(line.get_ydata(), float) == pytest.approx(100 * known)
    assert shares[choices.column_of_reference(0.2)].iloc[0] > 0
    assert shares[choices.column_of_reference(0.01)].iloc[0] < 1


def test_a_choice_is_charted_where_all_of_its_runs_are_done(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(choices, "time_alone_s", lambda *_: 0.5)
    (kind,) = choices.kinds(_study(TEXT))
    first, *_ = kind.choices[0].decisions
    runs: Any = _Runs(kind, lacking=frozenset({first}))
    found = choices.shares([kind], runs)
    assert kind.choices[0].name not in set(found["choice"])
    assert len(found) > 10
    lacking = frozenset(kind.reference.decisions)
    none: Any = _Runs(kind, lacking=lacking)
    assert choices.shares([kind], none).empty


def _row(kind: str, choice: str, cost_s: float, share: float, **other: Any) -> Any:
    within = {choices.column(one): share for one in WITHIN}
    about: Mapping[str, Any] = {"scenes": 2, "thresholds": 8, "tolerance": math.nan}
    row = {"kind": kind, "choice": choice, "grains": "", "core_s": cost_s, **about}
    return {**row, **within, "largest": 0.1, **other}


def test_the_cheapest_choice_that_is_good_enough_is_recommended() -> None:
    rows = [
        _row("entrainment", REFERENCES, 100.0, 1.0),
        _row("entrainment", "a", 3.0, 0.94),
        _row("entrainment", "b", 5.0, 0.96),
        _row("entrainment", "c", 7.0, 0.99),
        _row("entrainment", "d", 8.0, 0.97),
    ]
    table = pd.DataFrame(rows)
    assert chart.recommended(table)["choice"] == "b"
    assert chart.recommended(table.iloc[:2])["choice"] == REFERENCES
    front = choices.front(table, 0.05)
    assert table.loc[front, "choice"].tolist() == [REFERENCES, "a", "b", "c"]


def test_a_study_that_chooses_by_itself_is_told_its_command() -> None:
    (kind,) = choices.kinds(_study(TEXT))
    rows = [
        _row("entrainment", REFERENCES, 100.0, 1.0),
        _row("entrainment", "tolerance 0.1", 2.0, 1.0, tolerance=0.1),
    ]
    lines = chart.advice(kind, pd.DataFrame(rows), "mine.toml")
    assert lines[1:] == ["orchestrator study mine.toml --tolerance 0.1"]
    open_ = pd.DataFrame([rows[0], _row("entrainment", OPEN, 2.0, 1.0)])
    assert chart.advice(kind, open_, "mine.toml")[1:] == ["[method]", 'kind = "auto"']


def test_points_of_the_chart_are_the_shares_and_its_letters_are_large(
    shares: pd.DataFrame,
) -> None:
    with style.settings(style.LETTERS):
        for width in letters.SHOWN:
            letters.check(chart.draw(shares, [0.05, 0.2], width))
        canvas = chart.draw(shares, [0.05, 0.2])
        (alone,) = chart.draw(shares, [0.05], style.WIDE).axes
    names = " ".join(" ".join(text.get_text().split()) for text in alone.texts)
    for choice in (WRITTEN, OPEN, REFERENCES, "20 cells, peeling"):
        assert choice in names
    assert canvas.get_figwidth() == style.NARROW
    for ax, within in zip(canvas.axes, (0.05, 0.2), strict=True):
        drawn = [line for line in ax.lines if line.get_gid() == "points"]
        xy = np.concatenate([np.asarray(line.get_xydata(), float) for line in drawn])
        expected = shares[["core_s", choices.column(within)]] * [1, 100]
        rising = np.lexsort(xy.T[::-1])
        np.testing.assert_allclose(xy[rising], expected.sort_values([*expected]))
        named = " ".join(" ".join(text.get_text().split()) for text in ax.texts)
        for choice in shares.loc[choices.front(shares, within), "choice"]:
            assert choice.removeprefix("tolerance ") in named
    looks = chart.LOOKS.values()
    assert len({look["marker"] for look in looks}) == len(looks)
    assert len({look.get("color") for look in looks}) == len(looks)
