"""The page of a comparison: figures and tables of all solvers side by side."""

import textwrap
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.benchmark import compare, pack
from orchestrator.benchmark.compare import Contender
from orchestrator.benchmark.pack import Pack
from orchestrator.errors import printable
from orchestrator.physics import curves
from orchestrator.report import document, settings
from orchestrator.report.document import Section
from orchestrator.report.style import Figure
from orchestrator.runs.files import Folder

PANELS = 6
"""Largest number of scenes of a kind that are drawn; they are spread over the pack."""
FLOOR = 1e-6
"""Least error of a logarithmic axis: exact formulas and reruns have less."""
EXPECTED = "0.25"
"""Colour of the expected answer, and of ours."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#555555", "#7b3294")
MARKERS = {1: "o", 2: "s", 3: "D", 4: "^", 5: "v"}
"""Markers of the levels."""
LIMITS = (
    "Levels 1 and 2 are compared with exact answers, levels 3 to 5 with our own runs.",
    "The intervals hold the step between two load steps, the count’s resolution and the scatter "
    "over packings where it was run; they do not hold the error of the flow model.",
    "Scenes of less than a second are mostly start-up of the programs.",
)
ERRORS = (
    "Errors are relative, over the judged numbers of a scene; the bias is their median with its "
    "sign. Time and CPU time are the solver’s over ours, which ran in turn with it, the median of "
    "the scenes. Every number is in comparison.csv beside this page, every scene in verdicts.csv."
)
THRESHOLDS = (
    "Threshold Shields numbers, ours and each solver’s. One with a * is outside the interval of "
    "the expected answer, one with ** also beyond its tolerance: it fails."
)
COSTS = (
    "CPU time of each pile under the given stress, s and over ours. Where a solver states its time "
    "steps, M/s is millions of them a second of CPU time, times the mobile grains."
)
SHOWN = {
    **{name: name for name in ("solver", "scene", "kind", "passed")},
    **{"error": "error, %", "worst": "largest, %", "seconds": "s", "ours_seconds": "ours, s"},
    **{"ratio": "ratio", "cpu_ratio": "CPU ratio", "peak_mib": "MiB"},
}
"""Columns of the table of scenes."""


def write(chosen: Pack, contenders: Sequence[Contender], folder: Folder) -> None:
    """Put the page and its figures into a directory."""
    verdicts = pd.concat([one.verdicts.assign(solver=one.name) for one in contenders])
    machine = chosen.manifest.machine
    where = f" on {machine['processor']} with {machine['cores']} cores" if machine else ""
    text = (
        f"{verdicts['passed'].sum()} of {len(verdicts)} scenes passed. The pack was exported"
        f"{where}; the programs below gave its expected answers.\n\n{ERRORS}"
    )
    failed = pd.concat([compare.failures(one).assign(solver=one.name) for one in contenders])
    failed["why"] = failed["why"].map(lambda why: textwrap.fill(why, 100))
    scenes = verdicts[[*SHOWN]].assign(
        error=100 * verdicts["error"],
        worst=100 * verdicts["worst"],
        passed=np.where(verdicts["passed"], "yes", "no"),
    )
    with settings.own(), warnings.catch_warnings():
        # the name of a solver may have letters that the font has not
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        beds = [figure for figure in _beds(chosen, contenders) if figure]
        sections = [
            Section("Levels", text, (), (_sheet(compare.summary(contenders)),), LIMITS),
            Section("What failed", tables=(_sheet(failed[["solver", "scenes", "kind", "why"]]),)),
            Section("Beds", THRESHOLDS, beds, (_sheet(thresholds(chosen, contenders)),)),
            Section(
                "Time and error", COSTS, _speed(contenders), (_sheet(costs(chosen, contenders)),)
            ),
            Section("Scenes", tables=(_sheet(scenes.rename(columns=SHOWN)),)),
        ]
        names = ", ".join(one.name for one in contenders)
        title = f"Against the pack “{printable(chosen.root.name)}”: {names}"
        shown = [one for one in sections if one.figures or any(len(table) for table in one.tables)]
        document.write(title, shown, folder, compare.PAGE, chosen.manifest.programs)


def _sheet(table: pd.DataFrame) -> Any:
    # heads are typeset: an underscore of a solver's name would lower the letters after it
    return document.sheet(table.rename(columns=lambda name: name.replace("_", " ")))


def about(chosen: Pack, scene: str) -> str:
    """A bed in a few words: slope, diameter or roughness, packing."""
    given = chosen.scenes[scene]
    size = f"d = {1e3 * given['d_m']:g} mm" if "d_m" in given else f"z₀ = {given['z0_m']:.3g} m"
    packing = f", {given['packing']}" if "packing" in given else ""
    seed = f" {given['seed']}" if "seed" in given else ""
    return f"{given['alpha_deg']:g}°, {size}{packing}{seed}{', lift-off' * ('lift_off' in given)}"


def thresholds(chosen: Pack, contenders: Sequence[Contender]) -> pd.DataFrame:
    """The threshold Shields numbers of piles: ours, each solver's, the interval."""
    numbers = contenders[0].numbers
    asked = numbers[numbers["quantity"].eq("shields") & numbers["at"].ne("")]
    table = {
        "scene": asked["scene"],
        "pile": [about(chosen, scene) for scene in asked["scene"]],
        "n/N": [f"{float(at):.0%}" for at in asked["at"]],
    }
    for one in (compare.ours(contenders), *contenders):
        answer = one.numbers["answer"][asked.index]
        is_inside, is_tolerated = (
            compare.within(asked, answer, tolerance) for tolerance in (0.0, asked["tolerance"])
        )
        marks = np.select([answer.isna() | is_inside, is_tolerated], ["", " *"], " **")
        pairs = zip(answer, marks, strict=True)
        table[one.name] = ["—" if x != x else f"{x:#.3g}{mark}" for x, mark in pairs]
    ends = zip(asked["low"], asked["high"], strict=True)
    table["interval"] = [f"{low:#.3g} ... {high:#.3g}" for low, high in ends]
    return pd.DataFrame(table)


