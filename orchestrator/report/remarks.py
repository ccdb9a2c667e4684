"""Caveats of the answer of a study: four to six remarks with their numbers."""

from collections.abc import Iterable, Iterator
from functools import lru_cache

import numpy as np
import pandas as pd

from orchestrator.digits import percent
from orchestrator.fidelity import crest, flows
from orchestrator.fidelity.decision import floor_of
from orchestrator.fidelity.limits import FROZEN_BED
from orchestrator.grains.corrected import CorrectedPile, Correction
from orchestrator.physics.fluids import is_gas
from orchestrator.physics.grain import Grain
from orchestrator.physics.measured import wilcock_crowe_hiding
from orchestrator.physics.reported import CHOICES
from orchestrator.physics.velocity import log_law_speed
from orchestrator.physics.verdict import USABLE
from orchestrator.report import answers, counted, labels, sheets, single, theory
from orchestrator.report.card import Remark
from orchestrator.report.page import caption
from orchestrator.report.results import Results
from orchestrator.report.subjects import USTAR, WIND, length, place_of_file
from orchestrator.runs.case import said_of
from orchestrator.study.parts import Obstacle, PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.sieve import Cut
from orchestrator.tables.facts import are_followed, packs_grains
from orchestrator.tables.kinds import INTERLOCKED

MOST = 6
"""Remarks up to which those are added that are true of every study of a kind."""
JUMP = 0.05
"""Relative change of the ratio of the ends of an interval from which it is told."""
AGREES = 1.05
"""Factor below which a computed threshold is neither too high nor too low."""
NEAR_ONE = 1.1
"""Factor of a correction below which it is told with three digits."""
PAPER_FLUID = Remark(
    "The gas is the article's, and not air.",
    "The gas is that of the article, of 1 kg/m³, in which a grain counts as entrained "
    'when it leaves its pocket. For real air write `fluid.kind = "air"`.',
)
NOT_AS_PLANNED = "A run did not go as planned."
"""Before what such a run says of itself."""
ROUGHER_M = (1e-4, 1e-3)
"""Roughness lengths of ground over which the wind is told, too, m: of rippled sand, and
of stones or low plants."""
DRY_GRAINS = Remark(
    "Dry, round grains without cohesion.",
    "Moisture, crusts and fine dust between the grains make them harder to move.",
)
SOLID_FENCE = Remark(
    "A fence is solid.",
    "Nothing flows through it. Fences that collect sand or dust are about half porous "
    "and shelter the bed behind them otherwise: `porosity` of the fence.",
)
POROUS_FENCE = Remark(
    "A porous fence is modelled as a loss of pressure.",
    "The loss is that of slats or holes with sharp edges, by the porosity of the fence "
    "(Idelchik). Nets of round threads let more wind through. The wakes of single "
    "slats are not resolved, and the flow was compared with no measurement.",
)
SHARP_CREST = Remark(
    "The first grains depend on the mesh at the crest.",
    f"With a quarter of the first cell, on {crest.PILES} piles, u*₀ changed by "
    f"{crest.told(crest.FIRST_GRAIN)} for the first grain and by "
    f"{crest.told(crest.TENTH)} for 10 %. No numerical interval contains it. "
    "`orchestrator convergence` estimates it for a study.",
)
OF_FLOWS = (
    Remark(
        "The bed shear stress was not measured.",
        "Speeds and the ends of the reversed flow test the flow, not the stress that "
        "moves grains.",
    ),
    Remark(
        "Steady, two-dimensional flow.",
        "The turbulence models are averages over time; the wind tunnel's flow was "
        "averaged over time as well.",
    ),
)
"""Caveats of flows over hills, in which no grain counts."""
FIRST_MOTION = Remark(
    "First motion, not transport.",
    "The answer is when grains start to move, not how many are carried on or how far.",
)


