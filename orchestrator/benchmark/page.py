"""The page of a comparison: figures and tables of all solvers side by side."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.benchmark import judge
from orchestrator.benchmark.judge import OURS
from orchestrator.benchmark.pack import Pack
from orchestrator.errors import printable
from orchestrator.physics import curves
from orchestrator.report import page, style
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import (
    IN_SENTENCES,
    Element,
    Limits,
    Paragraphs,
    Section,
    Table,
)
from orchestrator.report.style import DIAMETERS, PANELS, WATER, Figure, Look
from orchestrator.runs.files import Folder
from orchestrator.types import FloatArray

PAGE = "comparison.html"
FLOOR = 1e-6
"""Least relative error on a logarithmic axis."""
CEILING = 1e3
"""Largest relative error on a logarithmic axis."""
CPU_S = (1e-6, 1e8)
"""Least and largest time on a logarithmic axis, s: others may have noted any number."""
EXPECTED = "0.25"
"""Colour of the expected answer, and of ours."""
ROOM = 1.0
"""Room above and below the expected answers of a panel in which answers are drawn, over
their range."""
MARKERS = {1: "o", 2: "s", 3: "D", 4: "^", 5: "v"}
"""Markers of the levels."""
LIMITS = (
    "Levels 1 and 2 are compared with exact answers, levels 3 to 5 with our own runs.",
    "The intervals hold a load step, the resolution of the count and the scatter over"
    " packings where it was run; they do not hold the error of the flow model.",
    "Scenes of less than a second are mostly start-up of the programs.",
)
ERRORS = (
    "Errors are relative, over the judged numbers of a scene; the bias is their median"
    " with\nits sign. Times are the solver’s over ours, which ran in turn with it, the"
    " median of the scenes.\nEvery number is in comparison.csv beside this page, every"
    " scene in verdicts.csv. The programs below\ngave the expected answers."
)
QUANTITIES = (
    "Errors are signed: the median over all answers to a quantity. Where all are off"
    " alike, the last column says how.\nThe rows are in quantities.csv beside this"
    " page."
)
THRESHOLDS = (
    "Critical Shields numbers. One with a * is outside the interval of the"
    " expected\nanswer, one with ** also beyond its tolerance: it fails."
)
SHOWN = {
    "solver": "solver",
    "scene": "scene",
    "passed": "passed",
    "error": "error, %",
    "worst": "largest, %",
    "seconds": "s",
    "ratio": "over ours",
    "cpu_s": "CPU, s",
    "cpu_ratio": "CPU over ours",
    "peak_mib": "MiB",
    "steps": "time steps",
}
"""Columns of the table of scenes."""
BEDS = (
    ("flow", "ustar_over_ustar0", "stress", "Friction velocity along the bed"),
    ("pile", "moved", "moved", "Grains that have moved, under the given stress"),
    (
        "line",
        "moved",
        "moved-line",
        "Grains that have moved, with the solver’s own flow",
    ),
)
"""Figures of the beds: kind of scene, quantity, stem and title."""
AXES: dict[str, tuple[str, str, Look]] = {
    "ustar_over_ustar0": ("s/h", "u*/u*₀", {"xlim": (-3, 12)}),
    "moved": ("load step", "n/N", {"ylim": (0, 1)}),
}
"""Labels of a quantity's axes, and their limits."""


