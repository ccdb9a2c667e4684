"""The page of the maps: the sheet of all, then each by itself."""

from collections.abc import Mapping, Sequence

from orchestrator.experiments.stability import figures
from orchestrator.experiments.stability.verdicts import WRONG, Judged
from orchestrator.report import document
from orchestrator.report.document import Section
from orchestrator.report.figure import Figure
from orchestrator.runs.workspace import Workspace

TITLE = "Where each method fails"
ALL = (
    f"Each cell is a real run. It is good where tau_c is within {WRONG:.0%} of its reference at"
    " every fraction; wrong where it is not and nothing said so; noisy, exploded or stalled where"
    " the run itself said so (a marked corner)."
)


def write(judged: Sequence[Judged], space: Workspace, solvers: Mapping[str, str]) -> None:
    """Write the page."""
    sheet = Figure("maps", TITLE, "", (), figures.sheet(judged))
    sections = [Section("All maps", ALL, (sheet,)), *map(_section, judged)]
    document.write(TITLE, sections, space.folder, space.page.name, solvers)


def _section(judged: Judged) -> Section:
    one = judged.map
    drawing = Figure(f"map-{one.name}", one.title, "", (), figures.draw(judged))
    return Section(one.title, one.question, (drawing,), limits=one.limits)
