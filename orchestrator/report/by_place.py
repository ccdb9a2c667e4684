"""Thresholds at the places of a profile in a gas: beach, foot, slope, brink."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from orchestrator.grains.places import PARTS, PLACES_IN_WORDS, places_of
from orchestrator.physics.fluids import is_gas
from orchestrator.report import labels, sheets, single, units
from orchestrator.report.results import Results, valid
from orchestrator.report.sheets import Sheet
from orchestrator.report.subjects import ReportedQuantity, length
from orchestrator.types import FloatArray

ENDINGS = ("", "_low", "_high")
"""Of the columns of a number and of the ends of its interval."""


def places_sheet(results: Results) -> Sheet | None:
    """List the thresholds at the places of each profile.

    Parameters
    ----------
    results
        The study, whose cases are there.

    Returns
    -------
    Sheet or None
        The flows in which a tenth and half of each place are entrained, with the
        intervals of the threshold carried through; None without a profile in a gas.
    """
    rows = results.at_fraction
    if rows.empty:
        return None
    shown = rows[rows["profile"].notna() & rows["rho_f_kg_m3"].map(is_gas)]
    if shown.empty:
        return None
    told = sheets.quantity_of_rows(shown)
    telling = labels.varying(shown, "fraction")
    listed = [
        cells
        for _, row in shown.iterrows()
        for cells in _of_bed(row, results, told, telling)
    ]
    if not listed:
        return None
    shared = [f"flow at which a tenth and half of a place is entrained, {told.place}"]
    first = shown.iloc[0]
    if single.advised_column(first, told) != told.column():
        shared.append(single.with_threshold(*(row for _, row in shown.iterrows())))
    verdicts = set(shown["verdict"])
    if len(verdicts) == 1:
        shared.append(sheets.WORDS[verdicts.pop()])
    return Sheet(
        f"{sheets.TITLES[told]} by place",
        pd.DataFrame(listed),
        tuple(shared),
        (PLACES_IN_WORDS,),
        "tables/pile_grain.csv",
        main=f"half at, {told.unit}",
        is_grey=not valid(shown).any(),
    )


def _of_bed(
    row: pd.Series, results: Results, told: ReportedQuantity, telling: list[str]
) -> Iterator[dict[str, str]]:
    """A row for each place of a bed."""
    scene = str(row["scene_id"])
    if not results.shown(scene):
        return  # its cases were pruned, or are not here
    pile = results.plan.piles[scene]
    grains = results.tables["pile_grain"]
    own = grains[grains["scene_id"] == scene]
    level = float(row["level_ustar_m_s"])
    factors = _factors(row)
    for place in places_of(pile, own, level, results.cases):
        cells = {}
        if telling:
            cells["bed"] = ", ".join(labels.told(row, telling))
        cells |= {"place": place.name, "length": length(float(place.length.sum()))}
        for part, share in PARTS.items():
            ustar = factors * place.at(share)
            at, low, high = units.told_by(row, ustar, told)
            is_known = np.isfinite(ustar[0])
            cells[f"{part} at, {told.unit}"] = f"{at:#.3g}" if is_known else "never"
            ends = labels.interval(low, high) if is_known else "—"
            cells[f"interval of {part}, {told.unit}"] = ends
        yield cells


def _factors(row: pd.Series) -> FloatArray:
    """The advised friction velocity and the ends of its interval over the computed."""
    stem = "" if units.advised_over_computed(row) == 1 else "compared_"
    values = [single.known_number(row[f"{stem}ustar0{end}_m_s"]) for end in ENDINGS]
    return np.array(values) / float(row["ustar0_m_s"])
