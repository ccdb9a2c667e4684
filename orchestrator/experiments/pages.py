"""What the pages of the experiments say around their figures and tables."""

import math
from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from orchestrator.experiments import ladder_figures as ladder
from orchestrator.experiments import map_figures as maps
from orchestrator.experiments.maps import Map
from orchestrator.experiments.stability import WRONG
from orchestrator.fidelity import levels, limits
from orchestrator.report import experiment
from orchestrator.report.experiment import Section
from orchestrator.report.figure import Figure
from orchestrator.runs.workspace import Workspace

CHART = "speed-against-accuracy"
ERROR_COLUMNS = ("error_10", "error_30", "error_50", "error_70", "error_curve")


def write_ladder(
    tables: Mapping[str, pd.DataFrame], space: Workspace, programs: Mapping[str, str]
) -> None:
    """Write the page of the ladder: points, levels and naive routes."""
    sections = list(_ladder(tables["points"], tables["levels"], tables["naive"]))
    experiment.write("Speed against accuracy", sections, space.folder, space.page.name, programs)


def _ladder(points: pd.DataFrame, known: pd.DataFrame, routes: pd.DataFrame) -> Iterator[Section]:
    by_dem = together(points[points["asked"] == "dem"])
    yield Section(
        "Speed against accuracy",
        "Every scene is answered on many pairs of levels, one for the flow and one for the grains. "
        "The error is that of tau_c at 10, 30, 50 and 70 % of the grains, against the dearest pair "
        "with the same model choices; the cost is processor time, of the flow's solve and of the "
        "grains' run together. No pair on the step line is beaten in both by another.\n\n"
        "The band is how far the reference itself moved when all of its numbers were changed: "
        "stiffness, time step, number of layers. A point within it is as good as the reference.",
        (
            Figure(CHART, "Cost against error", _CAPTION, (), ladder.against_cost(by_dem)),
            Figure(
                "error-at-fractions",
                "The error at each fraction",
                "The same errors at each fraction, and over the whole curve (its mean size at 5 to "
                "85 %). The pairs on the step line above are numbered.",
                (),
                ladder.by_fraction(by_dem),
            ),
        ),
        (experiment.sheet(_means(by_dem)),),
    )
    yield Section(
        "What is gained over the naive route",
        "One explicit run of the whole pile for each Re*, at K d/W = 1e4 and at the paper's "
        "K = 1e6 N/m with the time step that it forces. The time of a load step is measured on "
        "a small "
        "pile; the pile of the figure has more grains, in proportion to which it is extrapolated, "
        "and needs as many runs as the fast level has holds.",
        (Figure("gains", "Factors gained", "", (), ladder.gains(routes)),),
        (experiment.sheet(routes),),
    )
    yield Section(
        "The fidelity levels, and what is known of them",
        "The largest error over the scenes of a kind, %, without the reference's own uncertainty. "
        "From this table `study --tolerance` chooses.",
        tables=(experiment.sheet(_meanings()), experiment.sheet(_wide(known))),
        limits=(
            "An error is known for the kinds of scenes that were run, no others; it is that of the "
            "method, not of the model: first cell, turbulence model and the way to read the stress "
            "move the answer by more.",
        ),
    )


_CAPTION = (
    "A panel for each packing; the largest error over the four fractions and over the scenes. "
    "Hollow points have another turbulence model: their distance is the spread of the models."
)


def together(points: pd.DataFrame) -> pd.DataFrame:
    """One row for each pair and packing: the mean cost, the largest errors with their signs."""
    groups = points.groupby(["packing", "flow_level", "grain_level"], sort=False)
    table = groups[list(ERROR_COLUMNS)].agg(_worst)
    table = table.assign(
        scene=[f"{count} piles" for count in groups.size()],
        cost_core_s=groups["cost_core_s"].mean(),
        reference_error=groups["reference_error"].max(),
        same_model=groups["same_model"].first(),
        pareto=groups["pareto"].first(),
    )
    return table.reset_index()


def _means(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows of `together` for people: errors in %."""
    table = rows[["packing", "flow_level", "grain_level", "scene", "cost_core_s"]]
    table = table.assign(**{name: 100 * rows[name] for name in ERROR_COLUMNS})
    heads = {name: f"{name.removeprefix('error_')} %" for name in ERROR_COLUMNS}
    heads |= {"cost_core_s": "core-s", "flow_level": "flow", "grain_level": "grains", "scene": "of"}
    return table.rename(columns=heads).sort_values(["packing", "core-s"])


def _worst(values: pd.Series) -> float:
    """The value of the largest size; NaN where a fraction was not reached in one of the scenes."""
    return math.nan if values.isna().any() else float(max(values, key=abs))


def _meanings() -> pd.DataFrame:
    rows = [
        {"part": part, "level": one.name, "what it is": one.meaning}
        for part, listed in levels.LEVELS.items()
        for one in listed
    ]
    return pd.DataFrame(rows)


def _wide(known: pd.DataFrame) -> pd.DataFrame:
    """A row for each level and kind of scene, a column for each fraction, %."""
    order = {one.name: place for place, one in enumerate((*levels.FLOW, *levels.GRAINS))}
    index = ["part", "scene_class", "level", "scenes", "cost_core_s"]
    table = (100 * known.set_index([*index, "fraction"])["error"]).unstack("fraction")
    table.columns = pd.Index([f"{fraction:.0%}" for fraction in table.columns])
    table = table.reset_index()
    table = table.assign(place=table["level"].map(order)).sort_values(
        ["part", "scene_class", "place"]
    )
    heads = {"scene_class": "class of scene", "cost_core_s": "core-s"}
    return table.drop(columns="place").rename(columns=heads)


def write_stability(
    drawn: Sequence[Map],
    judged: Mapping[str, pd.DataFrame],
    space: Workspace,
    programs: Mapping[str, str],
) -> None:
    """Write the page of the maps: the sheet of all, then each by itself."""
    sections = list(_stability(drawn, judged))
    experiment.write("Where each method fails", sections, space.folder, space.page.name, programs)


def _stability(drawn: Sequence[Map], judged: Mapping[str, pd.DataFrame]) -> Iterator[Section]:
    shown = {
        one.name: maps.Map(
            judged[one.name],
            one.title,
            one.x.label,
            one.y.label,
            one.question,
            " ".join(limit.says for limit in limits.of_map(one.name)),
        )
        for one in drawn
    }
    yield Section(
        "All maps",
        "Each cell is a real run. It is good where tau_c is within "
        f"{WRONG:.0%} of its reference at every fraction; wrong where it is not and nothing "
        "said so; noisy, exploded or stalled where the run itself said so (a marked corner).",
        (Figure("maps", "Where each method fails", "", (), maps.sheet(list(shown.values()))),),
    )
    for one in drawn:
        yield Section(
            one.title,
            one.question,
            (Figure(f"map-{one.name}", one.title, "", (), maps.draw(shown[one.name])),),
            limits=tuple(limit.says for limit in limits.of_map(one.name)),
        )