def write_page(
    chosen: Pack,
    numbers: pd.DataFrame,
    verdicts: pd.DataFrame,
    folder: Folder,
    notes: Sequence[str] = (),
) -> None:
    """Put the page and its figures into a directory.

    Parameters
    ----------
    chosen
        The pack.
    numbers, verdicts
        The tables of `judge.judge_solvers`.
    folder
        The directory.
    notes
        What is said of the answers before the verdicts.
    """
    theirs = verdicts[verdicts["solver"] != OURS]
    scenes = theirs[[*SHOWN]].assign(
        error=100 * theirs["error"],
        worst=100 * theirs["worst"],
        passed=np.where(theirs["passed"], "yes", "no"),
    )
    scenes = scenes.rename(columns=SHOWN)
    with style.settings(style.LETTERS), warnings.catch_warnings():
        # the name of a solver may have letters that the font has not
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        beds = _beds(numbers, theirs) + _shields(chosen, numbers)
        listed = pile_thresholds(numbers)
        of_beds: list[Element] = [*beds]
        if len(listed):
            of_beds += [Paragraphs(THRESHOLDS, "lead"), Table.of(listed)]
        said = "\n\n".join([*notes, *judge.in_words(theirs)])
        in_sentences = Paragraphs(said, fold=IN_SENTENCES)
        failures = judge.failures(theirs)
        by_quantity = judge.by_quantity(numbers)
        quantities: list[Element] = []
        if len(by_quantity):
            quantities = [Paragraphs(QUANTITIES, "lead"), Table.of(by_quantity)]
        times: list[Element] = [Limits(LIMITS), *_speed(verdicts)]
        sections = [
            Section("", [_card(theirs), in_sentences, Table.of(judge.summary(theirs))]),
            Section("What failed", [Table.of(failures)] if len(failures) else []),
            Section("By quantity", quantities),
            Section("Beds", of_beds),
            Section(
                "Time and error", [*times, Paragraphs(ERRORS, "lead"), Table.of(scenes)]
            ),
        ]
        names = ", ".join(theirs["solver"].unique())
        title = f"Against the pack “{printable(chosen.root.name)}”: {names}"
        shown = [section for section in sections if section.content]
        page.write_experiment(title, shown, folder, PAGE, chosen.manifest.programs)


def _beds(numbers: pd.DataFrame, theirs: pd.DataFrame) -> list[Figure]:
    """The figures of `BEDS` whose kind of scene a solver has answered."""
    answered = theirs[theirs["answered"]].groupby("kind")["scene"].unique()
    figures = []
    for kind, quantity, name, title in BEDS:
        if kind in answered:
            scenes = answered[kind]
            _, outside = _panels(numbers, scenes, quantity, style.NARROW)
            shown = len(_drawn(scenes))
            caption = (
                f"Expected answers with their intervals, and rings of the solvers: "
                f"{shown} of {len(scenes)} scenes.{_left_out(outside)}"
            )

            def draw(
                width: float, scenes: Sequence[str] = scenes, quantity: str = quantity
            ) -> Canvas:
                return _panels(numbers, scenes, quantity, width)[0]

            figures.append(Figure.of_both_widths(name, title, caption, draw))
    return figures


def _card(theirs: pd.DataFrame) -> Card:
    """The answer card: how many scenes passed, failed and were declined."""
    of = len(theirs)
    passed, failed, declined = theirs[["passed", "failed", "declined"]].sum().tolist()
    left = declined + int(theirs["not_run"].sum())
    gaps = "scenes declined" if left == declined else "scenes declined or not run"
    names = list(theirs["solver"].unique())
    within = "within the tolerance of each"
    which = "the list below says which and why"
    numbers = (
        Number.counted(passed, of, "scenes passed", within, "good"),
        Number.counted(left, of, gaps, "no answer was given", "care"),
        Number.counted(failed, of, "scenes failed", which, "bad"),
    )
    worth = Worth("good", "passed", "No scene is beyond its tolerance.")
    if failed:
        worth = Worth("bad", "failed", "Read first what failed.")
    elif declined or theirs["not_run"].any():
        worth = Worth("care", "passed, with gaps", "Some scenes were not answered.")
    who = printable(", ".join(names))
    return Card(
        f"Does {who} give the expected answers?",
        f"{of} scenes of the benchmark; expected are exact answers, or our own runs.",
        numbers,
        "Nothing is measured here: levels 1 and 2 are exact answers, levels 3 to 5 our "
        "own runs.",
        worth,
        heads=("What is expected", "Are the answers right?"),
    )


def _looks(table: pd.DataFrame) -> dict[str, Look]:
    """A colour for each solver, ours first, and rings of sizes that hide none."""
    names = [name for name in table["solver"].unique() if name != OURS]
    looks: dict[str, Look] = {OURS: {"color": EXPECTED, "ms": 3}}
    for number, name in enumerate(names):
        colour = DIAMETERS[number % len(DIAMETERS)]
        size = 2 * (len(names) - number) + 1
        looks[name] = {"color": colour, "ms": size, "mfc": "none", "mew": 0.7}
    return looks