@lru_cache(maxsize=1)
def remarks(results: Results) -> list[Remark]:
    """List the caveats of the answer of a study.

    Returns
    -------
    list of Remark
        First what changes the answer; then, up to six, what is true of every such
        study.
    """
    piles = results.joined("pile_threshold")
    table = piles if len(piles) else sheets.single_grains_sheet(results)
    if answers.is_of_hills(results):
        return [*_questions(results), *OF_FLOWS]
    if table.empty:
        return [*_questions(results)]
    said = [*_of_laws(results), *_correction(results, table), *_questions(results)]
    said += [*_cuts(results), *_files(results)]
    said += _usable(table, results.tables.get("reason", pd.DataFrame()))
    if len(piles):
        said += _of_piles(results, piles)
    said += _of_runs(results)
    if any(scene.fluid.is_paper for scene in results.study.scenes):
        said.append(PAPER_FLUID)
    usual = [FIRST_MOTION]
    if table["rho_f_kg_m3"].map(is_gas).any():
        usual = [DRY_GRAINS, FIRST_MOTION]
        if sheets.quantity_of_rows(table) is WIND:
            asked = results.exemplars if len(results.exemplars) else table
            usual.insert(0, over_ground(asked))
    return said + usual[: max(0, MOST - len(said))]


def over_ground(rows: pd.DataFrame) -> Remark:
    """Say which winds have the friction velocity of an answer over rougher ground.

    Parameters
    ----------
    rows
        Thresholds in a gas with the columns of their scenes; the first that is known
        is told.

    Returns
    -------
    Remark
        The winds 10 m above the ground, by the logarithmic law.
    """
    head = "The wind is that over bare, level ground."
    weaker = (
        "Ripples, stones and plants make the ground rougher: a weaker wind has the "
        "same friction velocity over it"
    )
    unknown = "Which part of it stones and plants keep from the grains is not computed."
    known = rows[rows["ustar0_m_s"].notna()]
    if known.empty:
        return Remark(head, f"{weaker}. {unknown}")
    row = known.iloc[0]
    # on the basis of the card
    ustar = float(row[single.advised_column(row, USTAR)])
    here = float(row[single.advised_column(row, WIND)])
    winds = []
    for z0 in ROUGHER_M:
        wind = float(log_law_speed(ustar, 10, z0))
        if wind < here:
            winds.append(f"{wind:#.3g} m/s where z₀ is {length(z0)}")
    if not winds:
        return Remark(head, f"{weaker}. {unknown}")
    told = f"{ustar:#.3g} m/s is a wind of {here:#.3g} m/s at 10 m here"
    text = f"{weaker}. {told}, of {', and of '.join(winds)}. {unknown}"
    return Remark(head, f"{text}{_of_one(row, rows)}")


def _of_laws(results: Results) -> Iterator[Remark]:
    """Which law is nearest to measurements in water and in air, of a study of many."""
    best = theory.best(theory.ranked(results))
    if len(best) <= theory.MANY:
        return
    for found in theory.nearest_lines(results):
        head = "Where no force law agrees with the measurements."
        if found.of:
            head = f"{found.of}:"
        yield Remark(head, found.text)


def _correction(results: Results, table: pd.DataFrame) -> Iterator[Remark]:
    """By how much the computed threshold of one grain is off a measured one."""
    rows = table
    if len(results.exemplars):
        rows = results.exemplars
    row = rows.iloc[0]
    computed = float(row["level_ustar_m_s"])
    measured = float(row["compared_level_ustar_m_s"])
    if np.isnan(computed / measured) or row["verdict"] == USABLE:
        return
    ratio = computed / measured
    if max(ratio, 1 / ratio) < AGREES:
        return
    flow = "wind" if is_gas(float(row["rho_f_kg_m3"])) else "flow"
    who = "the flumes’ median is"
    if single.is_by_formula(row):
        who = f"the formula of {single.formula_of(row)} gives"
    of_one = _of_one(row, rows)
    size = length(float(row["d_m"]))
    law = labels.value("force_law", row["force_law"])
    found = f"{who} {measured:#.3g} m/s"
    if are_followed(rows).iloc[0]:
        model = "The closed form of one grain"
        text = (
            f"On a level bed one grain of {size} has a friction velocity of "
            f"{computed:#.3g} m/s by the force law {law}; {found}. Grains that DEM "
            "follows have no force law: the drag on each is that of its velocity "
            f"relative to the fluid.{of_one}"
        )
    else:
        model = "The model"
        text = (
            f"On a level bed of grains of {size} the force law {law} has a "
            f"threshold friction velocity of {computed:#.3g} m/s; {found}. The table "
            f"has both.{of_one}"
        )
    yield Remark(f"{model} {_off(ratio, flow)}", text)


