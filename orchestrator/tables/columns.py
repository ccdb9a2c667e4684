"""The columns of tables: their names, which end with SI units, and what they are.

Each maker of a table has the columns that it makes in a mapping of its own, above it,
in their order. Here is what several tables have, and what a table is.
"""

from collections.abc import Mapping
from typing import NamedTuple

from orchestrator.study import fields

SEVERAL: Mapping[str, str] = {
    "scene_id": "digest of the scene's parameters",
    "case": (
        "directory of the case, below cases/; empty where no grains were run: by the "
        "closed form, pivots and peeling"
    ),
    "flow_case": (
        "directory of the flow's case, below cases/; of a flow that lies between "
        "others those of these"
    ),
    "reynolds": "friction Reynolds number u* d/nu at the threshold",
    "shields": "Shields number at the threshold, tau_c/((rho_sol - rho_f) g d)",
    "shields_dem": (
        "Shields number at the threshold by DEM, tau_c/((rho_sol - rho_f) g d)"
    ),
    "shields_dem_low": (
        "lower end of the interval of shields_dem: load step and count; in the table "
        "check without the numerical error of DEM, which that of the answer holds"
    ),
    "shields_dem_high": "upper end of the interval of shields_dem: load step and count",
    "shields_numerical_low": (
        "lower end of the numerical interval of shields: load increment, count, "
        "scatter, numerical error; empty where no error is known; of a fraction that "
        "was not reached, above the last flow"
    ),
    "shields_numerical_high": (
        "upper end of the numerical interval of shields; empty where no error is "
        "known, and where the interval is open: beside a lower end"
    ),
    "s_m": "arc length along the bed line from the windward toe",
    "x_m": "distance along the flow from the windward toe; of a profile x of its file",
    "u_e_m_s": "speed of the approaching flow 10 h above the flat bed",
    "ustar0_m_s": (
        "undisturbed friction velocity at the threshold, at the motion of a grain, or "
        "in a load step"
    ),
    "count": (
        "N, counted grains: the exposed grains of the part of the bed that bed.counted "
        "names; by the method local places at equal distances, so that n/N is a part "
        "of the counted length"
    ),
    "moved": (
        "n, grains that had moved: passed the displacement criterion downstream, or "
        "were carried off"
    ),
    "carried_off": (
        "of the grains that had moved, those that lift took off the bed before they "
        "passed the displacement criterion; in pile_grain: 1 if that happened to the "
        "grain, else 0"
    ),
    "fraction": "n/N at which the threshold is read; empty of the first motion",
    "fraction_moved": "n/N, moved over counted grains",
    "size_over_d": "diameter of the grain over d; of a size class the geometric mean",
    "decides": (
        "criterion that holds the grain, or most of the counted grains, longer: "
        "entrained or sustained"
    ),
}
"""Columns that several makers have, with their meanings."""


class Listed(NamedTuple):
    """A table of a study.

    Attributes
    ----------
    row
        What a row of it is.
    made
        The columns of each of its makers, with their meanings.
    """

    row: str
    made: tuple[Mapping[str, str], ...]

    @property
    def columns(self) -> dict[str, str]:
        """All columns that it may have, with their meanings."""
        return {name: text for part in self.made for name, text in part.items()}


def several(*names: str) -> dict[str, str]:
    """Look up columns that several tables have.

    Parameters
    ----------
    *names
        Their names.

    Returns
    -------
    dict of str to str
        Their meanings, by name.
    """
    return {name: SEVERAL[name] for name in names}


def phrases(*names: str) -> dict[str, str]:
    """Look up columns that are fields of a study file.

    Parameters
    ----------
    *names
        Their names.

    Returns
    -------
    dict of str to str
        Their meanings, by name.
    """
    return {name: fields.COLUMNS[name].phrase for name in names}
