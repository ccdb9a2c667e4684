"""The page of a comparison: figures and tables of all solvers side by side."""

import textwrap
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.benchmark import compare, pack
from orchestrator.benchmark.compare import OURS
from orchestrator.benchmark.pack import Pack
from orchestrator.errors import printable
from orchestrator.physics import curves
from orchestrator.report import page, style
from orchestrator.report.page import Section
from orchestrator.report.style import DIAMETERS, WATER, Figure
from orchestrator.runs.files import Folder

PANELS = 6
"""Largest number of scenes of a kind that are drawn; they are spread over the pack."""
FLOOR = 1e-6
"""Least error of a logarithmic axis: exact formulas and reruns have less."""
EXPECTED = "0.25"
"""Colour of the expected answer, and of ours."""
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
RE = r"$Re^\star = u^\star d/\nu$"
Look = dict[str, Any]


def write(chosen: Pack, numbers: pd.DataFrame, verdicts: pd.DataFrame, folder: Folder) -> None:
    """Put the page and its figures into a directory; the tables are those of `compare.judge`."""
    theirs = verdicts[verdicts["solver"] != OURS]
    machine, names = chosen.manifest.machine, theirs["solver"].unique().tolist()
    where = f" on {machine['processor']} with {machine['cores']} cores" if machine else ""
    text = (
        f"{theirs['passed'].sum()} of {len(theirs)} scenes passed. The pack was exported"
        f"{where}; the programs below gave its expected answers.\n\n{ERRORS}"
    )
    failed = compare.failures(theirs)
    failed["why"] = failed["why"].map(lambda why: textwrap.fill(why, 100))
    percent = {name: 100 * theirs[name] for name in ("error", "worst")}
    scenes = theirs[[*SHOWN]].assign(**percent, passed=np.where(theirs["passed"], "yes", "no"))
    moved = "Grains that have moved, "
    with style.settings(), warnings.catch_warnings():
        # the name of a solver may have letters that the font has not
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        beds = [
            _panels(*(chosen, numbers, verdicts, kind), *(stem, title, panel))
            for kind, stem, title, panel in (
                ("flow", "stress", "Friction velocity along the bed", _along_bed),
                ("pile", "moved", f"{moved}under the given stress", _moved),
                ("line", "moved-line", f"{moved}with the solver's own flow", _moved),
            )
        ]
        figures = [figure for figure in (*beds, _shields(chosen, numbers)) if figure]
        sections = [
            Section("Levels", text, (), (_sheet(compare.summary(theirs)),), LIMITS),
            Section("What failed", tables=(_sheet(failed),)),
            Section("Beds", THRESHOLDS, figures, (_sheet(thresholds(chosen, numbers)),)),
            Section("Time and error", COSTS, _speed(verdicts), (_sheet(costs(chosen, verdicts)),)),
            Section("Scenes", tables=(_sheet(scenes.rename(columns=SHOWN)),)),
        ]
        title = f"Against the pack “{printable(chosen.root.name)}”: {', '.join(names)}"
        shown = [part for part in sections if part.figures or any(map(len, part.tables))]
        page.write(title, shown, folder, compare.PAGE, chosen.manifest.programs)


def _sheet(table: pd.DataFrame) -> pd.DataFrame:
    # heads are typeset: an underscore of a solver's name would lower the letters after it
    return table.rename(columns=lambda name: name.replace("_", " "))


def about(chosen: Pack, scene: str) -> str:
    """A bed in a few words: slope, diameter or roughness, packing."""
    given = chosen.scenes[scene]
    size = f"d = {1e3 * given['d_m']:g} mm" if "d_m" in given else f"z₀ = {given['z0_m']:.3g} m"
    packing = f", {given['packing']}" if "packing" in given else ""
    seed = f" {given['seed']:g}" if "seed" in given else ""
    return f"{given['alpha_deg']:g}°, {size}{packing}{seed}{', lift-off' * ('lift_off' in given)}"


def _solvers(table: pd.DataFrame) -> list[str]:
    """Names of the solvers, ours first."""
    return [OURS, *(name for name in table["solver"].unique() if name != OURS)]


