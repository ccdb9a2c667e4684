"""The claim of the paper on which grains of a pile move first (section 3.2, Fig. 13).

Whether a grain rolls or lifts is not judged: in runs of one pile that differ in the mobile layers
and in the stiffness alone, with equal thresholds, 3 to 76 % of the moved grains count as lifted.
"""

import numpy as np
import pandas as pd

from orchestrator.paper.claims.base import MOST, Claim, Evidence, by_share
from orchestrator.report.results import split

CREST = 0.9
"""Grains above this part of the exposed ones, counted from the toe, are at the crest."""
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
        ("bed", "wall-stress"),
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