def _off(ratio: float, flow: str) -> str:
    """By which factor a threshold flow is too high or too low, in words."""
    factor = max(ratio, 1 / ratio)
    over = "over" if ratio > 1 else "under"
    # two digits say nothing of a factor near 1
    by = f"{factor:.{3 if factor < NEAR_ONE else 2}g}"
    return f"{over}predicts the threshold {flow} by a factor of {by}."


def _of_one(row: pd.Series, rows: pd.DataFrame) -> str:
    """That a remark is told of one of several beds or grains, and of which."""
    shown = [name for name in ("fraction", "bed") if name in rows]
    telling = labels.varying(rows, *shown)
    if not telling:
        return ""
    told = ", ".join(labels.told(row, telling))
    return f" Example: {told}."


def _questions(results: Results) -> Iterator[Remark]:
    """What is asked about numbers of the study file that seem to be wrong."""
    for asked in results.study.asked:
        yield Remark("Is the study file right?", asked.sentence)


def _files(results: Results) -> Iterator[Remark]:
    """What was understood of the files that the study names."""
    for name, text in results.study.understood.items():
        yield Remark(f"Read from {name}:", f"{text}.")


def _cuts(results: Results) -> Iterator[Remark]:
    """What was cut from sieve tables, and what a hiding function says of it."""
    sieves = results.study.sieves
    for scene in results.study.scenes:
        sizes = scene.grain.sizes
        table = sieves.get(sizes) if isinstance(sizes, tuple) else None
        if table is None:
            continue
        for cut in table.cuts:
            yield _cut(results, scene, cut)
        return


def _cut(results: Results, scene: Scene, cut: Cut) -> Remark:
    """The remark on one cut, with the stress of the nearest size that was cut."""
    end = cut.high if cut.is_fine else cut.low
    size = end / scene.grain.diameter
    factor = float(wilcock_crowe_hiding(size))
    text = (
        f"{cut.said[:1].upper()}{cut.said[1:]}: these grains are not in the "
        "bed. By the hiding function of Wilcock and Crowe (2003), a formula that was "
        f"fitted to transport, grains of {length(end)} need {factor:.2f} times the "
        "stress of d50"
    )
    rows = results.joined("size_class")
    if len(rows):
        here = rows[rows["scene_id"] == scene.id]
        known = here[here["hiding"] > 0]
        for _, row in known.head(1).iterrows():
            own = row["shields_own"] / row["hiding"]
            stress = factor * float(own) * float(Grain.of_table(row).layer_weight)
            part = percent(float(row["fraction"]))
            text += f", {stress:.3g} Pa where {part} of each size is entrained"
    return Remark("Sizes were cut.", f"{text}.")


def _usable(table: pd.DataFrame, reasons: pd.DataFrame) -> Iterator[Remark]:
    """How many thresholds are usable, and what is most often against the others."""
    count = len(table)
    usable = int(table["usable"].sum())
    if usable == count:
        return
    of_table = reasons[reasons["scene_id"].isin(table["scene_id"])]
    code = of_table["reason"].value_counts().idxmax()
    most = of_table[of_table["reason"] == code].iloc[0]
    others = "the others" if usable else "them"
    said = f"The most frequent reason against {others}: {most['why_not']}."
    if pd.notna(most["remedy"]):
        said += f" What helps: {most['remedy']}."
    yield Remark(f"Usable: {usable} of {count} thresholds.", said)


def _of_runs(results: Results) -> Iterator[Remark]:
    """What runs that did not go as planned say of themselves."""
    for name in results.plan.cases:
        told = said_of(results.cases / name)
        if told:
            yield Remark(NOT_AS_PLANNED, f"{name}: {told}.")


