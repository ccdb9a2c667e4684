"""Which metres of a bed are counted, and which range of x has its form alone."""

import math

import numpy as np
import pandas as pd

from orchestrator.report.subjects import digits_of_place, length, place_of_file
from orchestrator.study.parts import PileBed
from orchestrator.study.profile import Profile

APART = 5.0
"""Two neighbours this many times the middle distance apart are of two stretches."""
ROUND = 1e-6
"""Part of the last digit by which a number is that digit."""
MOST = 3
"""Stretches that are named each; of more the number is told."""


def metres_of_place(x: pd.Series, bed: PileBed) -> str:
    """Say which metres of a bed are counted.

    Parameters
    ----------
    x
        Where its counted grains or places are, m, in any order.
    bed
        The bed.

    Returns
    -------
    str
        The stretches of x, of many their number and their length; empty without
        grains.
    """
    places = np.sort(x.to_numpy(float))
    if not len(places):
        return ""
    steps = np.diff(places)
    middle = float(np.median(steps)) if len(steps) else 0.0
    last = [*np.flatnonzero(steps > APART * middle).tolist(), len(places) - 1]
    first = [0, *(place + 1 for place in last[:-1])]
    stretches = [
        (float(places[start]), float(places[end]))
        for start, end in zip(first, last, strict=True)
    ]
    if len(stretches) <= MOST:
        named = [f"{place(a, bed)} to {place(b, bed)}" for a, b in stretches]
        return f"x = {' and '.join(named)} m"
    whole = length(sum(end - start for start, end in stretches))
    ends = f"{place(places[0], bed)} and {place(places[-1], bed)} m"
    return f"{whole} in {len(stretches)} stretches between x = {ends}"


def place(x: float, bed: PileBed) -> str:
    """Write x as the user has it, with the digits that matter.

    Parameters
    ----------
    x
        The place, m.
    bed
        The bed.

    Returns
    -------
    str
        The number.
    """
    return place_of_file(x, bed.profile) if bed.profile else f"{x:.4g}"


def spot(x: float, bed: PileBed) -> str:
    """Say where a grain of a bed lies.

    Parameters
    ----------
    x
        Its place as the user has it, m.
    bed
        The bed.

    Returns
    -------
    str
        On a profile its x in the file, else its distance from the toe of the form.
    """
    if bed.profile:
        return f"at x = {place(x, bed)} m"
    return f"at {length(x)}"


def way_up(profile: Profile) -> tuple[str, str] | None:
    """Find the range of x from the toe of the form of a profile to its crest.

    The toe is where the line lies lowest under the straight one from its first point
    to its top.

    Returns
    -------
    tuple of str or None
        The ends as `bed.counted` takes them, of which the smaller x is first, within
        the profile; None where the first point is the highest.
    """
    x = np.array(profile.x)
    z = np.array(profile.z)
    top = int(np.argmax(z))
    if top == 0:
        return None
    straight = np.interp(x[: top + 1], x[[0, top]], z[[0, top]])
    foot = int(np.argmax(straight - z[: top + 1]))
    low, high = sorted(profile.place(x[[foot, top]]).tolist())
    # rounded into the form: an end must not fall off the profile
    digits = digits_of_place(profile)
    scale = 10.0**digits
    low = math.ceil(low * scale - ROUND) / scale
    high = math.floor(high * scale + ROUND) / scale
    return f"{low:.{digits}f}", f"{high:.{digits}f}"
