"""What was measured of the rungs: their numerical errors, and over which scenes.

`orchestrator ladder` writes two tables, ``errors.csv`` and ``domain.csv``. Those of the
package lie in ``calibration/``; `use` takes those of another directory.

A row of ``errors.csv`` has the error of a rung for the flow or the grains, on a class
of scenes, at a fraction of the grains:

====================== =================================================================
``part``               ``flow`` or ``grains``
``rung``               the rung, by its name
``scene_class``        the class of scenes, by `orchestrator.fidelity.classes`
``fraction``           fraction n/N of the counted grains
``error``              half width of tau_c, relative, that holds the share `confidence`
``confidence``         0.95, or 0.9 where fewer than 19 scenes were measured
``coverage``           share of the scenes within the half width of all other geometries
``scenes``             how many scenes that is: those of all classes that it pools
``pool``               these classes
``uncertainty``        the same half width, for how far the reference itself moved
``uncertainty_scenes`` on how many scenes that was tried; 0 where it was not run
``cost_core_s``        mean processor time of one scene
====================== =================================================================

What was not run is empty.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from orchestrator.digits import percent

FOLDER = Path(__file__).with_name("calibration")
"""What was measured for the package."""
LEAST_SCENES = 10
"""Scenes from which on an error of the package is known; of another directory one is
enough, and `Error.confidence` says what so few can hold."""
Key = tuple[str, str, str]
"""A part, a rung and a class of scenes."""
_used = [FOLDER]


def use(folder: Path) -> None:
    """Take the errors that were measured elsewhere, for this process.

    Parameters
    ----------
    folder
        A directory with ``errors.csv`` and ``domain.csv``.
    """
    _used[0] = folder


def folder() -> Path:
    """Find the directory of the errors that are used.

    Returns
    -------
    Path
        The directory.
    """
    return _used[0]


class Error(NamedTuple):
    """Numerical error of tau_c against the reference, at one fraction, relative.

    Attributes
    ----------
    error
        Half width that holds the share `confidence` of the scenes.
    uncertainty
        The same for how far the reference itself moved when its own numbers were
        changed; None where that was not tried.
    confidence
        The share that the half width is to hold.
    coverage
        The share that it held, of scenes of geometries that it was not found from.
    scenes
        How many scenes these are; None of an error that was not measured.
    """

    error: float
    uncertainty: float | None
    confidence: float = math.nan
    coverage: float = math.nan
    scenes: int | None = None

    @property
    def total(self) -> float:
        """Error and known uncertainty: the root of the sum of their squares."""
        return math.hypot(self.error, self.uncertainty or 0.0)

    def __str__(self) -> str:
        if self.scenes is None or math.isnan(self.coverage):
            return f"within {percent(self.total, 1)}"
        held = f"{percent(self.coverage)} of {self.scenes}"
        if self.confidence < 0.95:
            held += f", for {percent(self.confidence)} since these are few"
        return f"within {percent(self.total, 1)}: {held}"


NOTHING = Error(math.inf, math.inf)
"""The error of what was not measured."""


class Measured(NamedTuple):
    """The measured errors of a rung on a class of scenes.

    Attributes
    ----------
    fractions
        Fractions n/N at which they were measured, from the least.
    errors
        The error at each of them.
    """

    fractions: tuple[float, ...]
    errors: tuple[Error, ...]

    def at(self, fraction: float) -> Error:
        """Find the error at a fraction; between two that were measured, the larger.

        Parameters
        ----------
        fraction
            Fraction n/N, of those measured or between them.

        Returns
        -------
        Error
            The error.
        """
        index = float(np.interp(fraction, self.fractions, range(len(self.fractions))))
        beside = {math.floor(index), math.ceil(index)}
        return max((self.errors[i] for i in beside), key=lambda one: one.total)


def together(parts: tuple[Error, ...]) -> Error:
    """Put the errors of flow and grains together, which add up by their squares.

    Parameters
    ----------
    parts
        The errors.

    Returns
    -------
    Error
        The error, with the least coverage of the parts and the fewest scenes. Without
        parts it is zero: the closed form over a level bed is exact.
    """
    if not parts:
        return Error(0.0, 0.0)
    tried = [one.uncertainty for one in parts if one.uncertainty is not None]
    uncertainty = math.hypot(*tried) if tried else None
    counts = [one.scenes for one in parts if one.scenes is not None]
    return Error(
        math.hypot(*(one.error for one in parts)),
        uncertainty,
        min(one.confidence for one in parts),
        float(np.min([one.coverage for one in parts])),
        min(counts, default=None),
    )


def errors() -> Mapping[Key, Measured]:
    """Read the measured errors, by part, name of the rung and class of scenes.

    What fewer than `LEAST_SCENES` scenes of the package say is left out: a class, or an
    uncertainty, which is None then. Without it nobody knows what the reference is
    worth: of grains nothing is known of the class, of the flow nothing of the
    reference.

    Returns
    -------
    dict
        The errors.
    """
    return _errors(folder())


@cache
def _errors(directory: Path) -> Mapping[Key, Measured]:
    table = pd.read_csv(directory / "errors.csv").sort_values("fraction")
    # who measures his own scenes knows how few they are
    least = LEAST_SCENES if directory == FOLDER else 1
    is_tried = table["uncertainty_scenes"] >= least
    is_known = table["scenes"] >= least
    is_bare = ~is_tried & (table["part"].eq("grains") | table["rung"].eq("reference"))
    found: dict[Key, tuple[list[float], list[Error]]] = {}
    left_out = set()
    rows = table.assign(is_out=is_bare | ~is_known, is_tried=is_tried)
    for row in rows.to_dict("records"):
        key = (str(row["part"]), str(row["rung"]), str(row["scene_class"]))
        if row["is_out"]:
            left_out.add(key)
            continue
        fractions, errors_ = found.setdefault(key, ([], []))
        fractions.append(row["fraction"])
        errors_.append(
            Error(
                row["error"],
                row["uncertainty"] if row["is_tried"] else None,
                row["confidence"],
                row["coverage"],
                int(row["scenes"]),
            )
        )
    return {
        key: Measured(tuple(fractions), tuple(errors_))
        for key, (fractions, errors_) in found.items()
        if key not in left_out
    }


class Spanned(NamedTuple):
    """The values of a quantity of which errors were measured.

    Attributes
    ----------
    least, most
        Ends of its numbers; an end that is open is infinite, and without numbers the
        least is above the most.
    words
        Its words.
    """

    least: float
    most: float
    words: tuple[str, ...]


def domain() -> Mapping[Key, Spanned]:
    """Read over which scenes the errors were measured.

    Returns
    -------
    dict
        The values, by part, class of scenes and quantity.
    """
    return _domain(folder())


@cache
def _domain(directory: Path) -> Mapping[Key, Spanned]:
    path = directory / "domain.csv"
    table = pd.read_csv(path, keep_default_na=False, na_values=[""])
    found: dict[Key, Spanned] = {}
    for row in table.to_dict("records"):
        key = (str(row["part"]), str(row["scene_class"]), str(row["quantity"]))
        least, most, words = found.get(key, Spanned(math.inf, -math.inf, ()))
        if isinstance(row["word"], str):
            words = (*words, row["word"])
        else:
            least = row["least"]
            most = math.inf if math.isnan(row["most"]) else row["most"]
        found[key] = Spanned(least, most, words)
    return found
