"""The tables of the page: what each solver found, and what it took."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark import intake
from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.verdict import Contender, Verdict, ours, within

MILLION = 1e6


def thresholds(pack: Pack, contenders: Sequence[Contender]) -> pd.DataFrame:
    """The threshold Shields numbers of piles: ours, each solver's, the interval."""
    rows = contenders[0].rows
    asked = rows[(rows["quantity"] == "shields") & (rows["at"] != "")]
    ends = zip(asked["low"], asked["high"], strict=True)
    return pd.DataFrame(
        {
            "scene": asked["scene"],
            "pile": asked["scene"].map(pack.about),
            "n/N": [f"{float(at):.0%}" for at in asked["at"]],
            **{
                one.name: _marked(one.rows["found"][asked.index], asked)
                for one in (ours(contenders), *contenders)
            },
            "interval": [f"{low:#.3g} ... {high:#.3g}" for low, high in ends],
        }
    )


def _marked(found: "pd.Series[float]", expected: pd.DataFrame) -> list[str]:
    inside, tolerated = (within(found, expected, t) for t in (0.0, expected["tolerance"]))
    marks = np.select([found.isna() | inside, tolerated], ["", " *"], " **")
    return [
        "—" if x != x else f"{x:#.3g}{mark}" for x, mark in zip(found.tolist(), marks, strict=True)
    ]


def costs(pack: Pack, contenders: Sequence[Contender]) -> pd.DataFrame:
    """CPU time of each pile, ours and each solver's, and the grain-steps of a second of it."""
    names = [v.scene for v in contenders[0].verdicts if v.kind == "pile"]
    grains = [_mobile(pack, name) for name in names]
    table: dict[str, Any] = {
        "scene": names,
        "pile": [pack.about(name) for name in names],
        "mobile": grains,
    }
    for one in (ours(contenders), *contenders):
        of = {v.scene: v for v in one.verdicts}
        piles = [of[name] for name in names]
        rates = [n * v.steps / v.cpu_s / MILLION for n, v in zip(grains, piles, strict=True)]
        table[f"{one.name}, s"] = [v.cpu_s if v.answered else np.nan for v in piles]
        table[f"{one.name} over ours"] = [v.cpu_ratio for v in piles]
        table[f"{one.name}, M/s"] = rates
    # what nobody states has no column
    return pd.DataFrame(table).dropna(axis="columns", how="all")


def _mobile(pack: Pack, scene: str) -> int:
    # of the fixed ones a solver may leave out what nothing can touch
    return intake.mobile(pack.directory(scene) / "grains.csv")


def scenes(contenders: Sequence[Contender]) -> pd.DataFrame:
    """How each scene went."""
    return pd.DataFrame(_scene(one.name, v) for one in contenders for v in one.verdicts)


def _scene(solver: str, one: Verdict) -> dict[str, Any]:
    return {
        "solver": solver,
        "scene": one.scene,
        "kind": one.kind,
        "verdict": "passed" if one.passed else "failed",
        "error, %": 100 * one.error,
        "largest, %": 100 * one.worst,
        "s": one.seconds,
        "ours, s": one.ours_seconds,
        "ratio": one.ratio,
        "CPU ratio": one.cpu_ratio,
        "MiB": one.peak_mib,
    }