def pile_thresholds(numbers: pd.DataFrame) -> pd.DataFrame:
    """List the critical Shields numbers of piles.

    Parameters
    ----------
    numbers
        The table of `judge.judge_solvers`.

    Returns
    -------
    DataFrame
        A row for each scene and n/N: ours, that of each solver, and the interval, as
        texts.
    """
    asked = numbers[numbers["quantity"].eq("shields") & numbers["at"].ne("")]
    margin = judge.ROUND * asked["value"]
    is_inside = asked["answer"].between(asked["low"] - margin, asked["high"] + margin)
    marks = np.where(is_inside, "", " *")
    marks = np.where(asked["within"], marks, " **")
    texts = []
    for answer, mark in zip(asked["answer"], marks, strict=True):
        texts.append("—" if np.isnan(answer) else f"{answer:#.3g}{mark}")
    ends = zip(asked["low"], asked["high"], strict=True)
    interval = [f"{low:#.3g} ... {high:#.3g}" for low, high in ends]
    table = asked.assign(texts=texts, interval=interval, **{"n/N": asked["at"]})
    keys = ["scene", "n/N", "interval"]
    table = table.pivot(index=keys, columns="solver", values="texts")
    solvers = [*_looks(asked)]
    table = table.reindex(columns=solvers).reset_index()
    return table[["scene", "n/N", *solvers, "interval"]]


def _legends(
    canvas: Canvas, looks: dict[str, Look], levels: Iterable[int], *samples: Line2D
) -> None:
    """A legend of the solvers above, and one of samples and levels below."""
    solvers = []
    for name, look in looks.items():
        # a dollar sign in the name of a solver begins no formula
        solvers.append(style.entry(name.replace("$", r"\$"), look["color"]))
    marks = []
    for level in sorted(levels):
        mark = Line2D([], [], color="0.3", mfc="none", ls="none")
        mark.set(marker=MARKERS[level], label=f"level {level}")
        marks.append(mark)
    style.legends_below(canvas, solvers, [*samples, *marks])


def _drawn(scenes: Sequence[str]) -> list[str]:
    """The scenes of a figure, of all that a solver has answered."""
    places = np.unique(np.linspace(0, len(scenes) - 1, PANELS).astype(int))
    return [scenes[place] for place in places]


def _panels(
    numbers: pd.DataFrame, scenes: Sequence[str], quantity: str, width: float
) -> tuple[Canvas, int]:
    """Draw a quantity along the bed, or over the load steps, of scenes of the pack.

    The second value is the number of answers that are left out.
    """
    drawn = _drawn(scenes)
    looks = _looks(numbers)
    del looks[OURS]
    x_label, y_label, limits = AXES[quantity]
    columns = 2 if width >= style.WIDE else 1
    canvas, axes = style.grid(drawn, 2.0, x_label, y_label, columns, width=width)
    outside = 0
    for ax, scene in zip(axes, drawn, strict=True):
        outside += _panel(ax, numbers[numbers["scene"] == scene], quantity, looks)
        ax.set(**limits)
    _legends(canvas, looks, (), style.entry("expected, interval", EXPECTED))
    return canvas, outside


def _panel(
    ax: Axes, rows: pd.DataFrame, quantity: str, looks: Mapping[str, Look]
) -> int:
    """Draw a quantity of one scene; the number of the answers that are left out."""
    last = rows[rows["solver"] == OURS].groupby("quantity")["value"].last()
    count = last.get("moved", 1.0) + last.get("not_moved", 0.0)
    asked = rows[rows["quantity"] == quantity]
    low = float(asked["low"].min() / count)
    high = float(asked["high"].max() / count)
    room = ROOM * (high - low)
    outside = 0
    for solver, part in asked.groupby("solver"):
        x = part["at"].astype(float)
        if solver == OURS:
            ends = (part["low"] / count, part["high"] / count)
            ax.fill_between(x, *ends, color="0.85", lw=0)
            ax.plot(x, part["value"] / count, color=EXPECTED)
            continue
        answer = part["answer"] / count
        is_near = answer.between(low - room, high + room)
        outside += int((answer.notna() & ~is_near).sum())
        ax.plot(x[is_near], answer[is_near], "o", **looks[str(solver)])
    return outside


def _left_out(count: int) -> str:
    """A sentence about answers that are not drawn; empty if all are."""
    if count == 0:
        return ""
    return f" {count} answers are too far off to be drawn."


