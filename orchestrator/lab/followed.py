"""Strips whose grains DEM follows, beside the closed form of one grain.

Each set of strips has two thresholds. Of a bed as it was cut it is that of its start: a
bed that is cut by the tops of its grains has none that stands out. Of a bed on which a
few grains are dropped it is that of sustained motion: grains in motion keep others
moving. ``tools/followed.py`` makes the table of load steps of a finished study.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator.digits import percent
from orchestrator.physics.grain import Grain
from orchestrator.physics.onset import Criteria, of_grains
from orchestrator.report.page import Paragraphs, Section, Table

FILE = Path(__file__).with_name("measured") / "followed.csv"
"""A row for each load step of each strip."""
PART = 0.05
"""Part of the exposed grains that keeps moving in a load step at the threshold."""
LAW, BETA_DEG = "bridged-gravel", 60.0
"""Force law and pocket of the closed form, those of `threshold`'s default."""
STRIP = ["set", "stiffness", "dropped_grains", "seed"]
"""Columns that name a strip."""
CUT, DROPPED = "start of the bed as cut", "sustained, grains dropped"
"""What the two thresholds are called."""


def stored_strips() -> pd.DataFrame:
    """Read the load steps of the strips that were run.

    Returns
    -------
    DataFrame
        A row for each load step: the strip, its Galileo number and density ratio, the
        Shields number, exposed grains, and how many of them moved by a diameter and how
        many kept moving.
    """
    return pd.read_csv(FILE)


def strip_thresholds(steps: pd.DataFrame) -> pd.DataFrame:
    """Find the threshold of each strip.

    Parameters
    ----------
    steps
        As of `stored`.

    Returns
    -------
    DataFrame
        A row for each strip: the last Shields number below and the first one from which
        `PART` of the exposed grains keeps moving in a load step, empty where none does,
        and their geometric mean.
    """
    made = []
    for key, strip in steps.groupby(STRIP, sort=False):
        rising = strip.sort_values("shields")
        shields = rising["shields"].to_numpy()
        is_kept = (rising["sustained"] >= PART * rising["exposed"]).to_numpy()
        first = int(np.argmax(is_kept)) if is_kept.any() else len(shields)
        low = shields[first - 1] if first else np.nan
        high = shields[first] if first < len(shields) else np.nan
        made.append(
            {
                **dict(zip(STRIP, key, strict=True)),
                "galileo": rising["galileo"].iloc[0],
                "density_ratio": rising["density_ratio"].iloc[0],
                "shields_low": low,
                "shields_high": high,
                "shields": np.sqrt(low * high),
            }
        )
    return pd.DataFrame(made)


def compare_strips(steps: pd.DataFrame) -> pd.DataFrame:
    """Compare both thresholds of each set of strips with the closed form of one grain.

    Parameters
    ----------
    steps
        As of `stored`.

    Returns
    -------
    DataFrame
        A row for each set, threshold and stiffness K d/W of the springs: strips, their
        median, the least and the largest Shields number; those at which one grain is
        entrained in the gust, its motion is sustained, and motion ceases; and the
        median over the larger of the first two.
    """
    made = []
    strips = strip_thresholds(steps)
    strips["threshold"] = np.where(strips["dropped_grains"] > 0, DROPPED, CUT)
    kinds = ["set", "threshold", "stiffness"]
    for key, part in strips.groupby(kinds, sort=False):
        grain = Grain.of_numbers(
            part["galileo"].iloc[:1], part["density_ratio"].iloc[:1]
        ).changed(entrainment_angle_deg=BETA_DEG)
        alone = Criteria(of_grains(grain, LAW).shields, grain)
        (closed,) = alone.shields.tolist()
        median = part["shields"].median()
        made.append(
            {
                **dict(zip(kinds, key, strict=True)),
                "strips": len(part),
                "shields": median,
                "least": part["shields"].min(),
                "largest": part["shields"].max(),
                "entrained": float(alone.entrained[0]),
                "sustained": float(alone.sustained[0]),
                "cessation": float(alone.cessation[0]),
                "over_closed_form": median / closed,
            }
        )
    return pd.DataFrame(made)


TEXT = f"""\
LIGGGHTS follows every grain of a level strip as it rolls and hops. A bed that is cut \
by the tops of its grains has none that stands out: its threshold is that at which it \
starts at once. Where a few grains are dropped on it as each gust begins, its \
threshold is that from which the motion that they begin is sustained. Both are the \
Shields number at which {percent(PART)} of the exposed grains keep moving after the \
gust. The closed form beside them is the larger of entrained and sustained, of one \
grain."""


def strips_section(compared: pd.DataFrame) -> Section:
    """Make the section of the page.

    Parameters
    ----------
    compared
        As of `compare`.

    Returns
    -------
    Section
        The text and the table.
    """
    return Section("Strips by DEM", [Paragraphs(TEXT, "lead"), Table.of(compared)])
