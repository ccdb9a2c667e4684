"""The intervals of measured thresholds, of single grains or of poured strips.

Each set of measurements is left out once, and predicted by the others. An interval is
as wide as 80 % of the rows need that are left out so. Those of single grains need no
run; those of strips are of the rows of a run of `orchestrator validate`.

python tools/tested.py > orchestrator/physics/tested.csv
python tools/tested.py results/validate/tables/measured.csv > orchestrator/physics/tested_strips.csv
"""

import itertools
import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.lab.strips import MOVED
from orchestrator.lab.validate import (
    EVENTS,
    GUST,
    INTENSITY,
    IVERSEN_WHITE,
    MODELS,
    measured_grains,
    single,
    sustained_shields,
)
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
    window_weight,
)
from orchestrator.physics.curves import GAMMA
from orchestrator.physics.laws import DEFAULT, LAWS
from orchestrator.physics.measured import MEASURED_BEDS
from orchestrator.physics.threshold import PAPER
from orchestrator.study import fields as columns
from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed
from orchestrator.types import FloatArray, Row

FLUMES = ("flumes, visual", "flumes, fixed intensity", "flumes, reference transport")
"""Sets of level beds in flumes, whose rows an interval holds."""
STEEP = ("steep flumes", "steep flumes, large elements")
"""Sets of steep beds, which an interval of sustained motion holds as well."""
WIND = ("wind, field", IVERSEN_WHITE)
"""Sets in air: three sites, and a formula at some sizes."""
IN_AIR = (1.1, 52.0)
"""Range of Re* of the intervals in air: within 2 of those of the rows, 2.2 to 26."""
WINDOWS = tuple((10 ** (n / 2 - 1), 10 ** (n / 2)) for n in range(9))
"""Windows of Re* of the intervals in liquids, each a decade: every half of a decade."""
LEAST = 10
"""Fewest rows of a window, and of those that predict a set."""
COVERED = 0.8
WIDER = 1.005
"""Share of the rows left out that an interval contains, and by how much it is made wider at a time."""
OF_SUSTAINED = (DEFAULT, LAWS[DEFAULT].extended_by)
"""Force laws of the sustained motion whose intervals are found: those of the default."""
BETAS = {60.0: (55.0, 60.0), 50.0: (47.5, 55.0), 45.0: (42.5, 47.5)}
"""Entrainment angles of the intervals, deg, each with the range that it stands for."""
RATIOS = {30.0: (27.0, 33.0), 10.0: (9.0, 11.0)}
"""The same of d/z0."""


COHESIONS = (0.0, MOST_COHESION)
"""Cohesions with which the rows in air are answered, N/m."""


class Found(NamedTuple):
    """What a window of Re* says.

    Ends of the interval in the middle of its window, the number of rows and of their
    sets, the share of the rows that are contained where their set is left out, and the
    factor by which it is wider than the tenth to ninetieth percentile.
    """

    low: float
    high: float
    rows: int
    sets: int
    held: float
    widened: float


Ratios = Sequence["pd.Series[float]"]
"""For each of several answers to the same measurements, the ratios of these to it."""


def ends(parts: Ratios) -> tuple[float, float]:
    """Tenth and ninetieth percentile of ratios, the widest of several answers."""
    lows = (part.quantile(0.1, interpolation="lower") for part in parts)
    highs = (part.quantile(0.9, interpolation="higher") for part in parts)
    return min(lows), max(highs)


def predicted(
    parts: Ratios, sets: "pd.Series[str]", every: Ratios, fewest: int = LEAST
) -> dict[str, tuple[float, float]] | None:
    """Find the percentiles that the other sets have for each set that is left out.

    Parameters
    ----------
    parts
        The ratios.
    sets
        The set of each measurement.
    every
        The ratios at all Re*: they are taken where fewer than `fewest` of the others
        are in this range.
    fewest
        Fewest rows that predict a set.

    Returns
    -------
    dict of str to tuple
        The ends by set. None where a set is alone: no other predicts it.
    """
    found = {}
    for name in sets[parts[0].index.union(parts[-1].index)].unique():
        others = [part[sets[part.index] != name] for part in parts]
        if min(map(len, others)) < fewest:
            others = [part[sets[part.index] != name] for part in every]
        if min(map(len, others)) < fewest:
            return None
        found[name] = ends(others)
    return found


