"""Places of a dune, the winds at which their sand moves, and the hours of these winds.

The beach is the ground before the toe. Foot, slope and brink are the windward side by
its height. Each place has its winds in which a tenth and half of it move; the hours of
the year follow from a table of winds.
"""

import sys
import warnings
from argparse import Namespace
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator import pipeline, tables
from orchestrator.digits import FORMAT
from orchestrator.errors import InputError
from orchestrator.grains.places import PARTS, PLACES_IN_WORDS, places_of
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.velocity import log_law_speed, outer_roughness
from orchestrator.report import labels, lines
from orchestrator.report.results import Results
from orchestrator.runs.workspace import Workspace
from orchestrator.study.parts import PileBed
from orchestrator.study.source import decoded, read_bytes
from orchestrator.study.wind import Winds, question_of, read_winds
from orchestrator.types import FloatArray

HOURS = 8760.0
"""Hours of a year."""
USUAL_HEIGHT = 10.0
"""Height of an anemometer whose file says none, m."""
LARGEST_WINDS = 2**26
"""Most bytes of a file of winds."""
WITHIN_DEG = 45.0
"""Angle from the direction of the study up to which a wind is taken to be along it."""
ENDINGS = ("", "_low", "_high")
"""Of the columns of a number and of the ends of its interval."""


def hours_above(winds: Winds, from_deg: float, speed: float) -> float:
    """Count the hours a year with a wind along a direction, of a speed and more.

    Parameters
    ----------
    winds
        The winds.
    from_deg
        The direction, degrees; winds within `WITHIN_DEG` of it count.
    speed
        The speed at the height of the winds, m/s.

    Returns
    -------
    float
        The hours.

    Examples
    --------
    >>> rows = ((270.0, 8.0, 0.1), (300.0, 6.0, 0.2), (90.0, 9.0, 0.7))
    >>> hours_above(Winds(rows, 10.0, ""), 270.0, 7.0)
    876.0
    """
    away, speeds, share = _along(winds, from_deg)
    counts = (away <= WITHIN_DEG) & (speeds >= speed) & (speeds > 0)
    return float(HOURS * share[counts].sum())


