"""One scene of a pack: what a solver is given, what it is asked, what is expected of it."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.study import fields
from orchestrator.study.scene import Scene

SCHEMA = 1
"""Version of the exchange format, ``docs/benchmark.md``."""
SCENE = "scene.json"
ASK = "ask.csv"
NUMBER = "%.9g"
"""Format of the numbers in all tables of a pack."""
EXPECTED = ("quantity", "at", "value", "low", "high", "tolerance", "ours")
Row = dict[str, Any]


@dataclass(frozen=True)
class Problem:
    """A scene at a level.

    Attributes
    ----------
    level : int
        1 to 5.
    name : str
        Name of the scene, unique among those of its level.
    kind : str
        What is to be solved.
    parameters : mapping
        Numbers and words, SI units in their names.
    tables : mapping of str to DataFrame
        What lies beside them, by the stem of the file's name.
    expected : DataFrame
        Columns `EXPECTED`, a row for each number that is asked; `at` is a text.
    seconds : float
        What our answer took, s; NaN if it is not known.
    """

    level: int
    name: str
    kind: str
    parameters: Mapping[str, Any]
    tables: Mapping[str, pd.DataFrame]
    expected: pd.DataFrame
    seconds: float = float("nan")

    @property
    def scene(self) -> str:
        """Name of its directory."""
        return f"{self.level}-{self.name}"

    def write(self, folder: Path) -> None:
        """Write what a solver is given."""
        folder.mkdir(parents=True)
        head = {"schema": SCHEMA, "scene": self.scene, "level": self.level, "kind": self.kind}
        text = json.dumps({**head, **self.parameters}, indent=1, allow_nan=False)
        (folder / SCENE).write_text(text + "\n", encoding="utf-8")
        for stem, table in {**self.tables, "ask": self.expected[["quantity", "at"]]}.items():
            (folder / f"{stem}.csv").write_text(csv(table), encoding="utf-8")


def csv(table: pd.DataFrame) -> str:
    """The text of a table; a pack has thousands, and pandas takes a millisecond for each."""
    columns = [_texts(table[name]) for name in table]
    rows = map(",".join, zip(*columns, strict=True))
    return "\n".join([",".join(map(str, table)), *rows, ""])


def _texts(column: "pd.Series[Any]") -> list[str]:
    values = column.tolist()
    if column.dtype == float:
        return [NUMBER % value if value == value else "" for value in values]
    if column.dtype == object:  # numbers and words, whatever a scene has
        return ["" if v != v else NUMBER % v if isinstance(v, float) else str(v) for v in values]
    return [str(value) for value in values]


def place(value: float) -> str:
    """The text of an `at`."""
    return NUMBER % value


def expected(
    quantity: str,
    at: str,
    value: float,
    interval: tuple[float, float],
    tolerance: float,
    ours: float,
) -> Row:
    """One expectation; a tolerance of NaN is not judged."""
    return dict(zip(EXPECTED, (quantity, at, value, *interval, tolerance, ours), strict=True))


def exact(quantity: str, value: float, tolerance: float, at: str = "", ours: float = np.nan) -> Row:
    """Expectation of a number that a formula gives."""
    return expected(quantity, at, value, (value, value), tolerance, ours)


def expectations(rows: Iterable[Row]) -> pd.DataFrame:
    """The table of some rows."""
    return pd.DataFrame(list(rows), columns=list(EXPECTED))


_CONTACT = ("phi_deg", "stiffness", "damping", "spring_n_m", "time_unit_s", "time_step")
_PROTOCOL = ("displacement_criterion", "waiting_time", "load_increment")
_SOURCE = ("averaging_length", "loaded_grains", "mobile_layers", "turbulence_model")
_NUMERICS = (
    "expansion_ratio",
    # the domain is told by its bed line and height
    *("lid", "upstream", "downstream"),
    "convection_scheme",
    "non_orthogonal_correctors",
    "method",
    "z0_over_d",
    "bed",
)
_SOLVED = ("solve_u_e_m_s", "solve_z0_m", "solve_nu_m2_s", "first_cell_m", "cells_per_face")
MEANINGLESS: Mapping[str, frozenset[str]] = {
    "closed-form": frozenset({*_CONTACT, *_PROTOCOL, *_NUMERICS}),
    "pivot": frozenset(_NUMERICS),
    "pile": frozenset({*_SOURCE, *_SOLVED, *_NUMERICS}),
    # its speed at the lid is told as that of level 3
    "line": frozenset({*_NUMERICS, "solve_u_e_m_s"}),
}
"""Parameters of a scene without effect on a kind; all others are told."""


SHAPES = frozenset(
    {
        *("sizes", "poured_depth", "width", "exposure"),
        *("bed_shape", "windward", "lee_slope_deg", "brink_radius", "length", "forms", "spacing"),
        *("profile", "smoothing", "obstacles", "counted"),
        *("flow_top", "depth_m"),
    }
)
"""Parameters that the bed, its line, the stress and the forces follow from: packs have the results,
and ask for the flow of boundary layers alone."""


def parameters(scene: Scene, kind: str) -> dict[str, Any]:
    """Parameters of a scene in a pack, with its force law decided, as a problem of a kind."""
    grain = scene.grain
    told = fields.used(scene) | mechanics(
        grain.diameter, grain.density, scene.reduced_gravity, scene.weight, grain.stiffness
    )
    hidden = MEANINGLESS[kind] | SHAPES
    return {name: value for name, value in told.items() if value is not None and name not in hidden}


def mechanics(
    diameter: float, density: float, gravity: float, weight: float, stiffness: float
) -> dict[str, float]:
    """The mechanics of a grain in SI units; gravity is that of the submerged grain."""
    return {
        "mass_kg": density * np.pi / 6 * diameter**3,
        "reduced_gravity_m_s2": gravity,
        "weight_n": weight,
        "spring_n_m": stiffness * weight / diameter,
        "time_unit_s": float(np.sqrt(diameter / gravity)),
    }
