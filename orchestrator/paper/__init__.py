"""The paper: its studies, and the report card of its claims."""

from pathlib import Path
from typing import TYPE_CHECKING

from orchestrator.guests import Offer

if TYPE_CHECKING:
    from orchestrator.report.page import Guest
    from orchestrator.study.study import Study
    from orchestrator.tables import Tables

PRESETS = Path(__file__).parent / "presets"
CLAIMS = "claims.csv"


def cards(study: "Study", tables: "Tables") -> "list[Guest]":
    """Make the report card of a study of the paper.

    The paper's studies are the presets of this package, word for word.

    Parameters
    ----------
    study
        The study.
    tables
        Its tables.

    Returns
    -------
    list of Guest
        The card; none for any other study, or if no claim can be judged.
    """
    texts = [path.read_text(encoding="utf-8") for path in PRESETS.glob("*.toml")]
    if study.text not in texts:
        return []
    from orchestrator.paper import claims

    judged = claims.judge_claims(tables)
    if all(one.verdict == "no data" for one in judged):
        return []
    return [claims.guest(judged, tables, CLAIMS, study.tolerance)]


OFFER = Offer(cards=cards)
