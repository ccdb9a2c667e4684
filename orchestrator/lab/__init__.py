"""Measures the package: ladder, budget, convergence, maps of failure, validation."""

from argparse import Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from orchestrator.command import Command, Parser, add_run_options
from orchestrator.guests import Offer
from orchestrator.surface import TRUTH

if TYPE_CHECKING:
    from orchestrator.experiment import Experiment
    from orchestrator.study.study import Study


def _on_preset(command: Parser) -> None:
    """Add the options of a command on the preset of its own name."""
    _, _, name = command.prog.partition(" ")
    add_run_options(command, name)


def _on_own_scenes(command: Parser) -> None:
    """Add the options of a command on scenes of its own."""
    add_run_options(command, "")


def _of_validate(command: Parser) -> None:
    """Add the options of `validate`."""
    _on_preset(command)
    text = "flows over beds in three dimensions alone: all, or one comparison"
    command.add_argument("--surfaces", choices=("all", *TRUTH), help=text)


def _on_study(
    options: Namespace, experiment: "Callable[[Study, Path], Experiment]"
) -> int:
    """Run an experiment on a study."""
    from orchestrator.study.study import load

    study = load(options.source, options.tolerance)
    out = options.out or Path("results") / options.command
    return experiment(study, out).command(options, out)


def _run_ladder(options: Namespace) -> int:
    """Run the ladder."""
    from orchestrator.lab.ladder import Ladder

    return _on_study(options, Ladder)


def _run_budget(options: Namespace) -> int:
    """Run the budget."""
    from orchestrator.lab.budget import Budget

    return _on_study(options, Budget)


def _of_convergence(command: Parser) -> None:
    """Add the options of `convergence`."""
    add_run_options(command, "", "command")
    add = command.add_argument
    add("source", metavar="FILE|PRESET", help="study file, or name of a preset")
    text = "a scene, by its id in the tables of the study; may be given several times"
    add("--scene", action="append", default=[], metavar="ID", help=text)
    text = "all scenes; default: of each class of scenes the one with the fewest grains"
    add("--all", action="store_true", help=text)


def _run_convergence(options: Namespace) -> int:
    """Refine the meshes and load steps of scenes of a study."""
    from orchestrator.lab.convergence import Convergence

    made = partial(Convergence, ids=options.scene, every=options.all)
    return _on_study(options, made)


def _run_stability(options: Namespace) -> int:
    """Run the maps of failure."""
    from orchestrator.lab.stability import Stability

    out = options.out or Path("results") / options.command
    return Stability().command(options, out)


def _run_validate(options: Namespace) -> int:
    """Run the validation, or its flows over beds in three dimensions alone."""
    if not options.surfaces:
        from orchestrator.lab.validate import Validation

        return _on_study(options, Validation)
    from orchestrator.surface.truth import Truth

    names = TRUTH if options.surfaces == "all" else (options.surfaces,)
    out = options.out or Path("results") / "surfaces"
    return Truth(names).command(options, out)


OFFER = Offer(
    commands=(
        Command(
            name="ladder",
            order=6,
            help="measure the cost and the error of each fidelity",
            page="docs/ladder.md",
            examples={
                "ladder --plan": "list what the preset would run; it takes hours",
                "ladder dune.toml --out results/mine": "measure on your own scenes",
            },
            options=_on_preset,
            run=_run_ladder,
        ),
        Command(
            name="budget",
            order=7,
            help="measure how much each assumption changes a threshold",
            page="docs/budget.md",
            examples={
                "budget --plan": "list what the preset would run",
                "budget sand.toml": "the effect of each assumption on your own study",
            },
            options=_on_preset,
            run=_run_budget,
        ),
        Command(
            name="convergence",
            order=8,
            help="refine the meshes and load steps of scenes of a study",
            page="docs/convergence.md",
            examples={
                "convergence sand.toml --plan": "list what would run, with time",
                "convergence sand.toml --all": "refine every scene, not one of a class",
            },
            options=_of_convergence,
            run=_run_convergence,
        ),
        Command(
            name="stability",
            order=9,
            help="draw maps of where each method fails; for developers",
            page="docs/stability.md",
            examples={
                "stability --plan": "list what would run",
                "stability --workers 1": "run one case at a time",
            },
            options=_on_own_scenes,
            run=_run_stability,
        ),
        Command(
            name="validate",
            order=10,
            help="compare the models with measured thresholds",
            page="docs/validation.md",
            examples={
                "validate --plan": "list what would run",
                "validate": "compare every model with every measurement",
            },
            options=_of_validate,
            run=_run_validate,
        ),
    )
)
