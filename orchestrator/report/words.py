"""The answer of a study in sentences, and all other words of its page."""

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
import pandas as pd

from orchestrator.errors import OrchestratorError
from orchestrator.fidelity import spread
from orchestrator.fidelity.limits import FROZEN_BED
from orchestrator.physics.beside import sentences
from orchestrator.physics.fluids import PAPER
from orchestrator.physics.velocity import measurable_speeds
from orchestrator.report import labels, sheets, theory
from orchestrator.report.page import Guest, caption, versions
from orchestrator.report.results import Results, measured_hills, valid
from orchestrator.runs import case
from orchestrator.study.parts import PileBed
from orchestrator.tables.usable import ROW_HOLD

PAPER_FLUID = (
    "The fluid is the paper's, 1 kg/m³, 1e-5 m²/s; real air: fluid.kind = 'air'."
)


class Answer(NamedTuple):
    """What a page and a terminal say first.

    Attributes
    ----------
    sentences
        The answer in words.
    table
        Its numbers.
    """

    sentences: list[str]
    table: pd.DataFrame | None


def text(results: Results, guests: Sequence[Guest] = ()) -> str:
    """Write what guests say, the answer, its table and its doubts, for a terminal.

    Parameters
    ----------
    results
        The study with its tables.
    guests
        Others that say a sentence before.

    Returns
    -------
    str
        The lines.

    Raises
    ------
    OrchestratorError
        If the tables lack columns, as those of another version do.
    """
    try:
        found = answer(results)
        warned = doubts(results)
    except KeyError as error:
        what = f"its tables lack {error}: another version of this program wrote them"
        where = str(results.cases.parent)
        remedy = "`orchestrator study` of the same file runs it again"
        raise OrchestratorError(what, where, remedy) from None
    lines = [guest.said for guest in guests] + found.sentences
    if not lines:
        lines = ["No case has given a result yet."]
    if found.table is not None:
        lines += ["", *_as_lines(found.table)]
    if warned:
        lines += ["", *warned]
    return "\n".join(lines)


def _as_lines(table: pd.DataFrame) -> Iterator[str]:
    """The lines of a table of texts, whose columns stand below each other."""
    head = [str(name) for name in table]
    rows = [head, *table.to_numpy(str).tolist()]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  ".join(map(str.ljust, row, widths)).rstrip()


@lru_cache(maxsize=1)
def answer(results: Results) -> Answer:
    """Answer what a study asks.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    Answer
        Of many force laws which is nearest to measurements; else at which flow which
        part of a bed, or of the sizes of a mixture, goes.
    """
    best = theory.best(theory.ranked(results))
    if len(best) > theory.MANY:
        return Answer(theory.nearest(results), theory.sheet(best))
    table = sheets.sizes(results)
    if table is None:
        table = sheets.short(results)
    if results.at_fraction.empty:
        return Answer(_grains(results), table)
    return Answer(_piles(results), table)


def _piles(results: Results) -> list[str]:
    """Hills that others measured, the pile of the first picture, one in each other fluid."""
    hills = list(_hills(results))
    thresholds = results.joined("pile_threshold")
    if hills and not thresholds["usable"].any():
        return hills
    telling = labels.varying(thresholds, "alpha_deg", "d_m", "fraction")
    firsts = results.exemplars.drop_duplicates("rho_f_kg_m3")
    said = [_pile(row, results, telling[:3]) for _, row in firsts.iterrows()]
    return hills + said


def _pile(row: pd.Series, results: Results, telling: Sequence[str]) -> str:
    """When the first grain of a pile moves and where, and when a fraction of it has."""
    pile = results.plan.piles[str(row["scene_id"])]
    line = pile.model.line
    x, z = line.crest
    has_form = z > 0
    told = labels.told(row, ["alpha_deg", "d_m", *telling])
    if not has_form:
        told[0] = "Level bed"
    facts = {"name": ", ".join(told)}
    # a level bed has no place that goes first
    if row["first_ustar0_m_s"] > 0 and has_form:
        is_on_obstacle = any(start <= x <= end for start, end in line.bare)
        facts["x"] = labels.amount(row["first_x_m"], "m")
        facts["crest"] = labels.amount(float(x), "m")
        facts["top"] = "obstacle" if is_on_obstacle else "bed"
        facts["first"] = flow_at(row, row["first_ustar0_m_s"])
    sentence = caption(
        "pile",
        row=row,
        flow=flow_at(row, row["ustar0_m_s"]),
        counted=_counted(pile.bed),
        held=row["row_hold"] > ROW_HOLD,
        **facts,
    )
    said = [sentence]
    if pile.bed.profile and row.get("smoothing_needed_m", np.nan) > 0:
        said.append(caption("smoothing", row=row, name=pile.bed.profile.name))
    return " ".join([*said, _measured(row)])