class Window(NamedTuple):
    """What the rows in a window of Re* say: ends, and those that predict each set."""

    span: tuple[float, float]
    parts: list["pd.Series[float]"]
    ends: tuple[float, float]
    of_sets: dict[str, tuple[float, float]]


def windows_of(
    ratios: Ratios,
    reynolds: Ratios,
    sets: "pd.Series[str]",
    spans: Iterable[tuple[float, float]],
    fewest: int,
) -> Iterator[Window]:
    """The windows that have rows enough, and whose sets are predicted."""
    for span in spans:
        low, high = span
        parts = [
            ratio[(at > low) & (at <= high)]
            for ratio, at in zip(ratios, reynolds, strict=True)
        ]
        if min(map(len, parts)) < fewest:
            continue
        of_sets = predicted(parts, sets, ratios, fewest)
        if of_sets is not None:
            yield Window(span, parts, ends(parts), of_sets)


def calibrated(
    ratios: Ratios,
    reynolds: Ratios,
    sets: "pd.Series[str]",
    spans: Iterable[tuple[float, float]],
    fewest: int = LEAST,
) -> list[tuple[Window, Found]]:
    """Make the intervals that are right for several answers to the same measurements.

    Parameters
    ----------
    ratios, reynolds
        For each answer, the ratios of the measurements to it, and its Re*.
    sets
        The set of each measurement.
    spans
        The windows of Re*.
    fewest
        Fewest rows of a window, and of those that predict a set.

    Returns
    -------
    list of tuple
        For each window that has an interval the percentiles of all rows, widened so
        that `COVERED` of its rows are contained whose set is left out, by what is
        between the windows that they are in, and up to the answer itself; of several
        answers the widest, the fewest rows and the least share.
    """
    windows = [*windows_of(ratios, reynolds, sets, spans, fewest)]
    if not windows:
        return []
    beyond = [
        _beyond(windows, ratio, at, sets)
        for ratio, at in zip(ratios, reynolds, strict=True)
    ]
    widened = np.zeros(len(windows))
    while True:
        held = np.array([_held(each, widened) for each in beyond]).min(axis=0)
        if (held >= COVERED).all():
            break
        widened[held < COVERED] += np.log(WIDER)
    made = []
    for window, factor, share in zip(windows, np.exp(widened), held, strict=True):
        low, high = window.ends
        found = Found(
            low=min(low / factor, 1.0),
            high=max(high * factor, 1.0),
            rows=min(map(len, window.parts)),
            sets=min(sets[part.index].nunique() for part in window.parts),
            held=float(share),
            widened=float(factor),
        )
        made.append((window, found))
    return made


class Beyond(NamedTuple):
    """How far rows of an answer are beyond what predicts them, without widening.

    By how much the logarithm of each is beyond an end, shape (n,), and what each window
    counts for it, shape (windows, n).
    """

    logs: FloatArray
    weights: FloatArray


def _beyond(
    windows: Sequence[Window],
    ratio: "pd.Series[float]",
    at: "pd.Series[float]",
    sets: "pd.Series[str]",
) -> Beyond:
    """Place the rows of an answer beside the windows that they are in."""
    reynolds = at.to_numpy(float)
    weights, logs = [], []
    for window in windows:
        low, high = window.span
        inside = (reynolds > low) & (reynolds <= high)
        weights.append(window_weight(reynolds, window.span, inside))
        pairs = [
            window.of_sets[name] if here else (1.0, 1.0)
            for name, here in zip(sets[ratio.index], inside, strict=True)
        ]
        logs.append(np.log(pairs).T)
    total = np.sum(weights, axis=0)
    known = total > 0
    part = np.array(weights)[:, known] / total[known]
    low, high = (part[:, None] * np.array(logs)[:, :, known]).sum(axis=0)
    log = np.log(ratio.to_numpy(float))[known]
    return Beyond(np.maximum(low - log, log - high), part)


def _held(beyond: Beyond, widened: FloatArray) -> FloatArray:
    """Share of the rows of each window that are contained where their set is left out."""
    is_held = beyond.logs <= widened @ beyond.weights + 1e-12
    in_window = beyond.weights > 0
    return np.asarray((is_held & in_window).sum(axis=1) / in_window.sum(axis=1))


