"""The paper: its studies, and the report card of its claims.

Only the pipeline imports it.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from markupsafe import Markup

    from orchestrator.study.study import Study
    from orchestrator.tables import Tables

PRESETS = Path(__file__).parent / "presets"
CLAIMS = "claims.csv"


def report_card(
    study: "Study", tables: "Tables", figures: Sequence[str]
) -> "tuple[Markup, dict[str, str]] | None":
    """The report card of a study of the paper; none for any other.

    The paper's studies are the presets of this package, word for word; `figures` are the names of
    the page's figures, in its order.
    """
    if study.text not in [path.read_text(encoding="utf-8") for path in PRESETS.glob("*.toml")]:
        return None
    from orchestrator.paper import claims

    judged = claims.judge(tables)
    section = claims.section(judged, figures, bool(study.tolerance))
    return section, {CLAIMS: claims.frame(judged).to_csv(index=False)}
