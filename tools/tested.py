"""The intervals that held measured thresholds, of single grains or of poured strips.

Those of single grains need no run; those of strips are of the rows of a run of
`orchestrator validate`.

python tools/tested.py > orchestrator/physics/tested.csv
python tools/tested.py results/validate/tables/measured.csv > orchestrator/physics/tested_strips.csv
"""

import itertools
import sys
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.lab.strips import MOVED
from orchestrator.lab.validate import (
    EVENTS,
    FOLDER,
    GUST,
    INTENSITY,
    MODELS,
    measured_grains,
    single,
    sustained_shields,
)
from orchestrator.physics import saltation
from orchestrator.physics.beside import (
    AIR_OF_QUARTZ,
    ENTRAINED,
    GAS,
    LEVEL_DEG,
    LIKE,
    LIQUID,
    MOST_COHESION,
    MOST_SLOPE_DEG,
    NUMBERS_OF_STRIPS,
    OF_STRIPS,
    SUSTAINED,
)
from orchestrator.physics.laws import DEFAULT, LAWS
from orchestrator.physics.threshold import PAPER
from orchestrator.study import fields as columns
from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed
from orchestrator.types import Row

FLUMES = ("flumes, visual", "flumes, fixed intensity", "flumes, reference transport")
"""Sets of level beds in flumes, whose rows an interval holds."""
STEEP = ("steep flumes", "steep flumes, large elements")
"""Sets of steep beds, which an interval of sustained motion holds as well."""
WIND = ("wind, field", "wind tunnel, curve")
"""Sets in air."""
IN_AIR = (0.35, 52.0)
"""Range of Re* of the intervals in air: within 2 of those of the rows, 0.7 to 26."""
DECADES = (0.1, 1.0, 10.0, 100.0, 1000.0, 1e4)
LEAST = 10
"""Ranges of Re* of the intervals, and the fewest rows of one."""
OF_SUSTAINED = (DEFAULT, LAWS[DEFAULT].extended_by)
"""Force laws of sustained motion whose intervals are found: those of the default."""
BETAS = {60.0: (55.0, 60.0), 50.0: (47.5, 55.0), 45.0: (42.5, 47.5)}
"""Entrainment angles of the intervals, deg, each with the range that it stands for."""
RATIOS = {30.0: (27.0, 33.0), 10.0: (9.0, 11.0)}
"""The same of d/z0."""


class Found(NamedTuple):
    """What a range of Re* says: ends of the interval, rows, and the part of them in it."""

    low: float
    high: float
    rows: int
    held: float


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


def widest(
    parts: Sequence["pd.Series[float]"], sets: "pd.Series[str]", fewest: int = LEAST
) -> Found:
    """Make the interval that is right for several answers to the same measurements.

    Parameters
    ----------
    parts
        For each answer the ratios of the measured thresholds to it.
    sets
        The set of each measurement.
    fewest
        Fewest rows without a set.

    Returns
    -------
    Found
        The widest ends, the fewest rows, and the least part of them between the ends.
    """
    every = [ends(part, sets[part.index], fewest) for part in parts]
    low = min(each for each, _ in every)
    high = max(each for _, each in every)
    held = min(float(part.between(low, high).mean()) for part in parts)
    return Found(low, high, min(map(len, parts)), held)


def of_grains() -> pd.DataFrame:
    """The intervals of single grains: by medium, law, criterion and ranges of numbers.

    An entrainment angle and a d/z0 stand for a range. The interval of a range is the
    widest of those of its ends and of its middle.
    """
    beds = pd.read_csv(FOLDER / "beds.csv").rename(columns={"shields": "measured"})
    grains = measured_grains(beds)
    beds = beds.assign(galileo=grains.galileo, density_ratio=grains.density_ratio)
    made: list[Row] = []
    for name, span in RATIOS.items():
        ratios = sorted({name, *span})
        hops = {each: saltation.hops(measured_grains(beds, each)) for each in ratios}
        further = {
            each: sustained_shields(beds, GUST, is_entrained=False, ratio=each)
            for each in ratios
        }
        for (beta, betas), law in itertools.product(BETAS.items(), LAWS):
            of_entrained, of_sustained = [], []
            for angle, ratio in itertools.product(sorted({beta, *betas}), ratios):
                at = single(beds, law, angle, ratio)
                of_entrained.append(pd.Series(np.where(at.valid, at.shields, np.nan)))
                moved = saltation.motion(at.shields, further[ratio], hops[ratio], GUST)
                of_sustained.append(pd.Series(moved.shields))
            place = {
                "force_law": law,
                **_range("beta_deg", *betas),
                **_range("d_over_z0", *span),
            }
            in_flumes = beds["set"].isin(FLUMES)
            level = {"criterion": ENTRAINED, **_range("alpha_deg", 0.0, LEVEL_DEG)}
            for row in _of_liquids(beds[in_flumes], of_entrained):
                made.append({**level, **place, **row})
            if law not in OF_SUSTAINED:
                continue
            sloping = {
                "criterion": SUSTAINED,
                **_range("alpha_deg", 0.0, MOST_SLOPE_DEG),
            }
            in_flumes = beds["set"].isin([*FLUMES, *STEEP])
            for row in _of_liquids(beds[in_flumes], sustained_shields):
                made.append({**sloping, **place, **row})
            row = _of_air(beds[beds["set"].isin(WIND)], sustained_shields)
            made.append({**sloping, **place, **row})
    return _sorted(
        made, ["medium", "criterion", "force_law"], ["beta_deg", "d_over_z0"]
    )


