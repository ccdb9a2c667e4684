"""The picture below the answer card: which one a study has."""

import pandas as pd

from orchestrator.report import (
    answers,
    head_grain,
    head_laws,
    head_line,
    head_share,
    head_sweep,
    sheets,
    single,
    theory,
)
from orchestrator.report.drawing import Head
from orchestrator.report.results import Results


def of(results: Results) -> Head | None:
    """Choose the picture of a study.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    Head or None
        Of many force laws where each is as measured, of one bed with a place where
        motion starts its three panels, of one grain the laws and the sizes, of a sweep
        its curves. None where another figure leads.
    """
    best = theory.best(theory.ranked(results))
    if len(best) > theory.MANY:
        return head_laws.laws(best)
    thresholds = results.joined("pile_threshold")
    if thresholds.empty:
        grains = sheets.single_grains(results)
        return _of_grains(grains) if len(grains) else None
    rows = results.exemplars
    if rows.empty:
        return None
    row = rows.iloc[0]
    pile = results.plan.piles[str(row["scene_id"])]
    has_place = row["first_ustar0_m_s"] > 0 and not single.is_level(row)
    is_line = has_place and not pile.bed.is_triangle
    if is_line and not answers.are_several_beds(results.at_fraction):
        return head_line.along(row, pile, results)
    return None


def below(results: Results) -> Head | None:
    """Choose what stands under the picture of a bed of grains.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    Head or None
        Of a mixture each size, of one other bed the share that has moved.
    """
    rows = results.exemplars
    if rows.empty:
        return None
    if answers.is_of_hills(results):
        return None
    row = rows.iloc[0]
    if sheets.sizes(results) is not None:
        return head_share.sizes(row, results)
    if answers.are_several_beds(results.at_fraction):
        return head_sweep.sweep(rows)
    return head_share.shares(row, results)


def _of_grains(grains: pd.DataFrame) -> Head | None:
    """Of one grain the laws and the sizes, of several the curves of a sweep."""
    if answers.is_one_grain(grains):
        return head_grain.of_grain(grains.iloc[0])
    return head_sweep.sweep(grains)
