"""The intervals that held measured thresholds, of the rows of a run of `orchestrator validate`.

python tools/tested.py results/validate/tables/measured.csv > orchestrator/physics/tested.csv
"""

import itertools
import sys

import numpy as np
import pandas as pd

from orchestrator.experiments.strips import MOVED
from orchestrator.experiments.validate import (
    EVENTS,
    GUST,
    INTENSITY,
    MODELS,
    going_on,
    single,
)
from orchestrator.physics.beside import GOES_ON, kind_of
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import PAPER
from orchestrator.study import fields as columns
from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed

FLUMES = ("flumes, visual", "flumes, fixed intensity", "flumes, reference transport")
"""Sets of level beds in flumes, whose rows an interval holds."""
DECADES = (0.1, 1.0, 10.0, 100.0, 1000.0, 1e4)
LEAST = 10
"""Ranges of Re* of the intervals, and the fewest rows of one."""
GOING_ON = ("bridged", "bridged-gravel")
"""Force laws of the grains that go on whose intervals are found: those of the default."""
BETAS, RATIOS = (60.0, 50.0, 45.0), (30.0, 10.0)
"""Entrainment angles (deg) and d/z0 of the single grains whose intervals are found."""


def ends(ratio: "pd.Series[float]", sets: "pd.Series[str]") -> tuple[float, float]:
    """Tenth and ninetieth percentile of ratios, of all and without each of the sets: the widest."""
    left = (ratio[sets != name] for name in sets.unique())
    parts = [ratio, *(part for part in left if len(part) >= LEAST)]
    lows = (part.quantile(0.1, interpolation="lower") for part in parts)
    return min(lows), max(part.quantile(0.9, interpolation="higher") for part in parts)


def intervals(rows: pd.DataFrame, strip: Scene) -> pd.DataFrame:
    """The interval that held measured thresholds of flumes, by kind of answer and the model's Re*.

    `rows` are those of `compared`, `strip` is one of the strips that they were answered on. Ends
    are over the Shields number of the model; ``held`` is the share of the ``rows`` between them.
    """
    flumes = rows[rows["set"].isin(FLUMES)]
    beds, answers = flumes[flumes["model"] == PAPER], {}
    usual = columns.asked(strip)
    for law, beta, ratio in itertools.product(LAWS, BETAS, RATIOS):
        at = single(beds, law, beta, ratio)
        row = {
            "force_law": law,
            "beta_deg": beta,
            "d_m": 1.0,
            "z0_m": 1 / ratio,
            "bed": "grain",
        }
        answers[kind_of({**usual, **row})] = np.where(at.valid, at.shields, np.nan)
    for law, beta, ratio in itertools.product(GOING_ON, BETAS, RATIOS):
        row = {
            "force_law": law,
            "beta_deg": beta,
            "d_m": 1.0,
            "z0_m": 1 / ratio,
            "bed": "grain",
            "criterion": GOES_ON,
        }
        answers[kind_of({**usual, **row})] = going_on(
            beds, GUST, leaves=True, law=law, beta_deg=beta, ratio=ratio
        )
    of_strips = (each for each in MODELS if each.name != PAPER and not each.goes_on)
    for model, law in itertools.product(of_strips, ("bridged", "bridged-gravel")):
        gusts = {"intensity": INTENSITY, "events": EVENTS} if model.gust > 1 else None
        scene = changed(strip, {**model.fields, "forces.law": law, "flow.gusts": gusts})
        part = flumes[flumes["model"] == model.name]
        row = {**columns.asked(scene), **columns.answered(scene), "fraction": MOVED}
        answers[kind_of(row)] = part["value"].to_numpy(float)
    made = []
    for kind, value in answers.items():
        over_model = beds["measured"] / value
        decades = pd.cut(np.sqrt(value) * beds["galileo"], DECADES)
        for at, part in over_model.groupby(decades, observed=True):
            if len(part) >= LEAST:
                low, high = ends(part, beds["set"][part.index])
                found = (low, high, len(part), part.between(low, high).mean())
                made.append((kind, at.left, at.right, *found))
    names = ["kind", "reynolds_low", "reynolds_high", "low", "high", "rows", "held"]
    return pd.DataFrame(made, columns=names)


if __name__ == "__main__":
    (strip, *_) = (scene for scene in study.load("validate").scenes if scene.is_poured)
    intervals(pd.read_csv(sys.argv[1]), strip).to_csv(sys.stdout, index=False)