def of_grains() -> pd.DataFrame:
    """The intervals of single grains: by medium, law, criterion and ranges of numbers.

    An entrainment angle and a d/z0 stand for a range. The interval of a range is the
    widest of those of its ends and of its middle.
    """
    beds = pd.read_csv(MEASURED_BEDS).rename(columns={"shields": "measured"})
    beds = beds.assign(group=beds["set"] + ", " + beds["source"])
    grains = measured_grains(beds)
    beds = beds.assign(galileo=grains.galileo, density_ratio=grains.density_ratio)
    # a formula says nothing of grains that its own cohesion holds
    is_light = GAMMA / beds["d_m"] > grains.density * grains.gravity * beds["d_m"]
    air = beds[beds["set"].isin(WIND) & ~is_light]
    made: list[Row] = []
    for name, span in RATIOS.items():
        ratios = sorted({name, *span})
        further = {
            each: sustained_shields(beds, GUST, is_entrained=False, ratio=each)
            for each in ratios
        }
        for (beta, betas), law in itertools.product(BETAS.items(), LAWS):
            of_entrained, of_sustained, in_air = [], [], []
            for angle, ratio in itertools.product(sorted({beta, *betas}), ratios):
                at = single(beds, law, angle, ratio)
                of_entrained.append(pd.Series(np.where(at.valid, at.shields, np.nan)))
                moved = np.maximum(at.shields / GUST, further[ratio])
                of_sustained.append(pd.Series(moved))
                for held in (air.assign(cohesion_n_m=each) for each in COHESIONS):
                    at = single(held, law, angle, ratio)
                    moved = np.maximum(at.shields / GUST, further[ratio][air.index])
                    in_air.append(pd.Series(moved, air.index))
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
            for row in _of_liquids(beds[in_flumes], of_sustained):
                made.append({**sloping, **place, **row})
            made.append({**sloping, **place, **_of_air(air, in_air)})
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
    """The intervals of some answers in a liquid, by windows of their Re*."""
    ratios, reynolds = _beside(beds, answers)
    for window, found in calibrated(ratios, reynolds, beds["group"], WINDOWS):
        # measured beside every answer of the range
        density = [beds.loc[part.index, "density_ratio"] for part in window.parts]
        yield {
            "medium": LIQUID,
            **_range("reynolds", *window.span),
            **_range("density_ratio", max(map(min, density)), min(map(max, density))),
            **_range("cohesion_n_m", 0.0, 0.0),
            **found._asdict(),
        }


def _of_air(beds: pd.DataFrame, answers: Sequence["pd.Series[float]"]) -> Row:
    """The interval of some answers in air."""
    ratios, reynolds = _beside(beds, answers)
    # each site, and the formula, is left out once
    ((_, found),) = calibrated(ratios, reynolds, beds["group"], [IN_AIR], fewest=2)
    return {
        "medium": GAS,
        **_range("reynolds", *IN_AIR),
        **_range("density_ratio", *AIR_OF_QUARTZ),
        **_range("cohesion_n_m", 0.0, MOST_COHESION),
        **found._asdict(),
    }


def _beside(
    beds: pd.DataFrame, answers: Sequence["pd.Series[float]"]
) -> tuple[Ratios, Ratios]:
    """Measured thresholds over each answer, where there is one, and its Re*."""
    ratios, reynolds = [], []
    for answer in answers:
        value = answer[beds.index].dropna()
        ratios.append(beds["measured"][value.index] / value)
        reynolds.append(np.sqrt(value) * beds["galileo"][value.index])
    return ratios, reynolds


def of_strips(rows: pd.DataFrame, strip: Scene) -> pd.DataFrame:
    """The intervals of strips, by the fields of a strip and the model's Re*.

    `rows` are those of `compared`, `strip` is one of the strips that they were answered on.
    """
    flumes = rows[rows["set"].isin(FLUMES)]
    made: list[Row] = []
    of_strips = [each for each in MODELS if each.is_of_strips and each.name != PAPER]
    for model, law in itertools.product(of_strips, OF_SUSTAINED):
        gusts = {"intensity": INTENSITY, "events": EVENTS} if model.gust > 1 else None
        scene = changed(strip, {**model.fields, "forces.law": law, "flow.gusts": gusts})
        beds = flumes[flumes["model"] == model.name]
        beds = beds.assign(
            density_ratio=beds["rho_sol_kg_m3"] / beds["rho_f_kg_m3"],
            group=beds["set"] + ", " + beds["source"],
        )
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