def thresholds(chosen: Pack, numbers: pd.DataFrame) -> pd.DataFrame:
    """The threshold Shields numbers of piles: ours, each solver's, the interval."""
    asked = numbers[numbers["quantity"].eq("shields") & numbers["at"].ne("")]
    first = asked[asked["solver"] == OURS]
    table = {
        "scene": first["scene"].tolist(),
        "pile": [about(chosen, scene) for scene in first["scene"]],
        "n/N": [f"{float(at):.0%}" for at in first["at"]],
    }
    for solver in _solvers(asked):
        rows = asked[asked["solver"] == solver]
        marks = [
            "" if compare.within(row, 0.0) else " *" if row["within"] else " **"
            for row in rows.to_dict("records")
        ]
        pairs = zip(rows["answer"], marks, strict=True)
        table[solver] = ["—" if x != x else f"{x:#.3g}{mark}" for x, mark in pairs]
    ends = zip(first["low"], first["high"], strict=True)
    table["interval"] = [f"{low:#.3g} ... {high:#.3g}" for low, high in ends]
    return pd.DataFrame(table)


def costs(chosen: Pack, verdicts: pd.DataFrame) -> pd.DataFrame:
    """CPU time of each pile, ours and each solver's, and the grain-steps of a second of it."""
    piles = verdicts[verdicts["kind"] == "pile"]
    scenes = piles["scene"].unique().tolist()
    # of the fixed grains a solver may leave out those that nothing can touch
    grains = (chosen.root / pack.SCENES / scene / "grains.csv" for scene in scenes)
    mobile = np.array([(pd.read_csv(path)["kind"] != "fixed").sum() for path in grains], float)
    table: dict[str, Any] = {"scene": scenes, "pile": [about(chosen, scene) for scene in scenes]}
    table["mobile"] = mobile
    for solver in _solvers(piles):
        rows = piles[piles["solver"] == solver]
        table[f"{solver}, s"] = rows["cpu_s"].where(rows["answered"]).to_numpy()
        table[f"{solver} over ours"] = rows["cpu_ratio"].to_numpy()
        table[f"{solver}, M/s"] = mobile * (rows["steps"] / rows["cpu_s"] / 1e6).to_numpy()
    return pd.DataFrame(table).dropna(axis="columns", how="all")


def _looks(table: pd.DataFrame) -> dict[str, Look]:
    """A colour for each solver, and rings one in the other: equal answers hide none."""
    names = _solvers(table)[1:]
    looks: dict[str, Look] = {OURS: {"color": EXPECTED, "ms": 3}}
    for number, name in enumerate(names):
        colour, size = DIAMETERS[number % len(DIAMETERS)], 2 * (len(names) - number) + 1
        looks[name] = {"color": colour, "ms": size, "mfc": "none", "mew": 0.7}
    return looks


def _literal(text: str) -> str:
    """A text of a stranger as matplotlib shows it: no formula."""
    return text.replace("$", r"\$")


def _canvas(height: float, looks: dict[str, Look], levels: Any, *samples: Line2D) -> Canvas:
    """A canvas with a legend of the solvers above, and one of levels and samples below."""
    canvas = Canvas(figsize=(7.0, height), layout="compressed")
    colours = {_literal(name): look["color"] for name, look in looks.items()}
    names = [Line2D([], [], color=c, lw=2.5, label=name) for name, c in colours.items()]
    canvas.legend(handles=names, loc="outside upper center", ncols=6)
    marks: Look = {"color": "0.3", "mfc": "none", "ls": "none"}
    below = [Line2D([], [], marker=MARKERS[n], label=f"level {n}", **marks) for n in levels]
    canvas.legend(handles=[*samples, *below], loc="outside lower center", ncols=4)
    return canvas