def _range(column: str, low: float, high: float) -> Row:
    """The columns of the two ends of a range."""
    return {f"{column}_low": low, f"{column}_high": high}


def _sorted(made: list[Row], words: list[str], numbers: list[str]) -> pd.DataFrame:
    """Rows in the order of their words, numbers and Re*, with columns in that order."""
    names = [f"{name}_{end}" for name in numbers for end in ("low", "high")]
    table = pd.DataFrame(made).sort_values([*words, *names, "reynolds_low"])
    first = [*words, *names]
    return table[[*first, *(name for name in table if name not in first)]]


def _of_liquids(
    beds: pd.DataFrame, answers: Sequence["pd.Series[float]"]
) -> Iterator[Row]:
    """The intervals of some answers in a liquid, by decades of their Re*."""
    for low, high in itertools.pairwise(DECADES):
        parts = []
        for answer in answers:
            value = answer[beds.index]
            reynolds = np.sqrt(value) * beds["galileo"]
            here = (reynolds > low) & (reynolds <= high)
            parts.append((beds["measured"] / value)[here])
        if min(map(len, parts)) < LEAST:
            continue
        # measured beside every answer of the range
        ratios = [beds.loc[part.index, "density_ratio"] for part in parts]
        yield {
            "medium": LIQUID,
            **_range("reynolds", low, high),
            **_range("density_ratio", max(map(min, ratios)), min(map(max, ratios))),
            **_range("cohesion_n_m", 0.0, 0.0),
            **widest(parts, beds["set"])._asdict(),
        }


def _of_air(beds: pd.DataFrame, answers: Sequence["pd.Series[float]"]) -> Row:
    """The interval of some answers in air."""
    parts = [beds["measured"] / answer[beds.index] for answer in answers]
    return {
        "medium": GAS,
        **_range("reynolds", *IN_AIR),
        **_range("density_ratio", *AIR_OF_QUARTZ),
        **_range("cohesion_n_m", 0.0, MOST_COHESION),
        # each site, and the curve, is left out once
        **widest(parts, beds["source"], fewest=2)._asdict(),
    }


def of_strips(rows: pd.DataFrame, strip: Scene) -> pd.DataFrame:
    """The intervals of strips, by the fields of a strip and the model's Re*.

    `rows` are those of `compared`, `strip` is one of the strips that they were answered on.
    """
    flumes = rows[rows["set"].isin(FLUMES)]
    made: list[Row] = []
    of_strips = (
        each for each in MODELS if each.name != PAPER and not each.is_sustained
    )
    for model, law in itertools.product(of_strips, OF_SUSTAINED):
        gusts = {"intensity": INTENSITY, "events": EVENTS} if model.gust > 1 else None
        scene = changed(strip, {**model.fields, "forces.law": law, "flow.gusts": gusts})
        beds = flumes[flumes["model"] == model.name]
        beds = beds.assign(density_ratio=beds["rho_sol_kg_m3"] / beds["rho_f_kg_m3"])
        used: dict[str, Any] = {**columns.used(scene), "fraction": MOVED}
        used["gust"] = scene.gust
        used["d_over_z0"] = scene.grain.diameter / scene.bed.roughness
        kind: Row = {"criterion": ENTRAINED, "force_law": law}
        kind |= {name: used[name] or "" for name in OF_STRIPS}
        for name in ("d_over_z0", *NUMBERS_OF_STRIPS):
            kind |= _range(name, used[name] * (1 - LIKE), used[name] * (1 + LIKE))
        kind |= _range("alpha_deg", 0.0, LEVEL_DEG)
        for row in _of_liquids(beds, [beds["value"].astype(float)]):
            made.append({**kind, **row})
    words = ["medium", "criterion", "force_law", *OF_STRIPS]
    return _sorted(made, words, ["d_over_z0", *NUMBERS_OF_STRIPS])


if __name__ == "__main__":
    if len(sys.argv) > 1:
        (strip, *_) = (
            scene for scene in study.load("validate").scenes if scene.is_poured
        )
        table = of_strips(pd.read_csv(sys.argv[1]), strip)
    else:
        table = of_grains()
    table.to_csv(sys.stdout, index=False)