def _counted(bed: PileBed) -> str:
    """Which part of a bed is counted, where that is not plain from its shape."""
    counts = bed.counts
    if not isinstance(counts, str):
        start, end = counts
        return f"between x = {start:g} and {end:g} m"
    if bed.profile or bed.counted:
        return {"windward": "of windward sides", "all": "of the whole bed"}[counts]
    return ""


def _grains(results: Results) -> list[str]:
    """The finest and the coarsest grain of the least slope."""
    grains = sheets.single_grains(results)
    if grains.empty:
        return []
    here = grains[grains["alpha_deg"] == grains["alpha_deg"].min()]
    if valid(here).any():
        here = here[valid(here)]
    here = here.sort_values("d_m", kind="stable")
    said = []
    for place in sorted({0, len(here) - 1}):
        row = here.iloc[place]
        sentence = caption(
            "one_grain",
            row=row,
            size=labels.value("d_m", row["d_m"]),
            slope=labels.value("alpha_deg", row["alpha_deg"]),
            flow=flow_at(row, row["ustar0_m_s"]),
        )
        said.append(f"{sentence} {_measured(row)}")
    return said


def _measured(row: pd.Series) -> str:
    """What was measured beside a threshold."""
    measured, tested = sentences(row.to_dict())
    if row["tested_rows"] > 0:
        return f"{_capital(measured)}. {_capital(tested)}."
    return f"{_capital(measured)}."


def _capital(text: str) -> str:
    """A sentence with a capital at its beginning; a symbol such as θ stays as it is."""
    return f"{text[0].upper()}{text[1:]}" if text[0].isascii() else text


def flow_at(row: pd.Series, ustar: float) -> str:
    """Write a friction velocity with speeds that are measured.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.
    ustar
        Undisturbed friction velocity, m/s.

    Returns
    -------
    str
        The velocity with the speeds of the wind, or with that of a channel.
    """
    depth = float(row["depth_m"] or np.nan)
    speeds = measurable_speeds(
        ustar,
        roughness=row["z0_m"],
        density=row["rho_f_kg_m3"],
        viscosity=row["nu_m2_s"],
        depth=depth,
        closed=row["flow_top"] == "closed channel",
    )
    told = []
    for column, label in sheets.SPEEDS.items():
        if speeds[column] > 0:
            told.append(f"{label} {speeds[column]:#.3g} m/s")
    if depth > 0:
        told.append(f"depth {depth:g} m")
    velocity = f"u*₀ = {ustar:#.3g} m/s"
    return f"{velocity} ({', '.join(told)})" if told else velocity


def _hills(results: Results) -> Iterator[str]:
    """Where reversed flow ends behind each hill that others measured, by each model."""
    for hill, rows in measured_hills(results):
        _, models = labels.cells(rows, ["turbulence_model"]).popitem()
        ends = dict(zip(models, rows["reattachment_over_h"], strict=True))
        yield caption(
            "hill",
            hill=hill,
            ends=ends,
            measured=rows["measured_reattachment_over_h"].iloc[0],
            verified=rows["measured_verified"].all(),
        )


@lru_cache(maxsize=1)
def doubts(results: Results) -> list[str]:
    """Say what a reader must know of the thresholds.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    list of str
        Which thresholds are usable, what is asked about the study, and what their
        intervals lack.
    """
    piles = results.joined("pile_threshold")
    table = piles if len(piles) else sheets.single_grains(results)
    said = []
    count = len(table)
    usable = table["usable"].sum() if count else 0
    if usable < count:
        said.append(f"Usable: {usable} of {count} thresholds.")
    for question in results.study.questions:
        said.append(question if question.endswith("?") else f"{question}.")
    scenes = results.scenes
    fluids = zip(scenes["rho_f_kg_m3"], scenes["nu_m2_s"], strict=True)
    if PAPER in fluids:
        said.append(PAPER_FLUID)
    if piles.empty:
        return said
    beyond = piles[piles["frozen_bed"] > FROZEN_BED]
    if len(beyond):
        said.append(caption("frozen", beyond=beyond, count=count, limit=FROZEN_BED))
    said += _doubts_of_fidelity(results)
    if "check" in results.tables:
        said.append(caption("checked", checks=results.tables["check"]))
    return said + _doubts_of_tolerance(results, piles)


