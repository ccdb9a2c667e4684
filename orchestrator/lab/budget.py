"""The budget: how far the choices that all fidelities share move a threshold.

A choice is changed alone, by the cheapest fidelity that feels it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Patch

from orchestrator import plan
from orchestrator.digits import percent
from orchestrator.errors import InputError
from orchestrator.experiment import Experiment, ExperimentResults, Runs, label, piles
from orchestrator.fidelity import limits, spread
from orchestrator.fidelity.decision import Decision, on_fidelity
from orchestrator.fidelity.fidelities import OWN, Fidelity, named
from orchestrator.fidelity.spread import FROZEN
from orchestrator.grains.pile import Pile
from orchestrator.physics.laws import LAWS
from orchestrator.report import style
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import IN_SENTENCES, Limits, Paragraphs, Section, Table
from orchestrator.report.results import FRACTION
from orchestrator.report.style import Figure
from orchestrator.study.closed_form import law_holds
from orchestrator.study.fidelities import Fields
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study, changed, value_of
from orchestrator.tables.quantities import shields

QUASI_STATIC = named("static")
"""Fidelity of the choices but for those that dynamics alone feel."""
DYNAMIC = named("paper")
"""Fidelity whose grains move where a choice is felt by dynamics alone."""
SEEDS = (1, 2, 3)
"""Other draws of a random packing that are as good."""
QUANTITIES = {
    "shields": "Shields number $θ$",
    "ustar0": "undisturbed friction velocity $u^*_0$",
}
"""What a choice moves, with its label in figures."""
BARS: dict[str, style.Look] = {
    "shields": {"fc": "white", "ec": style.FLOW, "hatch": "////", "lw": 0.8},
    "ustar0": {"fc": style.ANSWER, "ec": style.ANSWER, "lw": 0.8},
}
"""How their bars look."""
BAR = 0.4
"""Height of a bar, rows of a figure."""
OFFSETS = {
    "shields": BAR / 2,
    "ustar0": -BAR / 2,
}
"""Middles of the bars over that of their row, rows."""
ROW = 0.42
"""Height of a row of a figure, inches."""
FELT = 0.005
"""Relative change that is felt: a choice of less has no number at its bar."""
ENDS = ["shields_low", "shields_high", "ustar0_low", "ustar0_high"]
"""Columns: how far each quantity moves down and up, relative."""
BASE = "as asked"
"""End of the name, in the plan, of a pile without a change."""


@dataclass(frozen=True)
class Choice:
    """One choice that all fidelities share, and what else it could be.

    Attributes
    ----------
    name
        Its name.
    why
        Why it could be something else, within what measurements and good practice
        leave open.
    field
        The field of a scene that it is.
    values
        Alternatives: values of the field.
    times
        Alternatives: factors on the scene's value.
    beside
        Alternatives: sums added to the scene's value, degrees.
    packings
        Whether "all" piles have it, "lattices" or "poured" beds alone.
    of_solved_flow
        Whether it moves nothing under another flow than a solved one.
    dynamic
        Whether DEM alone feels it.
    """

    name: str
    why: str
    field: str
    values: Sequence[Any] = ()
    times: Sequence[float] = ()
    beside: Sequence[float] = ()
    packings: str = "all"
    of_solved_flow: bool = False
    dynamic: bool = False

    def fidelity(self, scene: Scene) -> Fidelity:
        """Choose the fidelity by which it is changed in a scene.

        Returns
        -------
        Fidelity
            The flow is that of `QUASI_STATIC`; a flow model that is not solved is kept.
        """
        flow = QUASI_STATIC.flow if scene.method.flow.facts.is_solved else OWN
        grains = DYNAMIC.grains if self.dynamic else QUASI_STATIC.grains
        return Fidelity(f"{flow.name} | {grains.name}", "", flow, grains)

    def scenes(self, scene: Scene) -> Iterator[tuple[str, Scene]]:
        """List the alternatives that a scene can have.

        Yields
        ------
        name, other
            The alternative's name, and the scene with it.
        """
        if not self._concerns(scene):
            return
        for name, fields in self._alternatives(scene).items():
            try:
                other = changed(scene, fields)
            except InputError:
                # the scene cannot have it
                continue
            if other != scene and self._holds(other):
                yield name, other

    def _concerns(self, scene: Scene) -> bool:
        """Whether a scene has this choice."""
        others = "lattices" if scene.is_poured else "poured"
        if self.packings == others:
            return False
        return scene.method.flow.facts.is_solved or not self.of_solved_flow

    def _holds(self, other: Scene) -> bool:
        """Whether a scene with an alternative is one to compare with."""
        return True

    def _value(self, scene: Scene) -> Any:
        """What a scene has."""
        return value_of(scene, self.field)

    def _alternatives(self, scene: Scene) -> dict[str, Fields]:
        """The fields that each alternative sets, by its name."""
        others = {str(other): other for other in self.values}
        for factor in self.times:
            others[f"{factor:g} times"] = factor * self._value(scene)
        for added in self.beside:
            others[f"{added:+g}°"] = self._value(scene) + added
        return {name: {self.field: other} for name, other in others.items()}


class _FirstCell(Choice):
    """The height of the first cell, which a scene may leave open."""

    def _value(self, scene: Scene) -> float:
        return scene.first_cell_height


class _ForceLaw(Choice):
    """The force law: every law that holds and takes part in the interval of a grain."""

    def _holds(self, other: Scene) -> bool:
        return law_holds(other)

    def _alternatives(self, scene: Scene) -> dict[str, Fields]:
        compared = [law for law in LAWS.values() if law.in_interval]
        return {law.label: {self.field: law.name} for law in compared}


class _Packing(Choice):
    """The packing: on lattices other rows and gaps, on poured beds other seeds."""

    def _alternatives(self, scene: Scene) -> dict[str, Fields]:
        if scene.is_poured:
            return {f"poured, seed {seed}": {"bed.seed": seed} for seed in SEEDS}
        alternatives: dict[str, Fields] = {
            "rows along the slope": {"bed.packing": "aligned"},
            "horizontal rows": {"bed.packing": "horizontal"},
        }
        for seed in SEEDS:
            alternatives[f"random gaps, seed {seed}"] = {
                "bed.packing": "disordered",
                "bed.disorder": 0.05,
                "bed.seed": seed,
            }
        return alternatives


CHOICES: tuple[Choice, ...] = (
    _FirstCell(
        name="first cell",
        why="A wall function leaves the height of the first cell open.",
        field="method.flow.first_cell_height",
        times=[0.5, 2.0],
        of_solved_flow=True,
    ),
    Choice(
        name="turbulence model",
        why="No model is right for all flows that separate.",
        field="method.flow.turbulence_model",
        values=["kEpsilon", "RNGkEpsilon", "realizableKE", "kOmegaSST"],
        of_solved_flow=True,
    ),
    Choice(
        name="reading of the stress",
        why="The paper reads it off the first cells by Eq. 10.",
        field="forces.stress",
        values=["wall", "eq10"],
        of_solved_flow=True,
    ),
    Choice(
        name="averaging length",
        why="The stress at a sharp crest diverges with the mesh; it is averaged.",
        field="forces.averaging_length",
        times=[0.5, 2.0],
        of_solved_flow=True,
    ),
    _ForceLaw(
        name="force law",
        why="All laws that hold at the Re* of the scene.",
        field="forces.law",
    ),
    Choice(
        name="roughness length",
        why="Measured values over beds of equal grains lie between d/30 and d/10.",
        field="bed.roughness",
        values=["d/10", "d/30"],
    ),
    Choice(
        name="entrainment angle",
        why="The pockets of one bed scatter by more than 5°.",
        field="bed.entrainment_angle_deg",
        beside=[-5.0, 5.0],
        packings="lattices",
    ),
    Choice(
        name="lift coefficient",
        why="Saffman’s value is for an unbounded shear; measured values scatter more.",
        field="forces.lift_coefficient",
        times=[0.5, 1.5],
    ),
    _Packing(
        name="packing",
        why="The packing of a bed that was not surveyed is not known.",
        field="bed.packing",
    ),
    Choice(
        name="exposure",
        why="All poured grains protrude alike into the flow, or each by its height.",
        field="forces.exposure",
        values=["alike", "protrusion"],
        packings="poured",
    ),
    Choice(
        name="criterion of motion",
        why="What counts as moved is a convention: a sixth to a half of a diameter.",
        field="threshold.displacement",
        values=[0.15, 0.5],
    ),
    Choice(
        name="friction angle",
        why="That of a sand is known to a few degrees; a poured bed is poured anew.",
        field="grain.friction_angle_deg",
        beside=[-5.0, 5.0],
        dynamic=True,
    ),
    Choice(
        name=FROZEN,
        why="The article, and every method, keeps the flow over the initial pile until "
        "the last grain is entrained; here the bed is updated after each tenth.",
        field="threshold.update",
        values=[0.1],
        of_solved_flow=True,
    ),
)
"""The choices that all fidelities share."""


class Change(NamedTuple):
    """An alternative of a choice at a scene.

    Attributes
    ----------
    scene
        The scene.
    choice
        The choice.
    alternative
        Name of the alternative.
    base, other
        Names in the plan of the pile without it and with it.
    """

    scene: Scene
    choice: Choice
    alternative: str
    base: str
    other: str


def changes(study: Study) -> tuple[list[Change], dict[str, Decision]]:
    """List the alternatives of each pile of a study.

    Returns
    -------
    listed, asked
        The alternatives, and the piles to be answered by their names in the plan.
    """
    listed: list[Change] = []
    asked: dict[str, Decision] = {}
    why = "the budget changes one choice"
    for scene in piles(study):
        for choice in CHOICES:
            fidelity = choice.fidelity(scene)
            start = f"{scene.id} | {fidelity.name} | "
            base = f"{start}{BASE}"
            asked[base] = on_fidelity(scene, fidelity, why)
            for name, changed_scene in choice.scenes(scene):
                other = f"{start}{choice.name}: {name}"
                asked[other] = on_fidelity(changed_scene, fidelity, why)
                listed.append(Change(scene, choice, name, base, other))
    return listed, asked


class Budget(Experiment):
    """What each shared choice is worth, changed alone on the piles of a study.

    Parameters
    ----------
    study
        The study.
    out
        Directory of its runs.

    Raises
    ------
    InputError
        If the study has no pile, or a scene is beyond the limits of the methods.
    """

    name = "budget"
    title = "What a threshold is worth"

    def __init__(self, study: Study, out: Path) -> None:
        limits.check_study(study)
        self.changes, asked = changes(study)
        super().__init__(plan.of(asked, cases=out.absolute() / "cases"), study)
        # a flow model may refuse a bed: only runs of the scenes as they are asked count
        # as failed
        bases = [self.planned.piles[change.base] for change in self.changes]
        self.failing = {run.name for pile in bases for run in pile.runs}

    def results(self, runs: Runs) -> ExperimentResults | None:
        """Measure the changes whose runs are done."""
        moved = measure(self.changes, runs)
        if moved.empty:
            return None
        shared = shares_of_choices(moved)
        tables = {"changes": moved, "shares": shared, "budget": largest_shares(shared)}
        return ExperimentResults(tables, _sections(self.changes, moved, shared, runs))


def measure(listed: Sequence[Change], runs: Runs) -> pd.DataFrame:
    """Measure how far each alternative moves the threshold.

    Parameters
    ----------
    listed
        The alternatives.
    runs
        The runs.

    Returns
    -------
    DataFrame
        A row for each scene, alternative and fraction: the relative change of the
        Shields number and of the undisturbed friction velocity. Alternatives whose runs
        are not done are left out.
    """
    done = [change for change in listed if runs.are_done(change.base, change.other)]
    thresholds = {}
    for key, pile in runs.planned.piles.items():
        if runs.are_done(key):
            fractions = pile.scene.threshold.fractions
            thresholds[key] = pile.thresholds(runs.cases, fractions)
    rows = []
    for change in done:
        of_scene = {
            "scene_id": change.scene.id,
            "scene": label(change.scene),
            "model_class": spread.model_class(change.scene),
            "choice": change.choice.name,
            "alternative": change.alternative,
        }
        both = thresholds[change.base], thresholds[change.other]
        for before, after in zip(*both, strict=True):
            row = {
                **of_scene,
                "fraction": before.fraction,
                "shields": after.tau / before.tau - 1,
                "ustar0": after.ustar0 / before.ustar0 - 1,
            }
            rows.append(row)
    return pd.DataFrame(rows)


def shares_of_choices(moved: pd.DataFrame) -> pd.DataFrame:
    """Find how far down and up the alternatives of a choice move each scene.

    Parameters
    ----------
    moved
        The rows of `measure`.

    Returns
    -------
    DataFrame
        A row for each scene, choice and fraction, with the columns `ENDS`, all at least
        0.
    """
    keys = ["scene_id", "scene", "model_class", "choice", "fraction"]
    grouped = moved.dropna(subset=list(QUANTITIES)).groupby(keys, sort=False)
    ends = {}
    for name in QUANTITIES:
        ends[f"{name}_low"] = 0.0 - grouped[name].min().clip(upper=0.0)
        ends[f"{name}_high"] = grouped[name].max().clip(lower=0.0)
    return pd.DataFrame(ends).reset_index()


def largest_shares(shared: pd.DataFrame) -> pd.DataFrame:
    """Find the largest share of each choice in a class: what the package keeps.

    Parameters
    ----------
    shared
        The rows of `shares_of_choices`.

    Returns
    -------
    DataFrame
        A row for each class of scenes, choice and fraction, with the columns `ENDS` and
        the number of scenes.
    """
    keys = ["model_class", "choice", "fraction"]
    grouped = shared.groupby(keys, sort=False)
    largest = grouped[ENDS].max()
    return largest.assign(scenes=grouped["scene_id"].nunique()).reset_index()


TOGETHER_TEXT = """\
Numerical errors are measured against the finest method and do not contain the \
assumptions that all methods share. These assumptions are changed here one at a time. \
All together is the root of the sum of their squares, as if they were independent."""
SCENE_TEXT = """\
The choices are sorted by their effect on the threshold. Each bar spans the largest \
change over the fractions, down and up, %; the number is of both ends. Grains move by \
peeling; where only DEM feels a choice, by DEM. The Shields number is that of the \
mean stress on the grains that moved."""
CHANGING_TEXT = """\
All methods keep the flow over the whole pile until the last grain has gone, as the \
article does. Here the bed line is updated after each tenth of the counted grains and \
the flow is solved again; the grains move by peeling. The table has the relative \
change of the threshold."""
LIMIT_TEXT = """\
The ranges of the choices are judgements, with the reason beside each, and no \
statistics. Alternatives that do not apply to a scene, or whose force law does not \
hold at its Re*, are left out."""
ALONE = "Change of the threshold by each choice alone, %"
"""Heading of the figure of a scene."""


class _Interval(NamedTuple):
    """A value with its interval of all choices together.

    `low` and `high` are relative, and `most` is the choice that moves it most.
    """

    value: float
    low: float
    high: float
    most: str

    @property
    def number(self) -> str:
        """The value as text."""
        return f"{self.value:#.3g}"

    @property
    def ends(self) -> str:
        """The ends of the interval as text."""
        low = self.value * (1 - self.low)
        high = self.value * (1 + self.high)
        return f"{low:#.3g} … {high:#.3g}"


def _sections(
    listed: Sequence[Change],
    moved: pd.DataFrame,
    shared: pd.DataFrame,
    runs: Runs,
) -> list[Section]:
    """The page: all choices, the bed that changes, the scenes, the alternatives."""
    bases: dict[str, str] = {}
    for change in listed:
        bases.setdefault(change.scene.id, change.base)
    rows = []
    tornados: list[Section] = []
    for scene_id, of_scene in shared.groupby("scene_id", sort=False):
        base = runs.planned.piles[bases[str(scene_id)]]
        figure = f"tornado-{len(tornados) + 1}"
        row, section = _of_scene(of_scene, base, runs.cases, figure)
        rows.append(row)
        tornados.append(section)
    together = Section(
        "All choices together",
        [
            Paragraphs(TOGETHER_TEXT, "lead"),
            Limits([LIMIT_TEXT]),
            Table.of(pd.DataFrame(rows)),
        ],
    )
    first, *others = tornados
    of_bed = _changing_bed(moved)
    return [first, together, *of_bed, *others, _alternatives(moved)]


def _of_scene(
    shared: pd.DataFrame,
    base: Pile,
    cases: Path,
    figure: str,
) -> tuple[dict[str, str], Section]:
    """A row of the table and a section of the page, by the shares at one scene."""
    largest = shared.groupby("choice", sort=False)[ENDS].max()
    fraction = min(shared["fraction"], key=_from_usual)
    (at,) = base.thresholds(cases, [fraction])
    theta = _interval(largest, "shields", shields(base.scene, at.tau))
    ustar0 = _interval(largest, "ustar0", at.ustar0)
    name = str(shared["scene"].iloc[0])
    chart = Figure.of_both_widths(figure, ALONE, SCENE_TEXT, partial(tornado, largest))
    told = _in_words(name, fraction, theta, ustar0)
    said = f"{name}; criterion: {base.scene.threshold.criterion}"
    card = _card(said, fraction, theta, ustar0)
    section = Section("", [card, chart, Paragraphs(told, fold=IN_SENTENCES)])
    return _row(name, theta, ustar0), section


def _from_usual(fraction: float) -> float:
    """Distance of a fraction from the one that stands for a pile."""
    return abs(float(fraction) - FRACTION)


def _interval(largest: pd.DataFrame, quantity: str, value: float) -> _Interval:
    """A value with the interval of all choices together."""
    low, high = spread.combined_shares(largest, quantity)
    widths = largest[f"{quantity}_low"] + largest[f"{quantity}_high"]
    return _Interval(value, low, high, most=str(widths.idxmax()))


def _row(name: str, theta: _Interval, ustar0: _Interval) -> dict[str, str]:
    """A row of the table of all choices together."""
    return {
        "scene": name,
        "θ": theta.number,
        "θ: interval": theta.ends,
        "θ: most by": theta.most,
        "u*₀, m/s": ustar0.number,
        "u*₀, m/s: interval": ustar0.ends,
        "u*₀, m/s: most by": ustar0.most,
    }


def _card(name: str, fraction: float, theta: _Interval, ustar0: _Interval) -> Card:
    """The answer card: the numbers of a bed with all choices together."""
    part = percent(fraction)
    of_what = "all choices that the methods share, combined"
    numbers = []
    for of, unit, meaning in (
        (ustar0, "m/s", "friction velocity u*, √(τ_b/ρ)"),
        (
            theta,
            "",
            "critical Shields number θ_c, τ_b/((ρ_s − ρ) g d)",
        ),
    ):
        numbers.append(
            Number(
                of.value,
                unit,
                meaning,
                f"largest effect: {of.most}",
                low=of.value * (1 - of.low),
                high=of.value * (1 + of.high),
                interval_of=of_what,
            )
        )
    return Card(
        f"How well is the flow known that moves {part} of these grains?",
        f"{name}.",
        tuple(numbers),
        "Nothing is measured here: each choice of the model, such as the packing, is "
        "changed alone within what measurements and practice leave open.",
        Worth(
            "care",
            "usable, with its interval",
            "Quote the interval beside the threshold. A choice that is known of a bed, "
            "such as its packing, need not be in it.",
        ),
    )


def _in_words(
    name: str,
    fraction: float,
    theta: _Interval,
    ustar0: _Interval,
) -> str:
    """The same in a sentence."""
    go = f"{name}: {percent(fraction)} of the exposed grains move at θ = {theta.number}"
    together = f"{theta.ends} with all choices together, most by {theta.most}"
    return f"{go} ({together}), u*₀ = {ustar0.number} m/s ({ustar0.ends})."


def _changing_bed(moved: pd.DataFrame) -> list[Section]:
    """What the bed that changes is worth; nothing if no flow was solved anew."""
    frozen = moved[moved["choice"] == FROZEN]
    if frozen.empty:
        return []
    table = pd.DataFrame(
        {
            "scene": frozen["scene"],
            "n/N": frozen["fraction"],
            "θ, %": 100 * frozen["shields"],
            "u*₀, %": 100 * frozen["ustar0"],
        }
    )
    text = Paragraphs(CHANGING_TEXT, "lead")
    return [Section("The bed that changes", [text, Table.of(table)])]


def _alternatives(moved: pd.DataFrame) -> Section:
    """The choices with the alternatives that were tried."""
    rows = []
    for choice in CHOICES:
        tried = moved.loc[moved["choice"] == choice.name, "alternative"]
        if not tried.empty:
            names = ", ".join(dict.fromkeys(tried))
            rows.append((choice.name, names, choice.why))
    table = pd.DataFrame(rows, columns=["choice", "alternatives", "why"])
    return Section("The choices and their alternatives", [Table.of(table)])


def tornado(largest: pd.DataFrame, width: float) -> Canvas:
    """Draw what each choice moves at one scene.

    Parameters
    ----------
    largest
        The largest share of each choice over the fractions; rows are the choices.
    width
        Width of the drawing, inches.

    Returns
    -------
    Canvas
        A bar with its ends for each choice and quantity, the widest on top, and all
        together.
    """
    rising = largest.max(axis=1).sort_values()
    largest = largest.loc[rising.index]
    total: list[float] = []
    for name in QUANTITIES:
        total += spread.combined_shares(largest, name)
    together = pd.DataFrame([total], columns=ENDS, index=["all together"])
    rows = pd.concat([largest, together])
    canvas = style.canvas(ROW * len(rows) + 1.3, width)
    ax = canvas.subplots()
    for name, offset in OFFSETS.items():
        low = 100 * rows[f"{name}_low"]
        high = 100 * rows[f"{name}_high"]
        y = np.arange(len(rows)) + offset
        ax.barh(y, low + high, BAR, left=-low, label=f"_{name}", gid=name, **BARS[name])
        _ends(ax, y, low, high, BARS[name]["ec"])
    ax.axvline(0.0, color="0.2", lw=0.8)
    ax.axhline(len(largest) - 0.5, color="0.7", lw=0.6)
    ax.set_yticks(range(len(rows)), list(rows.index))
    ax.set_ylim(-0.6, len(rows) - 0.4)
    ax.set_xlabel("change of the threshold, %")
    # room for the numbers beside the longest bars
    most = 100 * float(rows.filter(like="high").to_numpy().max())
    least = -100 * float(rows.filter(like="low").to_numpy().max())
    room = (0.75 if width < style.WIDE else 0.3) * (most - least)
    ax.set_xlim(least - 0.05 * (most - least), most + room)
    entries = [Patch(label=text, **BARS[name]) for name, text in QUANTITIES.items()]
    style.legends_below(canvas, entries, [])
    return canvas


def _ends(
    ax: Axes,
    y: "np.ndarray[Any, Any]",
    low: "pd.Series[float]",
    high: "pd.Series[float]",
    colour: str,
) -> None:
    """Write both ends of each bar that is felt beside it."""
    for place, down, up in zip(y, low, high, strict=True):
        if max(down, up) >= 100 * FELT:
            ends = f" −{down:.0f} … +{up:.0f}".replace("−0 …", "0 …")
            text = ends.replace("… +0", "… 0")
            ax.text(up, place, text, va="center", color=colour)