def _of_piles(results: Results, piles: pd.DataFrame) -> Iterator[Remark]:
    """Caveats of the thresholds of beds."""
    for _, row in results.exemplars.head(1).iterrows():
        pile = results.plan.piles[str(row["scene_id"])]
        yield from _smoothing(row, pile.bed)
        yield from _jumps(row, piles)
        grains = results.tables["pile_grain"]
        x = grains.loc[grains["scene_id"] == row["scene_id"], "x_m"]
        yield from _counted(pile.scene, pile.bed, x)
        asked = results.plan.decisions[str(row["scene_id"])].asked
        yield from _closed_form(row, pile.bed, is_asked=not asked.method.is_open)
        yield from _model(row, results)
    if any(map(crest.has_sharp_crest, results.study.scenes)):
        yield SHARP_CREST
    fences = _fences(results.study.scenes)
    if not all(fence.is_porous for fence in fences):
        yield SOLID_FENCE
    if any(fence.is_porous for fence in fences):
        yield POROUS_FENCE
    beyond = piles[piles["frozen_bed"] > FROZEN_BED]
    if len(beyond):
        text = caption("frozen", beyond=beyond, count=len(piles), limit=FROZEN_BED)
        yield Remark("The flow is not recomputed as grains leave.", text)
    yield from _fidelity(results)
    if "check" in results.tables:
        text = caption("checked", checks=results.tables["check"])
        yield Remark("Some beds were checked by DEM.", text)
    yield from _corrected(results, piles)
    yield from _between(results, piles)
    yield from _tolerance(results, piles)


def _corrected(results: Results, piles: pd.DataFrame) -> Iterator[Remark]:
    """Which beds were corrected by DEM of others, a text for each class of them."""
    groups: dict[Correction, list[str]] = {}
    for asked, pile in results.plan.piles.items():
        if isinstance(pile, CorrectedPile):
            groups.setdefault(pile.correction, []).append(asked)
    for by, asked_ids in groups.items():
        rows = piles[piles["scene_id"].isin(asked_ids)]
        if rows.empty:
            continue
        methods = {results.plan.piles[each].scene.method.kind for each in asked_ids}
        text = caption(
            "corrected",
            rows=rows,
            methods=sorted(methods),
            made_from=len(by.design),
            kept=len(by.kept),
            confidence=by.confidence,
        )
        yield Remark("Some beds were corrected by DEM of others.", text)


def _between(results: Results, piles: pd.DataFrame) -> Iterator[Remark]:
    """Which flows lie between solved ones."""
    if "between_error" not in piles or piles["between_error"].isna().all():
        return
    models = [pile.model for pile in results.plan.piles.values()]
    solved = {run.name for one in models if one.is_between for run in one.cases}
    text = caption(
        "between",
        put=len(flows.lying(results.plan.decisions.values())),
        solved=len(solved),
        error=piles["between_error"].max(),
    )
    yield Remark("Some flows were interpolated.", text)


def _jumps(row: pd.Series, piles: pd.DataFrame) -> Iterator[Remark]:
    """Where the tested interval of a bed has another width from one Re* to the next."""
    here = piles[(piles["scene_id"] == row["scene_id"]) & (piles["tested_rows"] > 0)]
    here = here.sort_values("reynolds", kind="stable")
    width = (here["tested_high"] / here["tested_low"]).to_numpy(float)
    reynolds = here["reynolds"].to_numpy(float)
    for place in np.flatnonzero(np.abs(np.diff(np.log(width))) > JUMP):
        text = (
            f"From Re* {reynolds[place]:.3g} to {reynolds[place + 1]:.3g} the ratio of "
            f"its ends goes from {width[place]:.2g} to {width[place + 1]:.2g}: other "
            "measured thresholds are near. The bed itself does not change so."
        )
        yield Remark("The width of the interval changes with Re*.", text)


def _fences(scenes: Iterable[Scene]) -> list[Obstacle]:
    """The fences on the beds of some scenes."""
    obstacles = [each for scene in scenes for each in scene.obstacles]
    return [each for each in obstacles if each.kind == "fence"]


def _smoothing(row: pd.Series, bed: PileBed) -> Iterator[Remark]:
    """How smoothing of a noisy profile moves the answer."""
    if bed.profile and row.get("smoothing_needed_m", np.nan) > 0:
        text = caption("smoothing", row=row, name=bed.profile.name)
        yield Remark("Smoothing moves the answer.", text)


