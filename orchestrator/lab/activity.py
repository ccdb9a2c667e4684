"""Saltation in gusts: the time that sand moves, by both thresholds, beside the field.

The stress of the wind is log-normal about its mean. Sand that lies starts at one stress
and stops at another, lower one. How long it moves then follows from both, with nothing
else: a stress that changes without jumps has crossed one of them last.
"""

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import erfi, ndtr

from orchestrator.physics.beside import SUSTAINED
from orchestrator.physics.cessation import cessation
from orchestrator.physics.grain import Grain
from orchestrator.physics.measured import MEASURED_BEDS
from orchestrator.physics.onset import of_grains
from orchestrator.report.page import Paragraphs, Section, Table
from orchestrator.types import FloatArray

FOLDER = Path(__file__).with_name("measured")
"""The measurements: of R. L. Martin and J. F. Kok, 2018, doi:10.1029/2017JF004416, as
their repository has them, in windows of 30 minutes that are binned by u*."""
INTENSITY = 0.4
"""Standard deviation of the stress over its mean, as in all gusts here."""
BEYOND = 8.0
"""Standard deviations from the median beyond which a stress does not occur."""
STEPS = 401
"""Points of the integral over the stresses between both thresholds."""
CHANGING = (0.02, 0.98)
"""Measured activities between which they are compared: below and above all agree."""
LAW = "bridged-gravel"
"""Force law of the thresholds of the model, that of `threshold`'s default."""


def active_fraction(
    mean: ArrayLike, stops: ArrayLike, starts: ArrayLike, intensity: float = INTENSITY
) -> FloatArray:
    """Find the part of the time in which sand moves in a gusty wind.

    Sand moves above both thresholds, and lies below both. Between them it moves if the
    stress came from above: of a stationary process whose logarithm is an
    Ornstein-Uhlenbeck process, this has the probability (S(z) - S(a))/(S(b) - S(a)),
    where S is its scale function, the integral of exp(z^2/2). No time is in it.

    Parameters
    ----------
    mean
        Mean stress, Pa.
    stops, starts
        Stress below which moving sand stops, and that at which lying sand starts, Pa.
    intensity
        Standard deviation of the stress over its mean.

    Returns
    -------
    ndarray
        Parts from 0 to 1, of the broadcast shape.

    Examples
    --------
    >>> print(active_fraction([0.05, 0.12, 0.3], 0.085, 0.133).round(2))
    [0.01 0.55 1.  ]
    """
    mean, stops, starts = np.broadcast_arrays(mean, stops, starts)
    sigma = np.sqrt(np.log1p(intensity**2))
    low, high = (
        np.clip((np.log(end / mean) + sigma**2 / 2) / sigma, -BEYOND, BEYOND)
        for end in (stops, starts)
    )
    z = np.linspace(low, high, STEPS)
    scale = erfi(z / np.sqrt(2))
    width = scale[-1] - scale[0]
    # where both thresholds are beyond all stresses nothing is between them
    from_above = (scale - scale[0]) / np.where(width > 0, width, 1.0)
    density = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi)
    between = np.trapezoid(from_above * density, z, axis=0)
    return np.asarray(ndtr(-high) + between)


def compare_activity() -> pd.DataFrame:
    """Compare the measured activity at three sites with that of both thresholds.

    Returns
    -------
    DataFrame
        A row for each bin of each site: u*, stress, the measured part of the time, and
        that by the measured thresholds and by those of the model, with the thresholds,
        Pa.
    """
    rows = pd.read_csv(FOLDER / "activity.csv")
    grains = Grain(
        diameter=rows["d_m"],
        density=rows["rho_sol_kg_m3"],
        fluid_density=rows["rho_f_kg_m3"],
        viscosity=rows["nu_m2_s"],
        entrainment_angle_deg=60.0,
    )
    of_site = _measured_thresholds().loc[rows["site"]]
    # in gusts that are followed one by one, a threshold is that of a steady stress
    by_model = {
        "stops": cessation(grains),
        "starts": of_grains(grains, LAW, SUSTAINED, gust=1.0).shields,
    }
    stress = rows["rho_f_kg_m3"] * rows["ustar_m_s"] ** 2
    unit = stress.to_numpy() / grains.shields(rows["ustar_m_s"])
    made = pd.DataFrame(
        {
            "site": rows["site"],
            "ustar_m_s": rows["ustar_m_s"],
            "stress_pa": stress,
            "windows": rows["windows"],
            "measured": rows["active"],
        }
    )
    for name, thresholds in (("measured", of_site), ("model", by_model)):
        stops, starts = (
            np.asarray(thresholds[end]) * unit for end in ("stops", "starts")
        )
        made[f"by_{name}_thresholds"] = active_fraction(stress, stops, starts)
        made[f"{name}_stops_pa"], made[f"{name}_starts_pa"] = stops, starts
    return made


def _measured_thresholds() -> pd.DataFrame:
    """Shields numbers at which motion stops and starts at each site."""
    found = {}
    for end, file in (("stops", FOLDER / "cessation.csv"), ("starts", MEASURED_BEDS)):
        rows = pd.read_csv(file)
        field = rows[rows["source"].str.startswith("Martin and Kok 2018: ")]
        sites = field["source"].str.removeprefix("Martin and Kok 2018: ")
        found[end] = field["shields"].set_axis(sites)
    return pd.DataFrame(found)


def half_active(rows: pd.DataFrame, column: str) -> float:
    """Find the mean stress at which sand moves half of the time.

    Parameters
    ----------
    rows
        Rows of one site, as of `compare_activity`.
    column
        The column of the activity.

    Returns
    -------
    float
        Stress, Pa, between bins in proportion.
    """
    rows = rows.sort_values("stress_pa")
    return float(np.interp(0.5, rows[column], rows["stress_pa"]))


def activity_summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Say by site at which stress sand moves half of the time, and how far it is off.

    Parameters
    ----------
    rows
        As of `compare_activity`.

    Returns
    -------
    DataFrame
        A row for each site and kind of thresholds: both thresholds and the stresses of
        half activity, Pa, and the mean difference and its root mean square over the
        bins in which the activity changes.
    """
    made = []
    for site, part in rows.groupby("site", sort=False):
        changing = part[part["measured"].between(*CHANGING)]
        for name in ("measured", "model"):
            column = f"by_{name}_thresholds"
            off = changing[column] - changing["measured"]
            made.append(
                {
                    "site": site,
                    "thresholds": name,
                    "stops_pa": part[f"{name}_stops_pa"].iloc[0],
                    "starts_pa": part[f"{name}_starts_pa"].iloc[0],
                    "half_active_measured_pa": half_active(part, "measured"),
                    "half_active_pa": half_active(part, column),
                    "bins": len(off),
                    "mean_difference": off.mean(),
                    "rms_difference": np.sqrt((off**2).mean()),
                }
            )
    return pd.DataFrame(made)


TEXT = f"""\
The part of the time in which sand saltates, in windows of 30 minutes at three sites \
(Martin and Kok 2018), beside that of a log-normal stress of intensity {INTENSITY:g} \
with two thresholds: sand starts at one and stops at the other. It is made with the \
thresholds that were measured at the site, and with those of the model under a steady \
stress. Nothing is fitted, and no time is in it."""


def activity_section(rows: pd.DataFrame) -> Section:
    """Make the section of the page.

    Parameters
    ----------
    rows
        As of `compare_activity`.

    Returns
    -------
    Section
        The text and the table of `activity_summary`.
    """
    return Section(
        "Time in motion", [Paragraphs(TEXT, "lead"), Table.of(activity_summary(rows))]
    )
