"""Beds in three dimensions: heights, mesh, flow, stress and thresholds."""

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator.command import Extension
from orchestrator.errors import InputError
from orchestrator.guests import Offer
from orchestrator.study.hints import HINTS

if TYPE_CHECKING:
    from orchestrator.command import Parser
    from orchestrator.study.study import Kind, Study

TRUTH = ("ridge", "turn", "interval", "piles", "askervein")
"""Comparisons of flows over beds in three dimensions."""


def take_over(study: "Study[Any]", options: Namespace) -> int | None:
    """Take over a command on a study of beds in three dimensions.

    Parameters
    ----------
    study
        The study.
    options
        The options of the command.

    Returns
    -------
    int or None
        The exit code; None for other beds and commands.

    Raises
    ------
    InputError
        If an option is given that such beds do not have.
    """
    from orchestrator.study.study import PLANE

    if study.kind is PLANE:
        # the most common answer needs nothing of this package
        return None
    from orchestrator.surface.study import SURFACES

    if study.kind is not SURFACES:
        return None
    for name in ("cluster", "tolerance"):
        if getattr(options, name, None) is not None:
            what = "a bed in three dimensions has none"
            raise InputError(what, f"--{name}", "leave it out")
    if options.command == "erosion":
        from orchestrator.surface.erosion import HeapErosion

        out = options.out or Path("results") / options.command
        return HeapErosion(study).command(options, out)
    from orchestrator.surface.pipeline import SurfaceMotion

    out = options.out or Path("results") / study.name
    return SurfaceMotion(study).command(options, out)


def _stress_options(command: "Parser") -> None:
    """Add the options of a map of the stress over the threshold."""
    group = command.add_argument_group("a map of the stress over the threshold")
    text = "raster of bed stress, GeoTIFF or .asc, as a hydraulic model writes it"
    group.add_argument("--stress", type=Path, metavar="FILE", help=text)
    text = "its unit; default: that which the file names, else Pa"
    group.add_argument("--stress-unit", metavar="UNIT", help=text)
    text = "directory of the map; default: results/stress- and the name of the file"
    group.add_argument("--out", type=Path, metavar="DIR", help=text)


def _stress_map(options: Namespace) -> int | None:
    """Map the stress over the threshold, where a raster of stress is given."""
    if options.stress is None:
        for name in ("stress_unit", "out"):
            if getattr(options, name) is not None:
                option = f"--{name.replace('_', '-')}"
                remedy = "leave it out, or name a raster: --stress FILE"
                raise InputError("there is no map without a raster", option, remedy)
        return None
    from orchestrator.surface.stress_map import run_stress_map

    return run_stress_map(options)


def _hint(table: str, name: str) -> tuple[str, str] | None:
    """Say that a key of a study file is one of beds in three dimensions."""
    from orchestrator.surface.study import TABLES

    part = TABLES.get(table)
    if part is None or name not in part.model_fields:
        return None
    remedy = 'leave it out, or bed.kind = "surface"'
    return "beds in three dimensions alone have it", remedy


def _surfaces() -> "Kind[Any]":
    """The beds in three dimensions, for the loader of studies."""
    from orchestrator.surface.study import SURFACES

    return SURFACES


HINTS.append(_hint)
OFFER = Offer(
    beds={"surface": _surfaces},
    take_over=take_over,
    threshold=Extension(_stress_options, _stress_map),
)