def _doubts_of_fidelity(results: Results) -> list[str]:
    """Which fidelity answered what a study without a tolerance leaves open."""
    decisions = results.plan.decisions.values()
    chosen = [decision for decision in decisions if decision.is_chosen]
    if not chosen or results.study.tolerance is not None:
        return []
    names = dict.fromkeys(item.fidelity.name for item in chosen if item.fidelity)
    sentence = caption(
        "defaults",
        names=", ".join(names),
        error=max(item.known.total for item in chosen),
        floor=min(spread.floors().values()),
    )
    return [sentence]


def _doubts_of_tolerance(results: Results, piles: pd.DataFrame) -> list[str]:
    """Whether the model's own intervals are wider than the tolerance."""
    tolerance = results.study.tolerance
    rows = piles.dropna(subset=["shields", "shields_model_low"])
    if not tolerance or rows.empty:
        return []
    low = 1 - rows["shields_model_low"] / rows["shields"]
    high = rows["shields_model_high"] / rows["shields"] - 1
    narrowest = float(((low + high) / 2).min())
    if tolerance >= narrowest:
        return []
    sentence = caption(
        "tolerance",
        tolerance=tolerance,
        ends=(low.max(), high.max()),
        share=rows["model_share"].mode().iloc[0],
    )
    return [sentence]


def remarks(results: Results) -> dict[str, Any]:
    """Count what a reader must know before using this study's results.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    dict of str to object
        Counts by the names that the page's template has for them; 0 is no remark.
    """
    scenes = results.scenes
    thresholds = results.joined("pile_threshold")
    outside = scenes[~valid(scenes)]
    is_paper = outside["force_law"].isin(theory.PAIR)
    counts: dict[str, Any] = {
        "outside": len(outside),
        "transition": (is_paper & (outside["regime"] == "transition")).sum(),
        "thresholds": len(thresholds),
        "unreached": 0,
    }
    if len(thresholds):
        counts["unreached"] = thresholds["shields"].isna().sum()
    lost = ("carried_off", "fallen_upstream")
    curve = results.tables.get("pile_curve", pd.DataFrame())
    of_piles = curve.reindex(columns=["scene_id", *lost]).groupby("scene_id").max()
    for name in lost:
        most = of_piles[name]
        counts[name] = ((most > 0).sum(), most.max())
    return counts


def contents(results: Results, failures: Mapping[str, str]) -> dict[str, Any]:
    """Collect the words and numbers of the page beside its figures.

    Parameters
    ----------
    results
        The study with its tables.
    failures
        The cases that failed, with why.

    Returns
    -------
    dict of str to object
        By the names of the page's template.
    """
    from orchestrator.report import flows  # imports what draws

    root = results.cases
    cases = results.plan.cases
    links = {}
    for name in cases:
        if (root / name).is_dir():
            links[name] = quote(f"{root.name}/{name}/")
    scenes = results.scenes
    mixtures = [pile.scene.grain.sizes for pile in results.plan.piles.values()]
    eq10 = None
    if results.flows:
        eq10 = flows.eq10_over_wall(results, tuple(results.flows))
    has_strips = scenes["width"].any()
    return {
        "answer": answer(results),
        "doubts": doubts(results),
        "short": sheets.short(results),
        "piles": sheets.piles(results),
        "fidelities": sheets.fidelities(results),
        "remarks": remarks(results),
        "force_laws": sheets.force_laws(results),
        "parameters": sheets.parameters(results),
        "results": results,
        "title": results.study.title,
        "measured": theory.section(results),
        "programs": versions(case.programs(root, cases)),
        "failures": failures,
        "links": links,
        "paper_pair": scenes["force_law"].isin(theory.PAIR).any(),
        "eq10": eq10,
        "methods": set(scenes["method"]),
        "mixed": any(sizes is not None for sizes in mixtures),
        "strips": has_strips,
    }