def _shields(chosen: Pack, numbers: pd.DataFrame) -> list[Figure]:
    """The thresholds in the Shields diagram."""
    asked = numbers[numbers["quantity"] == "shields"]
    if asked.empty:
        return []
    given = pd.DataFrame([chosen.scenes[name] for name in asked["scene"]], asked.index)
    asked = asked.assign(level=given["level"], unit=_reynolds_unit(given))
    looks = _looks(numbers)
    canvas = style.canvas(4.2, style.NARROW)
    ax = canvas.subplots()
    for curve in curves.WATER:
        ax.plot(*curve.points(), color=WATER, lw=0.8)
    here = asked[asked["solver"] == OURS]
    theta = here["value"]
    x = here["unit"] * np.sqrt(theta)
    spread = [theta - here["low"], here["high"] - theta]
    del looks[OURS]
    ax.errorbar(x, theta, spread, fmt="none", ecolor=EXPECTED, elinewidth=0.7)
    x_ends = (float(x.min()) / 3, float(x.max()) * 3)
    y_ends = (max(min(theta.min(), 0.02) / 2, 1e-6), max(theta.max(), 0.2) * 2)
    table = asked[asked["solver"] != OURS]
    outside = _answers(ax, table, looks, x_ends, y_ends)
    ax.set(xscale="log", yscale="log", ylabel="Shields number")
    ax.set_xlabel(r"$Re^\star = u^\star d/\nu$")
    ax.set_xlim(*x_ends)
    ax.set_ylim(*y_ends)
    _legends(
        canvas,
        looks,
        table["level"].unique(),
        style.entry("curves for water", WATER),
        style.entry("expected, interval", EXPECTED),
    )
    caption = "bars are the intervals of the expected answers."
    caption = f"Thresholds in the Shields diagram: {caption}"
    return [Figure("shields", "Thresholds", caption + _left_out(outside), (), canvas)]


def _reynolds_unit(given: pd.DataFrame) -> FloatArray:
    """Re* of a grain at a Shields number of 1.

    theta = rho_f u*^2/((rho_sol - rho_f) g d) and Re* = u* d/nu.
    """
    excess = given["rho_sol_kg_m3"] / given["rho_f_kg_m3"] - 1
    speed_squared = excess * given["g_m_s2"] * given["d_m"]
    unit = np.sqrt(speed_squared) * given["d_m"] / given["nu_m2_s"]
    return np.asarray(unit, float)


def _answers(
    ax: Axes,
    table: pd.DataFrame,
    looks: Mapping[str, Look],
    x_ends: tuple[float, float],
    y_ends: tuple[float, float],
) -> int:
    """Draw the thresholds of solvers; the number of those that are left out."""
    # the root of a negative answer is none
    answer = table["answer"].where(table["answer"] > 0)
    reynolds = table["unit"] * np.sqrt(answer)
    is_near = reynolds.between(*x_ends) & answer.between(*y_ends)
    groups: Any = table.assign(reynolds=reynolds)[is_near].groupby(["solver", "level"])
    for (solver, level), rows in groups:
        ax.plot(rows["reynolds"], rows["answer"], MARKERS[level], **looks[solver])
    return int((table["answer"].notna() & ~is_near).sum())


def _speed(verdicts: pd.DataFrame) -> list[Figure]:
    """Error against CPU time, each solver's and ours, where times are known."""
    timed = verdicts[verdicts["cpu_s"].notna() & verdicts["worst"].notna()]
    if timed.empty:
        return []
    looks = _looks(verdicts)
    canvas = style.canvas(4.2, style.NARROW)
    ax = canvas.subplots()
    groups: Any = timed.groupby(["solver", "level"])
    for (solver, level), rows in groups:
        error = rows["worst"].clip(FLOOR, CEILING)
        ax.plot(rows["cpu_s"].clip(*CPU_S), error, MARKERS[level], **looks[solver])
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="CPU time of a scene, s",
        ylabel="largest error",
    )
    _legends(canvas, looks, timed["level"].unique())
    caption = (
        "Each point is a scene: CPU time, and largest error of its judged numbers;"
        f" ours is filled. Errors below {FLOOR:g} and above {CEILING:g} are drawn"
        " there: at levels 3 to 5 our own run is expected."
    )
    return [Figure("speed-accuracy", "Speed and accuracy", caption, (), canvas)]
