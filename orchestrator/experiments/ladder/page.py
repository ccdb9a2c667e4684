"""The page of the ladder: what it says around its figures and tables."""

from collections.abc import Mapping

import pandas as pd

from orchestrator.experiments.ladder import chart, gains
from orchestrator.experiments.ladder.ranking import ERRORS, together
from orchestrator.fidelity.levels import FLOW, GRAINS, LEVELS
from orchestrator.report import document
from orchestrator.report.document import Section
from orchestrator.report.figure import Figure
from orchestrator.runs.workspace import Workspace

CAPTION = (
    "A panel for each packing; the largest error over the four fractions and over the scenes. "
    "Hollow points have another turbulence model, contacts of one stiffness in N/m or a bed in "
    "space: their distance is that of the models."
)


def write(tables: Mapping[str, pd.DataFrame], space: Workspace, solvers: Mapping[str, str]) -> None:
    """Write the page from the tables ``points``, ``levels`` and ``naive``."""
    sections = [
        _accuracy(tables["points"]),
        _gains(tables["naive"]),
        _known(tables["levels"]),
    ]
    title = "Speed against accuracy"
    document.write(title, sections, space.folder, space.page.name, solvers)


def _accuracy(points: pd.DataFrame) -> Section:
    by_dem = together(points[points["asked"] == "dem"])
    return Section(
        "Speed against accuracy",
        "Every scene is answered on many pairs of levels, one for the flow and one for the grains. "
        "The error is that of tau_c at 10, 30, 50 and 70 % of the grains, against the dearest pair "
        "with the same model choices; the cost is processor time, of the flow's solve and of the "
        "grains' run together. No pair on the step line is beaten in both by another.\n\n"
        "The band is how far the reference itself moved when all of its numbers were changed: "
        "stiffness, time step, number of layers. A point within it is as good as the reference.",
        (
            Figure(
                "speed-against-accuracy",
                "Cost against error",
                CAPTION,
                (),
                chart.against_cost(by_dem),
            ),
            Figure(
                "error-at-fractions",
                "The error at each fraction",
                "The same errors at each fraction, and over the whole curve (its mean size at 5 to "
                "85 %). The pairs on the step line above are numbered.",
                (),
                chart.by_fraction(by_dem),
            ),
        ),
        (document.sheet(_means(by_dem)),),
    )


def _gains(routes: pd.DataFrame) -> Section:
    return Section(
        "What is gained over the naive route",
        "One explicit run of the whole pile for each Re*, at K d/W = 1e4 and at the paper's "
        "K = 1e6 N/m with the time step that it forces. The time of a load step is measured on a "
        "small pile; the pile of the figure has more grains, in proportion to which it is "
        "extrapolated, and needs as many runs as the fast level has load steps.",
        (Figure("gains", "Factors gained", "", (), gains.draw(routes)),),
        (document.sheet(routes),),
    )


def _known(known: pd.DataFrame) -> Section:
    return Section(
        "The fidelity levels, and what is known of them",
        "The largest error over the scenes of a class, %, without the reference's own uncertainty. "
        "From this table `study --tolerance` chooses.",
        tables=(document.sheet(_meanings()), document.sheet(_wide(known))),
        limits=(
            "An error is known for the classes of scenes that were run, no others. It is that of "
            "the method, not of the model: first cell, turbulence model and the way to read the "
            "stress move the answer by more.",
        ),
    )


def _means(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows of `together` for people: errors in %."""
    table = rows[["packing", "flow_level", "grain_level", "piles", "cost_core_s"]]
    table = table.assign(**{name: 100 * rows[name] for name in ERRORS})
    heads = {name: f"{name.removeprefix('error_')} %" for name in ERRORS}
    heads |= {"cost_core_s": "core-s", "flow_level": "flow", "grain_level": "grains"}
    return table.rename(columns=heads).sort_values(["packing", "core-s"])


def _meanings() -> pd.DataFrame:
    rows = [
        {"part": part, "level": one.name, "what it is": one.meaning}
        for part, listed in LEVELS.items()
        for one in listed
    ]
    return pd.DataFrame(rows)


def _wide(known: pd.DataFrame) -> pd.DataFrame:
    """A row for each level and scene class, a column for each fraction, %."""
    order = {one.name: place for place, one in enumerate((*FLOW, *GRAINS))}
    index = ["part", "scene_class", "level", "scenes", "cost_core_s"]
    table = (100 * known.set_index([*index, "fraction"])["error"]).unstack("fraction")
    table.columns = pd.Index([f"{fraction:.0%}" for fraction in table.columns])
    table = table.reset_index()
    table = table.assign(place=table["level"].map(order)).sort_values(
        ["part", "scene_class", "place"]
    )
    heads = {"scene_class": "scene class", "cost_core_s": "core-s"}
    return table.drop(columns="place").rename(columns=heads)