def costs(chosen: Pack, contenders: Sequence[Contender]) -> pd.DataFrame:
    """CPU time of each pile, ours and each solver's, and the grain-steps of a second of it."""
    verdicts = contenders[0].verdicts
    scenes = verdicts["scene"][verdicts["kind"] == "pile"].tolist()
    # of the fixed grains a solver may leave out those that nothing can touch
    mobile = np.array([pack.mobile_grains(chosen, scene) for scene in scenes], dtype=float)
    table: dict[str, Any] = {
        "scene": scenes,
        "pile": [about(chosen, scene) for scene in scenes],
        "mobile": mobile,
    }
    for one in (compare.ours(contenders), *contenders):
        piles = one.verdicts.set_index("scene").loc[scenes]
        table[f"{one.name}, s"] = piles["cpu_s"].where(piles["answered"]).to_numpy()
        table[f"{one.name} over ours"] = piles["cpu_ratio"].to_numpy()
        table[f"{one.name}, M/s"] = (mobile * piles["steps"] / piles["cpu_s"] / 1e6).to_numpy()
    return pd.DataFrame(table).dropna(axis="columns", how="all")


def _looks(contenders: Sequence[Contender]) -> list[dict[str, Any]]:
    """A colour for each solver, and rings one in the other: equal answers hide none."""
    sizes = range(2 * len(contenders) + 1, 1, -2)
    return [
        {"color": COLOURS[number % len(COLOURS)], "ms": size, "mfc": "none", "mew": 0.7}
        for number, size in enumerate(sizes)
    ]


def _legends(canvas: Canvas, contenders: Sequence[Contender], *others: Line2D) -> None:
    names = [
        Line2D([], [], color=look["color"], lw=2.5, label=one.name)
        for one, look in zip(contenders, _looks(contenders), strict=True)
    ]
    canvas.legend(handles=names, loc="outside upper center", ncols=6)
    canvas.legend(handles=list(others), loc="outside lower center", ncols=3)


def _canvas(height: float) -> Canvas:
    return Canvas(figsize=(7.0, height), layout="compressed")


def _beds(chosen: Pack, contenders: Sequence[Contender]) -> list[Figure | None]:
    moved = "Grains that have moved, "
    return [
        _panels(
            chosen, contenders, "flow", "stress", "Friction velocity along the bed", _along_bed
        ),
        _panels(chosen, contenders, "pile", "moved", f"{moved}under the given stress", _moved),
        _panels(
            chosen, contenders, "line", "moved-line", f"{moved}with the solver's own flow", _moved
        ),
        _shields(chosen, contenders),
    ]


