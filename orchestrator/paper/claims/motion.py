"""Claims of the paper on which grains of a pile move first, and how (section 3.2, Fig. 13)."""

import numpy as np
import pandas as pd

from orchestrator.paper.claims.base import (
    BY_SHARE,
    MOST,
    NAMES,
    Claim,
    Evidence,
    by_share,
    combined,
)
from orchestrator.report.results import split

CREST = 0.9
"""Grains above this part of the exposed ones, counted from the toe, are at the crest."""
MIDDLE = (0.4, 0.6)
RANKED = -0.9
"""Rank correlation of position and order from which the motion runs downward."""


def order(evidence: Evidence) -> Claim:
    """Who moves first, and where the motion goes."""
    found = _orders(evidence.piles("pile_grain"))
    answers = (found["first"] > CREST) & (found["rank"] <= RANKED)
    other = [
        text
        for packing, name in (("disordered", "random gaps"), ("horizontal", "level rows"))
        for text in _order_said(_orders(evidence.piles("pile_grain", packing)), name)
    ]
    return Claim(
        "Grains at the top of the pile start the process, and limiting conditions propagate "
        "downward",
        "3.2, Fig. 13",
        (*_order_said(found, "rows along the slope"), *other),
        f"judged on rows along the slope; reproduced: in at least {MOST:.0%} of the piles the "
        "first load step that moves any grain moves the topmost tenth’s, and the rank "
        "correlation of "
        f"place and order is {RANKED:g} or less; not: in at most 5 %; else partly",
        by_share(answers),
        "The stress is largest at the crest and a grain needs its downstream neighbour gone: one "
        "frees the next.",
        ("grains", "wall-stress"),
    )


def _orders(grains: pd.DataFrame) -> pd.DataFrame:
    """A row for each pile: rank correlation, share of neighbours in order, place of the first."""
    rows = []
    for _, own in split(grains, "scene_id"):
        own = own.sort_values("s_m")
        load_step = own["moved_in_load_step"].to_numpy(int)
        if not (load_step > 0).any():
            continue
        late = np.where(load_step > 0, load_step, load_step.max() + 1)
        place = (np.arange(len(late)) + 0.5) / len(late)
        first = place[late == late.min()].max()
        order = np.mean(late[1:] <= late[:-1])
        rows.append((_rank(place, late), order, first, np.sum(load_step == 0), len(load_step)))
    return pd.DataFrame(rows, columns=["rank", "in_order", "first", "still", "count"], dtype=float)


def _rank(x: object, y: object) -> float:
    """Spearman's rank correlation."""
    ranks = pd.DataFrame({"x": x, "y": y}).rank()
    return float(ranks["x"].corr(ranks["y"]))


def _order_said(found: pd.DataFrame, name: str) -> tuple[str, ...]:
    if found.empty:
        return ()
    return (
        f"{name}, {len(found)} piles: rank correlation of place (from the toe) and load step of "
        f"the "
        f"passage {found['rank'].median():.3f} in the median (worst {found['rank'].max():.3f}); "
        f"neighbours in order {found['in_order'].median():.1%}, those that go in one load step "
        "included; the first load step with motion moves "
        f"one of the topmost tenth in {int((found['first'] > CREST).sum())} of {len(found)}; "
        f"{found['still'].sum() / found['count'].sum():.0%} of the grains never moved and count as "
        "last",
    )


def modes(evidence: Evidence) -> Claim:
    """How crest grains and those of the middle move."""
    found = _modes(evidence.piles("pile_grain"))
    verdicts = []
    for _, own in split(found, "force_law"):
        verdicts += [by_share(own["crest"] >= 0.5), by_share(own["middle"] < 0.5)]
    return Claim(
        "Grains near the crest lift after a short roll; at mid slope rolling prevails",
        "3.2, Fig. 13",
        tuple(
            text
            for law_name in NAMES
            for text in _modes_said(found[found["force_law"] == law_name], NAMES[law_name])
        ),
        BY_SHARE.replace("comparisons", "piles")
        + "; so: at least half of the topmost tenth of the grains that moved lifted, and less than "
        "half of the middle fifth",
        combined(verdicts),
        "Lifted means: rose by more than 0.3 d over its bed within 2 √(d/g′) of passing the "
        "marker. Such a grain need not be lifted by the flow: in the low regime lift is small, and "
        "a grain that leaves its pocket presumably hops over its neighbours under a drag that "
        "stays as it was at the start and needs to be larger, for want of lift.",
        ("grains",),
    )


def _modes(grains: pd.DataFrame) -> pd.DataFrame:
    """Share of lifted ones among the grains that moved, at the crest and in the middle."""
    rows = []
    for _, own in split(grains, "scene_id"):
        own = own.sort_values("s_m")
        place = (np.arange(len(own)) + 0.5) / len(own)
        moved = own["moved_in_load_step"].to_numpy(int) > 0
        kinds = own["mode"].to_numpy(str)
        middle = (place > MIDDLE[0]) & (place < MIDDLE[1])
        parts = (kinds[moved & (place > CREST)], kinds[moved & middle])
        if all(map(len, parts)):
            shares = (np.mean(part == kind) for kind in ("lifted", "slid") for part in parts)
            rows.append((own["force_law"].iloc[0], *shares))
    columns = ["force_law", "crest", "middle", "crest_slid", "middle_slid"]
    return pd.DataFrame(rows, columns=columns)


def _modes_said(found: pd.DataFrame, name: str) -> tuple[str, ...]:
    if found.empty:
        return ()
    higher = int((found["crest"] > found["middle"]).sum())
    return (
        f"{name}, {len(found)} piles: lifted {found['crest'].median():.0%} of the topmost tenth "
        f"and {found['middle'].median():.0%} of the middle fifth (medians of the grains that "
        f"moved), more at the crest in {higher}; slid "
        f"{found[['crest_slid', 'middle_slid']].to_numpy().mean():.1%}, the others rolled",
    )