def _along(winds: Winds, from_deg: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angles from a direction, speeds and shares of some winds."""
    directions, speeds, share = np.array(winds.rows).T
    away = np.abs((directions - from_deg + 180) % 360 - 180)
    return away, speeds, share


def run_hours(options: Namespace) -> int:
    """Print the hours a year by place of a finished study.

    Parameters
    ----------
    options
        The options of the command.

    Returns
    -------
    int
        The exit code.

    Raises
    ------
    InputError
        If the study has no such beds, or the winds cannot be read.
    """
    results = _results(options.directory)
    path: Path = options.wind
    where = f"--wind {path}"
    content = read_bytes(path, LARGEST_WINDS, where)
    winds = read_winds(decoded(content, where, is_data=True), where)
    asked = question_of(winds.rows, path.name)
    if asked:
        warnings.warn(asked, stacklevel=2)
    if not -360 <= options.from_deg <= 360:
        what = f"{options.from_deg:g} is no direction"
        raise InputError(what, "--from", "degrees from north over east, 0 to 360")
    given = options.ground_roughness
    if given is not None and not 0 < given <= 2:
        what = f"{given:g} is no length above 0 and up to 2 m"
        raise InputError(what, "--ground-roughness", "give z0 in m")
    rows = pd.DataFrame(_rows(results, winds, options.from_deg % 360, given))
    if options.csv:
        rows.to_csv(sys.stdout, index=False, float_format=FORMAT, lineterminator="\n")
        return 0
    print("\n".join(_told(rows, winds, options.from_deg % 360, path.name)))
    return 0


def _results(directory: Path) -> Results:
    """A finished study with beds of grains in a gas."""
    space = Workspace(directory.absolute())
    study, plan = pipeline.reopen(space)
    read = tables.read_tables(space, "tables")
    results = Results(study, plan, read, space.cases)
    if "pile_grain" not in read or not plan.piles:
        remedy = "run a study of a dune, a profile or another form"
        raise InputError("the study has no bed with places", str(directory), remedy)
    if (results.joined("pile_threshold")["rho_f_kg_m3"] >= GAS_BELOW).any():
        remedy = "choose a study in air"
        raise InputError("a liquid has no winds", str(directory), remedy)
    return results


def _rows(
    results: Results, winds: Winds, from_deg: float, ground: float | None
) -> Iterator[dict[str, Any]]:
    """A row for each place of each bed."""
    every = results.at_fraction
    telling = labels.varying(every, "fraction")
    grains = results.tables["pile_grain"]
    for _, row in every.iterrows():
        scene = str(row["scene_id"])
        pile = results.plan.piles[scene]
        assert isinstance(pile.bed, PileBed)
        own = grains[grains["scene_id"] == scene]
        level = float(row["level_ustar_m_s"])
        # the interval of the threshold as the tables have it, as factors of u*
        factors = [
            float(row[f"ustar0{end}_m_s"]) / float(row["ustar0_m_s"]) for end in ENDINGS
        ]
        z0 = ground or float(pile.scene.bed.roughness)
        for place in places_of(pile, own, level, results.cases):
            made: dict[str, Any] = {
                "bed": ", ".join(labels.told(row, telling)) or "the bed",
                "scene_id": scene,
                "place": place.name,
                "length_m": float(place.length.sum()),
            }
            for part, share in PARTS.items():
                ustar = np.array(factors) * place.at(share)
                speeds = _speeds(ustar, z0, float(row["nu_m2_s"]), winds.height)
                made |= _of_part(part, speeds, winds, from_deg)
            yield {**made, "usable": bool(row["usable"]), "why_not": row["why_not"]}


def _speeds(
    ustar: FloatArray, roughness: float, viscosity: float, height: float | None
) -> FloatArray:
    """Winds at the height of the anemometer of friction velocities, m/s."""
    outer = outer_roughness(roughness, ustar, viscosity)
    speeds = log_law_speed(ustar, height or USUAL_HEIGHT, outer)
    return np.where(np.isinf(ustar), np.inf, speeds)


def _of_part(
    part: str, speeds: Sequence[float] | FloatArray, winds: Winds, from_deg: float
) -> dict[str, float]:
    """Wind and hours of a part of a place; a lower wind has more hours."""
    name = part.replace(" ", "_")
    made = {}
    for end, speed in zip(ENDINGS, speeds, strict=True):
        made[f"wind_{name}{end}_m_s"] = float(speed)
    ends = {"": speeds[0], "_low": speeds[2], "_high": speeds[1]}
    for end, speed in ends.items():
        is_known = not np.isnan(speed)
        count = hours_above(winds, from_deg, speed) if is_known else np.nan
        made[f"hours_{name}{end}"] = count
    return made


def _told(
    rows: pd.DataFrame, winds: Winds, from_deg: float, name: str
) -> Iterator[str]:
    """Lines for people."""
    away, speeds, share = _along(winds, from_deg)
    blows = speeds > 0
    along = HOURS * share[blows & (away <= WITHIN_DEG)].sum()
    others = HOURS * share[blows & (away > WITHIN_DEG)].sum()
    height = winds.height or USUAL_HEIGHT
    yield f"Hours a year in which sand moves, by the winds of {name}"
    yield winds.understood
    yield (
        f"{along:.0f} hours have wind from {from_deg:g}° ± {WITHIN_DEG:g}°, taken "
        f"along the section; {others:.0f} from elsewhere are not counted"
    )
    yield ""
    heads = ["bed", "place", "m"]
    for part in PARTS:
        heads += [f"{part} moves: wind at {height:g} m, m/s", "hours a year"]
    yield from lines.table([_cells(row) for _, row in rows.iterrows()], heads)
    yield ""
    yield f"{PLACES_IN_WORDS[:1].upper()}{PLACES_IN_WORDS[1:]}."
    bad = rows[~rows["usable"]]
    if len(bad):
        yield f"Not usable: {bad['why_not'].iloc[0]}"


def _cells(row: pd.Series) -> list[str]:
    """The cells of a place."""
    cells = [row["bed"], row["place"], f"{row['length_m']:.3g}"]
    for part in PARTS:
        name = part.replace(" ", "_")
        for column, unit, form in (("wind", "_m_s", "#.3g"), ("hours", "", ".0f")):
            numbers = [row[f"{column}_{name}{end}{unit}"] for end in ENDINGS]
            cells.append(_with_interval(*numbers, form=form))
    return cells


def _with_interval(value: float, low: float, high: float, *, form: str) -> str:
    """A number with its interval, if it has one."""
    if not np.isfinite(value):
        return "never"
    told = f"{value:{form}}"
    if np.isfinite(low) and np.isfinite(high):
        told += f" ({low:{form}} … {high:{form}})"
    return told