def _counted(scene: Scene, bed: PileBed, x: pd.Series) -> Iterator[Remark]:
    """Which part of a bed is counted, where that is not plain from its shape.

    Its grains or places lie at x, m.
    """
    if not (bed.profile or bed.counted):
        return
    counts = scene.counts
    where = "All of the bed is counted"
    if isinstance(counts, tuple):
        where = "A range of the bed is counted"
        rest = "fractions are of the grains in it"
    elif counts == "windward":
        flow = "wind" if is_gas(scene.fluid.density) else "flow"
        where = f"The sides that rise in the {flow} are counted"
        rest = "so are ripples and noise of level ground beside the form"
        alone = bed.profile and counted.way_up(bed.profile)
        if alone:
            rest += (
                "; to count the form alone from its foot to its top, write "
                f"`bed.counted = [{', '.join(alone)}]`"
            )
    else:
        rest = 'the windward sides alone: `bed.counted = "windward"`'
    metres = counted.metres_of_place(x, bed)
    if metres:
        where += f": {metres}"
    yield Remark(f"{where}.", f"{rest[0].upper()}{rest[1:]}.")


def _closed_form(row: pd.Series, bed: PileBed, *, is_asked: bool) -> Iterator[Remark]:
    """That a bed was answered along its line, why, and what checks that."""
    if packs_grains(row):
        return
    why = "The bed has too many grains to follow each"
    if is_asked:
        why = "The study asks for a method that packs no grains"
    text = (
        f"{why}: the local stress is compared with the threshold of a single exposed "
        "grain on the local slope."
    )
    head = "Closed form along the bed line."
    if pd.notna(row["pivot_x_m"]):
        head = "Closed form, checked at one place."
        place = length(float(row["pivot_x_m"]))
        if bed.profile:
            place = f"x = {place_of_file(float(row['pivot_x_m']), bed.profile)} m"
        text += (
            f" The grains around the answer, each by itself, start at {place} and a "
            f"friction velocity of {row['pivot_first_m_s']:#.3g} m/s."
        )
    if row["interlocking"] > INTERLOCKED:
        text += (
            " Touching grains of a row would hold the first up to "
            f"{row['interlocking']:.2g} times that."
        )
    yield Remark(head, text)


def _model(row: pd.Series, results: Results) -> Iterator[Remark]:
    """What the choices that all models share move a threshold by."""
    low = row["shields_model_low"]
    high = row["shields_model_high"]
    if pd.isna(low) or pd.isna(row["shields"]):
        return
    choice = row["model_share"]
    part = percent(row["fraction"])
    of_intervals = "The intervals do not contain this."
    if row["interval_of"] == CHOICES:
        of_intervals = "The intervals contain this."
    elif row["tested_rows"] > 0:
        of_intervals = "The intervals are those of measured thresholds."
    text = (
        f"Models with other choices of packing, forces and angles give Shields numbers "
        f"of {labels.interval(low, high)} for the {part}. {of_intervals}"
        f"{_of_one(row, results.exemplars)}"
    )
    yield Remark(f"{str(choice).capitalize()} dominates the uncertainty.", text)


def _fidelity(results: Results) -> Iterator[Remark]:
    """Which fidelity answered what a study without a tolerance leaves open."""
    decisions = results.plan.decisions.values()
    chosen = [decision for decision in decisions if decision.is_chosen]
    if not chosen or results.study.tolerance is not None:
        return
    names = dict.fromkeys(item.fidelity.name for item in chosen if item.fidelity)
    floors = [floor_of(item.scene) for item in chosen]
    totals = [item.known.total for item in chosen]
    worst = int(np.argmax(totals))
    beyond = [
        total
        for total, floor in zip(totals, floors, strict=True)
        if total > floor.error
    ]
    text = caption(
        "defaults",
        names=", ".join(names),
        error=totals[worst],
        floor=floors[worst],
        beyond=len(beyond),
        count=len(chosen),
    )
    yield Remark("The method was chosen by default.", text)


def _tolerance(results: Results, piles: pd.DataFrame) -> Iterator[Remark]:
    """Whether the model's own intervals are wider than the tolerance."""
    tolerance = results.study.tolerance
    rows = piles.dropna(subset=["shields", "shields_model_low"])
    if not tolerance or rows.empty:
        return
    low = 1 - rows["shields_model_low"] / rows["shields"]
    high = rows["shields_model_high"] / rows["shields"] - 1
    narrowest = float(((low + high) / 2).min())
    if tolerance >= narrowest:
        return
    text = caption(
        "tolerance",
        tolerance=tolerance,
        ends=(low.max(), high.max()),
        share=rows["model_share"].mode().iloc[0],
    )
    yield Remark("The tolerance is for numerical errors alone.", text)
