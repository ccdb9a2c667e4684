"""Beds in three dimensions: heights, mesh, flow, stress and thresholds."""

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator.errors import InputError
from orchestrator.guests import Offer
from orchestrator.study.hints import HINTS

if TYPE_CHECKING:
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
OFFER = Offer(beds={"surface": _surfaces}, take_over=take_over)
