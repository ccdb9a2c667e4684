"""The order of the cases, and the time that they will take."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest

from orchestrator.errors import SolverError
from orchestrator.runs.agenda import Agenda
from orchestrator.runs.case import Case
from orchestrator.runs.engine import Outcome
from orchestrator.runs.progress import Forecast


@dataclass(frozen=True)
class Step(Case):
    """A case that is planned but never run."""

    size: float
    after: tuple[Case, ...] = ()
    kind: ClassVar[str] = "step"
    template: ClassVar[str] = "liggghts/checks"
    recipe: ClassVar[int] = 1
    results: ClassVar[tuple[str, ...]] = ()

    @property
    def parameters(self) -> dict[str, Any]:
        return {"size": self.size}

    @property
    def cost_s(self) -> float:
        return self.size

    @property
    def needs(self) -> tuple[Case, ...]:
        return self.after

    def write(self, directory: Path, cases: Path) -> None:
        pass

    def collect(self, directory: Path) -> None:
        pass

    def versions(self) -> dict[str, str]:
        return {}


@dataclass(frozen=True)
class Other(Step):
    """A case of another kind."""

    kind: ClassVar[str] = "other"


def _agenda(*cases: Case) -> Agenda:
    return Agenda({case.name: case for case in cases})


def test_the_start_of_the_dearest_chain_comes_first() -> None:
    shared = Step(1.0)
    dear, cheap, alone = Step(50.0, (shared,)), Step(2.0, (shared,)), Step(30.0)
    agenda = _agenda(cheap, alone, dear, shared)
    assert agenda.next() is shared
    assert agenda.next() is alone
    assert agenda.next() is None  # the others wait
    agenda.done(shared)
    assert [agenda.next(), agenda.next()] == [dear, cheap]
    assert not agenda


def test_a_case_waits_for_all_that_it_needs_and_for_nothing_that_is_done() -> None:
    one, two, before = Step(1.0), Step(2.0), Step(3.0)
    both = Step(4.0, (one, two, before))
    agenda = _agenda(one, two, both)
    assert {agenda.next(), agenda.next()} == {one, two}
    agenda.done(one)
    assert agenda.next() is None
    agenda.done(two)
    assert agenda.next() is both


def test_what_needs_a_lost_case_is_taken_out_and_nothing_else() -> None:
    first, other = Step(1.0), Step(2.0)
    second = Step(3.0, (first,))
    third = Step(4.0, (second, other))
    agenda = _agenda(first, other, second, third)
    assert {agenda.next(), agenda.next()} == {first, other}
    assert list(agenda.lost(first)) == [(second, first), (third, second)]
    agenda.done(other)
    assert agenda.next() is None
    assert not agenda


def test_the_time_left_follows_the_pace_of_each_kind() -> None:
    steps, others = [Step(10.0), Step(20.0)], [Other(100.0), Other(300.0)]
    forecast = Forecast([*steps, *others], workers=2)
    assert forecast.left_s() == pytest.approx(430 / 2)
    forecast.ended(Outcome(steps[0], 5.0))  # half of what was thought: the best guess for others
    assert forecast.left_s() == pytest.approx(0.5 * 420 / 2)
    forecast.ended(Outcome(others[0], 200.0))
    assert forecast.left_s() == pytest.approx((0.5 * 20 + 2 * 300) / 2)
    forecast.ended(Outcome(others[1], error=SolverError("died")))
    assert forecast.left_s() == pytest.approx(0.5 * 20 / 2)
    forecast.ended(Outcome(steps[1], 10.0))
    assert forecast.left_s() == 0


def test_progress_goes_on_within_a_case_and_until_the_figures_are_drawn() -> None:
    first, second = Step(10.0), Step(30.0)
    forecast = Forecast([first, second], workers=1, after_s=10.0)
    found = [forecast.done]
    forecast.going([(first, 0.5)])
    found.append(forecast.done)
    assert forecast.left_s() == pytest.approx(45.0)
    forecast.ended(Outcome(first, 10.0))
    found.append(forecast.done)
    forecast.going([(second, 1.0)])
    forecast.ended(Outcome(second, 30.0))
    found.append(forecast.done)
    assert found == pytest.approx([0.0, 0.1, 0.2, 0.8])
    assert forecast.left_s() == pytest.approx(10.0)