def _panels(
    chosen: Pack,
    numbers: pd.DataFrame,
    verdicts: pd.DataFrame,
    kind: str,
    stem: str,
    title: str,
    panel: Callable[[Axes, pd.DataFrame, dict[str, Look]], None],
) -> Figure | None:
    """A panel for some scenes of a kind; none if nobody answered any."""
    answered = verdicts[verdicts["answered"] & (verdicts["solver"] != OURS)]
    names = answered["scene"][answered["kind"] == kind].unique().tolist()
    if not names:
        return None
    drawn = [names[i] for i in np.unique(np.linspace(0, len(names) - 1, PANELS).astype(int))]
    columns, looks = min(len(drawn), 3), _looks(numbers)
    looks.pop(OURS)
    lines = -(-len(drawn) // columns)
    sample = Line2D([], [], color=EXPECTED, label="expected, interval")
    canvas = _canvas(0.8 + 2.0 * lines, looks, (), sample)
    axes = canvas.subplots(lines, columns, squeeze=False).ravel()
    for ax, name in zip(axes, drawn, strict=False):
        panel(ax, numbers[numbers["scene"] == name], looks)
        head = f"{textwrap.fill(name, 36)}\n{about(chosen, name)}"
        ax.set_title(_literal(head), size=6.5)
    for ax in axes[len(drawn) :]:
        ax.remove()
    caption = (
        f"{len(drawn)} of {len(names)} scenes. The line and its band are the expected answer and"
        " its interval, the rings are the solvers'."
    )
    return Figure(stem, title, caption, (), canvas)


def _along_bed(ax: Axes, rows: pd.DataFrame, looks: dict[str, Look]) -> None:
    for solver, here in rows[rows["quantity"] == "ustar_over_ustar0"].groupby("solver"):
        s = here["at"].astype(float)
        if solver == OURS:
            ax.plot(s, here["value"], color=EXPECTED)
        else:
            ax.plot(s, here["answer"], "o", **looks[str(solver)])
    ax.set(xlim=(-3, 12), xlabel="s/h", ylabel="u*/u*₀")


def _moved(ax: Axes, rows: pd.DataFrame, looks: dict[str, Look]) -> None:
    for solver, of in rows.groupby("solver"):
        here = of[of["quantity"] == "moved"]
        load_step = here["at"].astype(float)
        total = here["value"].iloc[-1] + of["value"][of["quantity"] == "not_moved"].sum()
        if solver == OURS:
            ax.fill_between(
                load_step, here["low"] / total, here["high"] / total, color="0.85", lw=0
            )
            ax.plot(load_step, here["value"] / total, color=EXPECTED)
        else:
            ax.plot(load_step, here["answer"] / total, "o", **looks[str(solver)])
    ax.set(ylim=(0, 1), xlabel="load step", ylabel="n/N")


def _shields(chosen: Pack, numbers: pd.DataFrame) -> Figure | None:
    asked = numbers[numbers["quantity"] == "shields"]
    if asked.empty:
        return None
    given = pd.DataFrame([chosen.scenes[name] for name in asked["scene"]], asked.index)
    # of theta = rho_f u*^2/((rho_sol - rho_f) g d) and Re* = u* d/nu
    excess = (given["rho_sol_kg_m3"] / given["rho_f_kg_m3"] - 1) * given["g_m_s2"] * given["d_m"]
    unit = np.sqrt(excess) * given["d_m"] / given["nu_m2_s"]
    answer = asked["answer"].where(asked["answer"] > 0)
    table = asked.assign(level=given["level"], reynolds=unit * np.sqrt(answer), answer=answer)
    looks, levels = _looks(numbers), np.unique(table["level"])
    looks.pop(OURS)
    samples = {"curves for water": WATER, "expected, interval": EXPECTED}
    lines = [Line2D([], [], color=colour, label=label) for label, colour in samples.items()]
    canvas = _canvas(3.8, looks, levels, *lines)
    ax = canvas.subplots()
    for curve in curves.WATER:
        ax.plot(*curve.points(), color=WATER, lw=0.8)
    here = table[table["solver"] == OURS]
    theta, x = here["value"], unit[here.index] * np.sqrt(here["value"])
    spread = [theta - here["low"], here["high"] - theta]
    ax.errorbar(x, theta, spread, fmt="none", ecolor=EXPECTED, elinewidth=0.7)
    groups: Any = table[table["solver"] != OURS].groupby(["solver", "level"])
    for (solver, level), rows in groups:
        ax.plot(rows["reynolds"], rows["answer"], MARKERS[level], **looks[solver])
    ax.set(xscale="log", yscale="log", xlabel=RE, ylabel="Shields number")
    ax.set_xlim(x.min() / 3, x.max() * 3)
    ax.set_ylim(max(min(theta.min(), 0.02) / 2, 1e-6), max(theta.max(), 0.2) * 2)
    caption = "Thresholds in the Shields diagram: bars are the intervals of the expected answers."
    return Figure("shields", "Thresholds", caption, (), canvas)


def _speed(verdicts: pd.DataFrame) -> list[Figure]:
    """Error against CPU time, each solver's and ours, where times are known."""
    known = verdicts[(verdicts["cpu_s"] * verdicts["worst"]).notna()]
    if known.empty:
        return []
    looks = _looks(verdicts)
    canvas = _canvas(3.8, looks, np.unique(known["level"]))
    ax = canvas.subplots()
    groups: Any = known.groupby(["solver", "level"])
    for (solver, level), rows in groups:
        errors = rows["worst"].clip(lower=FLOOR)
        ax.plot(rows["cpu_s"], errors, MARKERS[level], **looks[solver])
    ax.set(xscale="log", yscale="log", xlabel="CPU time of a scene, s", ylabel="largest error")
    caption = (
        "Each point is a scene: CPU time, and largest relative error of its judged numbers; ours is"
        f" filled. Errors below {FLOOR:g} are drawn there: at levels 3 to 5 the expected answer is"
        " our own run."
    )
    return [Figure("speed-accuracy", "Speed and accuracy", caption, (), canvas)]
