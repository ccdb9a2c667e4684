"""The page of a comparison: figures and tables of all solvers side by side."""

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.benchmark import judge
from orchestrator.benchmark.judge import OURS
from orchestrator.benchmark.pack import Pack
from orchestrator.errors import printable
from orchestrator.physics import curves
from orchestrator.report import page, style
from orchestrator.report.page import Section
from orchestrator.report.style import DIAMETERS, PANELS, WATER, Figure, Look
from orchestrator.runs.files import Folder

PAGE = "comparison.html"
FLOOR, CEILING = 1e-6, 1e3
"""Least and largest relative error on a logarithmic axis."""
CPU_S = (1e-6, 1e8)
"""Least and largest time on a logarithmic axis, s: others may have noted any number."""
EXPECTED = "0.25"
"""Colour of the expected answer, and of ours."""
ROOM = 1.0
"""Room above and below the expected answers of a panel in which answers are drawn, over
their range."""
MARKERS = {1: "o", 2: "s", 3: "D", 4: "^", 5: "v"}  # of the levels
LIMITS = (
    "Levels 1 and 2 are compared with exact answers, levels 3 to 5 with our own runs.",
    "The intervals hold a load step, the resolution of the count and the scatter over packings "
    "where it was run; they do not hold the error of the flow model.",
    "Scenes of less than a second are mostly start-up of the programs.",
)
ERRORS = """Errors are relative, over the judged numbers of a scene; the bias is their median with
its sign. Times are the solver’s over ours, which ran in turn with it, the median of the scenes.
Every number is in comparison.csv beside this page, every scene in verdicts.csv. The programs below
gave the expected answers."""
THRESHOLDS = """Threshold Shields numbers. One with a * is outside the interval of the expected
answer, one with ** also beyond its tolerance: it fails."""
SHOWN = {
    **{"solver": "solver", "scene": "scene", "passed": "passed", "error": "error, %"},
    **{"worst": "largest, %", "seconds": "s", "ratio": "over ours", "cpu_s": "CPU, s"},
    **{"cpu_ratio": "CPU over ours", "peak_mib": "MiB", "steps": "time steps"},
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


def write(
    chosen: Pack, numbers: pd.DataFrame, verdicts: pd.DataFrame, folder: Folder
) -> None:
    """Put the page and its figures into a directory; the tables are those of `judge.judge`."""
    theirs = verdicts[verdicts["solver"] != OURS]
    percent = {name: 100 * theirs[name] for name in ("error", "worst")}
    scenes = theirs[[*SHOWN]].assign(
        **percent, passed=np.where(theirs["passed"], "yes", "no")
    )
    scenes = scenes.rename(columns=SHOWN)
    with style.settings(), warnings.catch_warnings():
        # the name of a solver may have letters that the font has not
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        answered = theirs[theirs["answered"]].groupby("kind")["scene"].unique()
        beds = [
            _panels(numbers, answered[kind], *of)
            for kind, *of in BEDS
            if kind in answered
        ]
        beds += _shields(chosen, numbers)
        sections = [
            Section(
                "", "\n\n".join(judge.in_words(theirs)), (), (judge.summary(theirs),)
            ),
            Section("What failed", tables=(judge.failures(theirs),)),
            Section("Beds", THRESHOLDS, beds, (thresholds(numbers),)),
            Section("Time and error", ERRORS, _speed(verdicts), (scenes,), LIMITS),
        ]
        names = ", ".join(theirs["solver"].unique())
        title = f"Against the pack “{printable(chosen.root.name)}”: {names}"
        shown = [
            part for part in sections if part.figures or any(map(len, part.tables))
        ]
        page.write(title, shown, folder, PAGE, chosen.manifest.programs)


def _looks(table: pd.DataFrame) -> dict[str, Look]:
    """A colour for each solver, ours first, and rings one in the other: equal answers hide none."""
    names = [name for name in table["solver"].unique() if name != OURS]
    looks: dict[str, Look] = {OURS: {"color": EXPECTED, "ms": 3}}
    for number, name in enumerate(names):
        colour, size = DIAMETERS[number % len(DIAMETERS)], 2 * (len(names) - number) + 1
        looks[name] = {"color": colour, "ms": size, "mfc": "none", "mew": 0.7}
    return looks


def thresholds(numbers: pd.DataFrame) -> pd.DataFrame:
    """The threshold Shields numbers of piles: ours, each solver's, the interval."""
    asked = numbers[numbers["quantity"].eq("shields") & numbers["at"].ne("")]
    margin = judge.ROUND * asked["value"]
    is_inside = asked["answer"].between(asked["low"] - margin, asked["high"] + margin)
    marks = np.where(asked["within"], np.where(is_inside, "", " *"), " **")
    pairs = zip(asked["answer"], marks, strict=True)
    texts = ["—" if x != x else f"{x:#.3g}{mark}" for x, mark in pairs]
    ends = zip(asked["low"], asked["high"], strict=True)
    interval = [f"{low:#.3g} ... {high:#.3g}" for low, high in ends]
    table = asked.assign(texts=texts, interval=interval, **{"n/N": asked["at"]})
    table = table.pivot(
        index=["scene", "n/N", "interval"], columns="solver", values="texts"
    )
    table = table.reindex(columns=[*_looks(asked)]).reset_index()
    return table[["scene", "n/N", *_looks(asked), "interval"]]


def _legends(
    canvas: Canvas, looks: dict[str, Look], levels: Any, *samples: Line2D
) -> None:
    """A legend of the solvers above, and one of samples and levels below."""
    # a dollar sign in the name of a solver begins no formula
    solvers = [
        style.entry(name.replace("$", r"\$"), look["color"])
        for name, look in looks.items()
    ]
    grey: Look = {"color": "0.3", "mfc": "none", "ls": "none"}
    marks = [
        Line2D([], [], marker=MARKERS[n], label=f"level {n}", **grey)
        for n in sorted(levels)
    ]
    style.legends(canvas, solvers, [*samples, *marks])


def _panels(
    numbers: pd.DataFrame, scenes: Sequence[str], quantity: str, name: str, title: str
) -> Figure:
    """A quantity along the bed, or over the load steps, of some scenes, spread over the pack."""
    places = np.unique(np.linspace(0, len(scenes) - 1, PANELS).astype(int))
    drawn = [scenes[place] for place in places]
    looks = _looks(numbers)
    del looks[OURS]
    x_label, y_label, limits = AXES[quantity]
    canvas, axes = style.grid(drawn, 1.7, x_label, y_label, columns=3)
    outside = 0
    for ax, scene in zip(axes, drawn, strict=True):
        rows = numbers[numbers["scene"] == scene]
        last = rows[rows["solver"] == OURS].groupby("quantity")["value"].last()
        count = last.get("moved", 1.0) + last.get("not_moved", 0.0)
        asked = rows[rows["quantity"] == quantity]
        low = float(asked["low"].min() / count)
        high = float(asked["high"].max() / count)
        room = ROOM * (high - low)
        for solver, of in asked.groupby("solver"):
            x = of["at"].astype(float)
            if solver == OURS:
                ax.fill_between(
                    x, of["low"] / count, of["high"] / count, color="0.85", lw=0
                )
                ax.plot(x, of["value"] / count, color=EXPECTED)
                continue
            answer = of["answer"] / count
            is_near = answer.between(low - room, high + room)
            outside += int((answer.notna() & ~is_near).sum())
            ax.plot(x[is_near], answer[is_near], "o", **looks[str(solver)])
        ax.set(**limits)
    _legends(canvas, looks, (), style.entry("expected, interval", EXPECTED))
    caption = f"{len(drawn)} of {len(scenes)} scenes: expected answers, and rings of the solvers."
    return Figure(name, title, caption + _left_out(outside), (), canvas)


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
    # of theta = rho_f u*^2/((rho_sol - rho_f) g d) and Re* = u* d/nu
    excess = (
        (given["rho_sol_kg_m3"] / given["rho_f_kg_m3"] - 1)
        * given["g_m_s2"]
        * given["d_m"]
    )
    unit = np.sqrt(excess) * given["d_m"] / given["nu_m2_s"]
    looks = _looks(numbers)
    canvas = style.canvas(3.8)
    ax = canvas.subplots()
    for curve in curves.WATER:
        ax.plot(*curve.points(), color=WATER, lw=0.8)
    here = asked[asked["solver"] == OURS]
    theta = here["value"]
    x = unit[here.index] * np.sqrt(theta)
    spread = [theta - here["low"], here["high"] - theta]
    ax.errorbar(
        x, theta, spread, fmt="none", ecolor=looks.pop(OURS)["color"], elinewidth=0.7
    )
    x_ends = (float(x.min()) / 3, float(x.max()) * 3)
    y_ends = (max(min(theta.min(), 0.02) / 2, 1e-6), max(theta.max(), 0.2) * 2)

    table = asked[asked["solver"] != OURS]
    # the root of a negative answer is none
    answer = table["answer"].where(table["answer"] > 0)
    reynolds = unit[table.index] * np.sqrt(answer)
    table = table.assign(level=given["level"], reynolds=reynolds)
    is_near = reynolds.between(*x_ends) & answer.between(*y_ends)
    outside = int((table["answer"].notna() & ~is_near).sum())
    groups: Any = table[is_near].groupby(["solver", "level"])
    for (solver, level), rows in groups:
        ax.plot(rows["reynolds"], rows["answer"], MARKERS[level], **looks[solver])
    ax.set(xscale="log", yscale="log", ylabel="Shields number")
    ax.set_xlabel(r"$Re^\star = u^\star d/\nu$")
    ax.set_xlim(*x_ends)
    ax.set_ylim(*y_ends)
    samples = {"curves for water": WATER, "expected, interval": EXPECTED}
    _legends(
        canvas,
        looks,
        table["level"].unique(),
        *map(style.entry, samples, samples.values()),
    )
    caption = "Thresholds in the Shields diagram: bars are the intervals of the expected answers."
    return [Figure("shields", "Thresholds", caption + _left_out(outside), (), canvas)]


def _speed(verdicts: pd.DataFrame) -> list[Figure]:
    """Error against CPU time, each solver's and ours, where times are known."""
    timed = verdicts[verdicts["cpu_s"].notna() & verdicts["worst"].notna()]
    if timed.empty:
        return []
    looks = _looks(verdicts)
    canvas = style.canvas(3.8)
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
        "Each point is a scene: CPU time, and largest error of its judged numbers; ours is filled. "
        f"Errors below {FLOOR:g} and above {CEILING:g} are drawn there: at levels 3 to 5 our own "
        "run is expected."
    )
    return [Figure("speed-accuracy", "Speed and accuracy", caption, (), canvas)]
