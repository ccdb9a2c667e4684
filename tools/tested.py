"""The intervals that held measured thresholds, of the rows of a run of `orchestrator validate`.

Those of grains that go on need no run: without a file the others are kept as they are.

python tools/tested.py results/validate/tables/measured.csv > orchestrator/physics/tested.csv
"""

import itertools
import sys
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.lab.strips import MOVED
from orchestrator.lab.validate import (
    EVENTS,
    FOLDER,
    GUST,
    INTENSITY,
    MODELS,
    going_on,
    hoppers,
    single,
)
from orchestrator.physics import saltation
from orchestrator.physics.beside import GOES_ON, TABLE, kind_of
from orchestrator.physics.constants import GRAVITY
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import PAPER
from orchestrator.study import fields as columns
from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed

FLUMES = ("flumes, visual", "flumes, fixed intensity", "flumes, reference transport")
"""Sets of level beds in flumes, whose rows an interval holds."""
STEEP = ("steep flumes", "steep flumes, large elements")
"""Sets of steep beds, which an interval of grains that go on holds as well."""
WIND = ("wind, field", "wind tunnel, curve")
"""Sets in air."""
IN_AIR = (0.35, 52.0)
"""Range of Re* of the intervals in air: within 2 of those of the rows, 0.7 to 26."""
DECADES = (0.1, 1.0, 10.0, 100.0, 1000.0, 1e4)
NAMES = ["kind", "reynolds_low", "reynolds_high", "low", "high", "rows", "held"]
"""Columns of the table."""
LEAST = 10
"""Ranges of Re* of the intervals, and the fewest rows of one."""
GOING_ON = ("bridged", "bridged-gravel")
"""Force laws of the grains that go on whose intervals are found: those of the default."""
BETAS, RATIOS = (60.0, 50.0, 45.0), (30.0, 10.0)
"""Entrainment angles (deg) and d/z0 of the single grains whose intervals are found."""


def ends(
    ratio: "pd.Series[float]",
    sets: "pd.Series[str]",
    fewest: int = LEAST,
) -> tuple[float, float]:
    """Tenth and ninetieth percentile of ratios, of all and without each of the sets.

    They are the widest; what is left without a set has at least the `fewest` rows.
    """
    left = (ratio[sets != name] for name in sets.unique())
    parts = [ratio, *(part for part in left if len(part) >= fewest)]
    lows = (part.quantile(0.1, interpolation="lower") for part in parts)
    highs = (part.quantile(0.9, interpolation="higher") for part in parts)
    return min(lows), max(highs)


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
    of_strips = (each for each in MODELS if each.name != PAPER and not each.goes_on)
    for model, law in itertools.product(of_strips, ("bridged", "bridged-gravel")):
        gusts = {"intensity": INTENSITY, "events": EVENTS} if model.gust > 1 else None
        scene = changed(strip, {**model.fields, "forces.law": law, "flow.gusts": gusts})
        part = flumes[flumes["model"] == model.name]
        row = {**columns.used(scene), "fraction": MOVED}
        answers[kind_of(row)] = part["value"].to_numpy(float)
    made = going_on_intervals(usual)
    for kind, value in answers.items():
        over_model = beds["measured"] / value
        decades = pd.cut(np.sqrt(value) * beds["galileo"], DECADES)
        for at, part in over_model.groupby(decades, observed=True):
            if len(part) >= LEAST:
                low, high = ends(part, beds["set"][part.index])
                found = (low, high, len(part), part.between(low, high).mean())
                made.append((kind, at.left, at.right, *found))
    return pd.DataFrame(made, columns=NAMES)


def going_on_intervals(usual: dict[str, Any]) -> list[tuple[Any, ...]]:
    """Rows of the intervals of grains that go on, in flumes and in air."""
    all_beds = pd.read_csv(FOLDER / "beds.csv").rename(columns={"shields": "measured"})
    excess = (all_beds["rho_sol_kg_m3"] / all_beds["rho_f_kg_m3"] - 1) * GRAVITY
    galileo = np.sqrt(excess * all_beds["d_m"] ** 3) / all_beds["nu_m2_s"]
    made = []
    hops = {each: saltation.hops(hoppers(all_beds, each)) for each in RATIOS}
    further = {
        each: going_on(all_beds, GUST, leaves=False, ratio=each) for each in RATIOS
    }
    for law, beta, ratio in itertools.product(GOING_ON, BETAS, RATIOS):
        leaves = single(all_beds, law, beta, ratio).shields
        value = saltation.motion(leaves, further[ratio], hops[ratio], GUST).shields
        over_model = all_beds["measured"] / value
        reynolds = np.sqrt(value) * galileo
        row = {
            "force_law": law,
            "beta_deg": beta,
            "d_m": 1.0,
            "z0_m": 1 / ratio,
            "bed": "grain",
            "criterion": GOES_ON,
        }
        in_flumes = all_beds["set"].isin([*FLUMES, *STEEP])
        kind = kind_of({**usual, **row})
        decades = pd.cut(reynolds[in_flumes], DECADES)
        for at, part in over_model[in_flumes].groupby(decades, observed=True):
            if len(part) >= LEAST:
                low, high = ends(part, all_beds["set"][part.index])
                held = part.between(low, high).mean()
                made.append((kind, at.left, at.right, low, high, len(part), held))
        air = {"rho_f_kg_m3": 1.2, "rho_sol_kg_m3": 2650.0}
        part = over_model[all_beds["set"].isin(WIND)]
        # each site, and the curve, is left out once
        low, high = ends(part, all_beds["source"][part.index], fewest=2)
        held = part.between(low, high).mean()
        kind = kind_of({**usual, **row, **air})
        made.append((kind, *IN_AIR, low, high, len(part), held))
    return made


if __name__ == "__main__":
    (strip, *_) = (scene for scene in study.load("validate").scenes if scene.is_poured)
    if len(sys.argv) > 1:
        table = intervals(pd.read_csv(sys.argv[1]), strip)
    else:
        kept = pd.read_csv(TABLE)
        kept = kept[~kept["kind"].str.contains(GOES_ON)]
        made = going_on_intervals(columns.asked(strip))
        table = pd.concat([kept, pd.DataFrame(made, columns=NAMES)])
    table.to_csv(sys.stdout, index=False)
