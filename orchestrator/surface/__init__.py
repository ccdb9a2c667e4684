"""Beds in three dimensions: heights, mesh, flow, stress and thresholds."""

import warnings
from argparse import Namespace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from orchestrator.errors import InputError
from orchestrator.guests import Offer
from orchestrator.study.hints import HINTS

if TYPE_CHECKING:
    from orchestrator.experiment import Experiment

TRUTH = ("ridge", "turn", "interval", "piles", "askervein")
"""Comparisons of flows over beds in three dimensions."""
COMMANDS = {
    "study": "orchestrator.surface.pipeline",
    "erosion": "orchestrator.surface.erosion",
}
"""Commands on beds in three dimensions, and the modules of their experiments."""


def take_over(options: Namespace) -> int | None:
    """Take over a command on a study file of beds in three dimensions.

    Parameters
    ----------
    options
        The options of the command, with its name and its study file.

    Returns
    -------
    int or None
        The exit code; None for other beds and commands.

    Raises
    ------
    InputError
        If the study file is refused, or an option that such beds do not have is given.
    """
    if options.command not in COMMANDS:
        return None
    from orchestrator.surface import study as surface_study

    study = surface_study.load(options.source)
    if study is None:
        return None
    for name in ("cluster", "tolerance"):
        if getattr(options, name, None) is not None:
            what = "a bed in three dimensions has none"
            raise InputError(what, f"--{name}", "leave it out")
    for question in study.questions:
        warnings.warn(question, stacklevel=1)
    module = import_module(COMMANDS[options.command])
    name = study.name if options.command == "study" else options.command
    out = options.out or Path("results") / name
    experiment: Experiment = module.experiment(study)
    return experiment.command(options, out)


def _hint(table: str, name: str) -> tuple[str, str] | None:
    """Say that a key of a study file is one of beds in three dimensions."""
    from orchestrator.surface.study import TABLES

    part = TABLES.get(table)
    if part is None or name not in part.model_fields:
        return None
    remedy = 'leave it out, or bed.kind = "surface"'
    return "beds in three dimensions alone have it", remedy


HINTS.append(_hint)
OFFER = Offer(take_over=take_over)
