"""The report card: what the paper claims, and what this study finds of it."""

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from orchestrator.paper.claims import counting, curves, model, motion, piles, single
from orchestrator.paper.claims.base import Claim, Evidence
from orchestrator.report import page
from orchestrator.tables import Tables

JUDGES: tuple[Callable[[Evidence], Claim], ...] = (
    single.constant,
    single.compacity,
    single.roughness,
    curves.best_fit,
    single.numerical,
    single.slope,
    motion.order,
    piles.slope,
    piles.above_single,
    counting.wiggles,
    piles.saturation,
    piles.roughness,
    piles.fraction,
    model.conditioning,
    model.regimes,
    model.stress,
    model.coupling,
)
"""One for each claim: in the paper's order, then those on its method."""
FOLDER = Path(__file__).parent
WORDS = {"reproduced": "reproduced", "partly": "partly", "not": "not reproduced"}
"""How the page says a verdict."""


def judge(tables: Tables) -> list[Claim]:
    """Every claim of the paper, judged by the tables of a study; some may lack their data."""
    evidence = Evidence(tables)
    return [one(evidence) for one in JUDGES]


def section(found: Sequence[Claim], figures: Sequence[str]) -> Markup:
    """The report card as a section of the page; empty where nothing could be judged."""
    return Markup(page.fill("card.html.j2", FOLDER, **card(found, figures)))


def card(found: Sequence[Claim], figures: Sequence[str]) -> dict[str, Any]:
    """The report card's section on judged claims.

    Parameters
    ----------
    found : sequence of Claim
        As `judge` gave them.
    figures : sequence of str
        Names of the page's figures, in its order.
    """
    judged = [claim for claim in found if claim.verdict != "no data"]
    counts = Counter[str](claim.verdict for claim in judged)
    return {
        "entries": [
            {"claim": claim, "word": WORDS[claim.verdict], "figures": _shown(claim, figures)}
            for claim in judged
        ],
        "counts": [f"{counts[key]} {word}" for key, word in WORDS.items() if counts[key]],
        "lacking": [claim.says for claim in found if claim.verdict == "no data"],
    }


def _shown(claim: Claim, figures: Sequence[str]) -> list[int]:
    """Numbers of the figures that show a claim."""
    return [n for n, name in enumerate(figures, 1) if name.startswith(claim.figures)]


def frame(found: Sequence[Claim]) -> pd.DataFrame:
    """The claims as a table; what was measured is one text, its parts on lines of their own."""
    rows = [
        {
            "claim": claim.says,
            "where": claim.where,
            "measured": "\n".join(claim.measured),
            "verdict": claim.verdict,
            "rule": claim.rule,
            "why": claim.why,
        }
        for claim in found
    ]
    return pd.DataFrame(rows)
