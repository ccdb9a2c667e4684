"""Speed against height over a few places of a bed line whose flow is solved."""

from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator.bed.line import BedLine
from orchestrator.digits import FORMAT
from orchestrator.flow.foam import SolvedFlow

PROFILES = "profiles.csv"
UPSTREAM = "upstream"
HIGHEST = 5.0
"""Height over the bed up to which profiles are kept, h: all that a form disturbs."""
LEVEL = 0.01
"""Height over the lowest bed behind the crest at which its lee ends, h."""


def places(line: BedLine) -> dict[str, float]:
    """Find the places of a bed line over which profiles are kept.

    Parameters
    ----------
    line
        The bed line, m.

    Returns
    -------
    dict of str to float
        Places along x, m, by their names: the toe of the first form, the highest
        crest, and the lee, where the bed behind the crest first is level. None if the
        bed is level.

    Examples
    --------
    >>> from orchestrator.bed.line import triangle
    >>> for name, x in places(triangle(45.0, 1.0)).items():
    ...     print(f"{name} {x:.3g}")
    toe 0
    crest 1
    lee 2
    """
    heights = np.asarray(line.z)
    if np.ptp(heights) < LEVEL * line.h:
        return {}
    behind = heights[line.top :]
    is_level = behind < behind.min() + LEVEL * line.h
    lee = line.x[line.top + int(np.argmax(is_level))]
    return {"toe": 0.0, "crest": float(line.crest[0]), "lee": float(lee)}


def profiles(flow: SolvedFlow, line: BedLine) -> pd.DataFrame:
    """Read the speed over the places of a bed line.

    Parameters
    ----------
    flow
        The solved flow over it.
    line
        The bed line, m.

    Returns
    -------
    DataFrame
        A row for each place and height: ``place``, ``x_m``, ``height_m`` over the bed
        and the downstream speed ``u_m_s``. Those upstream are of the column before the
        inlet, at the middles of its cells; the others are interpolated to the same
        heights.
    """
    middles = flow.column(line)
    x, heights = middles[0, 0], middles[:, 2] - line.height(middles[:, 0])
    heights = heights[heights < HIGHEST * line.h]
    found = {UPSTREAM: float(x), **places(line)}
    above = np.tile(heights, (len(found), 1))
    speeds = flow.at("U", np.array([*found.values()]), above, line)[:, 0]
    return pd.DataFrame(
        {
            "place": np.repeat([*found], len(heights)),
            "x_m": np.repeat([*found.values()], len(heights)),
            "height_m": above.ravel(),
            "u_m_s": speeds,
        }
    )


def write_profiles(table: pd.DataFrame, path: Path) -> None:
    """Write a table of `profiles`.

    Parameters
    ----------
    table
        The table.
    path
        The file.
    """
    table.to_csv(path, index=False, lineterminator="\n", float_format=FORMAT)