def _panels(
    chosen: Pack,
    contenders: Sequence[Contender],
    kind: str,
    stem: str,
    title: str,
    panel: Callable[[Axes, pd.DataFrame, list[Any]], None],
) -> Figure | None:
    """A panel for some scenes of a kind; none if nobody answered any."""
    answered = pd.concat([one.verdicts[one.verdicts["answered"]] for one in contenders])
    names = answered["scene"][answered["kind"] == kind].unique().tolist()
    if not names:
        return None
    drawn = [names[i] for i in np.unique(np.linspace(0, len(names) - 1, PANELS).astype(int))]
    columns = min(len(drawn), 3)
    lines = -(-len(drawn) // columns)
    canvas = _canvas(0.8 + 2.0 * lines)
    axes = canvas.subplots(lines, columns, squeeze=False).ravel()
    for ax, name in zip(axes, drawn, strict=False):
        rows = contenders[0].numbers[contenders[0].numbers["scene"] == name]
        answers = [one.numbers["answer"][rows.index] for one in contenders]
        panel(ax, rows, list(zip(answers, _looks(contenders), strict=True)))
        ax.set_title(f"{textwrap.fill(name, 36)}\n{about(chosen, name)}", size=6.5)
    for ax in axes[len(drawn) :]:
        ax.remove()
    _legends(canvas, contenders, Line2D([], [], color=EXPECTED, label="expected, interval"))
    caption = (
        f"{len(drawn)} of {len(names)} scenes. The line and its band are the expected answer and"
        " its interval, the rings are the solvers'."
    )
    return Figure(stem, title, caption, (), canvas)


def _along_bed(ax: Axes, rows: pd.DataFrame, answers: list[Any]) -> None:
    here = rows[rows["quantity"] == "ustar_over_ustar0"]
    s = here["at"].astype(float)
    ax.plot(s, here["value"], color=EXPECTED)
    for answer, look in answers:
        ax.plot(s, answer[here.index], "o", **look)
    ax.set(xlim=(-3, 12), xlabel="s/h", ylabel="u*/u*₀")


def _moved(ax: Axes, rows: pd.DataFrame, answers: list[Any]) -> None:
    here = rows[rows["quantity"] == "moved"]
    load_step = here["at"].astype(float)
    total = here["value"].iloc[-1] + rows["value"][rows["quantity"] == "not_moved"].sum()
    ax.fill_between(load_step, here["low"] / total, here["high"] / total, color="0.85", lw=0)
    ax.plot(load_step, here["value"] / total, color=EXPECTED)
    for answer, look in answers:
        ax.plot(load_step, answer[here.index] / total, "o", **look)
    ax.set(ylim=(0, 1), xlabel="load step", ylabel="n/N")


def _shields(chosen: Pack, contenders: Sequence[Contender]) -> Figure | None:
    numbers = contenders[0].numbers
    here = numbers[numbers["quantity"] == "shields"]
    if here.empty:
        return None
    scenes = pd.DataFrame([chosen.scenes[name] for name in here["scene"]])
    # of theta = rho_f u*^2/((rho_sol - rho_f) g d) and Re* = u* d/nu
    excess = (
        (scenes["rho_sol_kg_m3"] / scenes["rho_f_kg_m3"] - 1) * scenes["g_m_s2"] * scenes["d_m"]
    )
    unit = (np.sqrt(excess) * scenes["d_m"] / scenes["nu_m2_s"]).to_numpy(float)
    level, theta = scenes["level"].to_numpy(), here["value"].to_numpy(float)
    canvas = _canvas(3.8)
    ax = canvas.subplots()
    for curve in curves.WATER:
        ax.plot(*curve.points(), color="#74aed6", lw=0.8)
    spread = np.abs(here[["low", "high"]].to_numpy(float).T - theta)
    ax.errorbar(unit * np.sqrt(theta), theta, spread, fmt="none", ecolor=EXPECTED, elinewidth=0.7)
    for one, look in zip(contenders, _looks(contenders), strict=True):
        answer = one.numbers["answer"][here.index].to_numpy(float)
        answer = np.where(answer > 0, answer, np.nan)
        for number in np.unique(level):
            at = level == number
            ax.plot(unit[at] * np.sqrt(answer[at]), answer[at], MARKERS[number], **look)
    reynolds = unit * np.sqrt(theta)
    ax.set(
        xscale="log", yscale="log", xlabel=r"$Re^\star = u^\star d/\nu$", ylabel="Shields number"
    )
    ax.set_xlim(reynolds.min() / 3, reynolds.max() * 3)
    ax.set_ylim(max(min(theta.min(), 0.02) / 2, 1e-6), max(theta.max(), 0.2) * 2)
    water = Line2D([], [], color="#74aed6", label="curves for water")
    expected = Line2D([], [], color=EXPECTED, label="expected, interval")
    _legends(canvas, contenders, expected, *_markers(level), water)
    caption = "Thresholds in the Shields diagram: bars are the intervals of the expected answers."
    return Figure("shields", "Thresholds", caption, (), canvas)


def _markers(levels: Any) -> list[Line2D]:
    return [
        Line2D([], [], color="0.3", marker=MARKERS[n], mfc="none", ls="none", label=f"level {n}")
        for n in np.unique(levels)
    ]


def _speed(contenders: Sequence[Contender]) -> list[Figure]:
    """Error against CPU time, each solver's and ours, where times are known."""
    everybody = (compare.ours(contenders), *contenders)
    tables = [one.verdicts for one in everybody]
    if not any((table["cpu_s"] * table["worst"]).notna().any() for table in tables):
        return []
    canvas = _canvas(3.8)
    ax = canvas.subplots()
    own = {"color": EXPECTED, "ms": 3, "mew": 0.7}
    looks = [own, *({**look, "ms": 4} for look in _looks(contenders))]
    for table, look in zip(tables, looks, strict=True):
        for level, rows in table.groupby("level"):
            ax.plot(
                rows["cpu_s"], rows["worst"].clip(lower=FLOOR), MARKERS[int(str(level))], **look
            )
    ax.set(xscale="log", yscale="log", xlabel="CPU time of a scene, s", ylabel="largest error")
    ours = Line2D([], [], color=EXPECTED, lw=2.5, label="ours")
    _legends(canvas, contenders, ours, *_markers(tables[0]["level"]))
    caption = (
        "Each point is a scene: CPU time, and largest relative error of its judged numbers; ours is"
        f" filled. Errors below {FLOOR:g} are drawn there: at levels 3 to 5 the expected answer is"
        " our own run."
    )
    return [Figure("speed-accuracy", "Speed and accuracy", caption, (), canvas)]
