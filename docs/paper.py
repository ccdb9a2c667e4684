"""Writes docs/paper.md, the claims of the paper, from the descriptions in the program.

python docs/paper.py [CLAIMS] > docs/paper.md

CLAIMS is the file claims.csv of `orchestrator study paper`: what it found replaces what the program has.
"""

import sys
from pathlib import Path

import pandas as pd

from orchestrator.paper import findings
from orchestrator.paper.evidence import FLOWS

HEAD = """\
# The paper, reproduced

    orchestrator study paper

answers the piles and the single grains of the article by Bravo, Ortiz and Pérez-Aparicio: some 430 runs of OpenFOAM and LIGGGHTS, in ten
minutes on two cores. The page draws the article's figures under their numbers and judges its claims. With `--tolerance 0.2` it takes a
third of the runs, and the claims about DEM are judged as far as they can be.

Figs. 14 to 16 are drawn twice: by Eq. 10, with which the paper computes the stress on the grains, and by the stress on the wall. Under
Eq. 10 DEM answers the piles of 15°, those of Fig. 14, and peeling those of every slope. The page compares both where both were run.

A claim on piles is judged by both stresses. The verdicts below are those of the preset without a tolerance, with the number of
comparisons in which the claim is true. A claim is reproduced where it is true in at least 95 % of each line of comparisons, and not
reproduced where it is in at most 5 % of each. Between these it is *mostly* true, or *mostly not*.
[benchmark/paper](../benchmark/paper/README.md) has the thresholds as tables. This page is written by `python docs/paper.py` from the
descriptions in the program and from the claims.csv of a run.

"""
END = """
## Where to go next

- [model.md](model.md#corrections-to-the-paper): what is corrected in the article's equations.
- [protocol.md](protocol.md): how load steps, contact and packing change a threshold.
- [benchmark.md](benchmark.md): the same scenes for a solver of your own.
"""


def text() -> str:
    """Write the page."""
    from orchestrator.paper.claims import CLAIMS  # after what a run found is kept

    heads = ["no", "claim", "in the article", "verdict"]
    heads += [f"by {flow}" for flow in FLOWS.values()]
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for number, claim in enumerate(CLAIMS, 1):
        found = {finding.flow: str(finding) for finding in claim.found}
        row = [str(number), _line(claim.says), _line(claim.where)]
        row += [found.get(flow, "") for flow in ("", *FLOWS)]
        lines.append(f"| {' | '.join(row)} |")
    lines += ["", "## Why", ""]
    for number, claim in enumerate(CLAIMS, 1):
        verdict = findings.WORDS[claim.found[0].verdict].capitalize()
        lines += [f"**{number}. {verdict}.** {_line(claim.why)}", ""]
    return HEAD + "\n".join(lines).rstrip() + "\n" + END


def _line(told: str) -> str:
    """A text on one line, in which Markdown takes no star for its own."""
    return " ".join(told.split()).replace("*", r"\*")


def keep(claims: Path) -> None:
    """Let the program have what a run of the preset found."""
    table = pd.read_csv(claims)
    table.index = pd.RangeIndex(1, len(table) + 1, name="number")
    counted = [name for flow in ("", *FLOWS) for name in findings.columns_of(flow)]
    table[counted].convert_dtypes().to_csv(findings.FOUND)


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        keep(Path(argument))
    print(text(), end="")
