"""The common part of all cases of LIGGGHTS on a bed of grains."""

from pathlib import Path
from typing import ClassVar

from orchestrator.runs import process
from orchestrator.runs.case import Case
from orchestrator.solvers import liggghts


class GrainCase(Case):
    """A case that runs the deck ``in.bed``."""

    template: ClassVar[str] = "liggghts/bed"
    results: ClassVar[tuple[str, ...]] = ("settling.csv", "samples.csv", "passage.dump", "bed.dump")
    derived: ClassVar[tuple[str, ...]] = ("load_steps.csv", "motion.csv")
    made: ClassVar[tuple[str, ...]] = ("log.liggghts",)
    bulky: ClassVar[tuple[str, ...]] = ("passage.dump", "bed.dump")

    def versions(self) -> dict[str, str]:
        """The programs that run the case, with their versions."""
        return liggghts.programs(self.ranks)

    def share(self, directory: Path) -> float:
        """Load steps that have begun over those that there may be."""
        step, *_ = process.last_words(directory / "samples.csv").split(",")
        if not step.isdecimal():
            return 0.0
        steps = len((directory / "load_steps.txt").read_text(encoding="ascii").split())
        return min(int(step) / steps, 1.0)

    @staticmethod
    def check(directory: Path) -> None:
        """See that the run came to its own end."""
        liggghts.check_log(directory)
