"""Writes docs/paper.md, the claims of the paper, from the descriptions in the program.

python docs/paper.py > docs/paper.md
"""

from orchestrator.paper.claims import CLAIMS, WORDS

HEAD = """\
# The paper, reproduced

    orchestrator study paper

answers the piles and the single grains of the article by Bravo, Ortiz and Pérez-Aparicio: some 430 runs of OpenFOAM and LIGGGHTS, in ten
minutes on two cores. The page draws the article's figures under their numbers and judges its claims. With `--tolerance 0.2` it takes a
third of the runs, and the claims about DEM are judged as far as they can be.

Figs. 15 and 16 are drawn with the stress on the wall at every slope. The paper computes the stress by its Eq. 10; piles by Eq. 10 are here
at 15° alone, so that those of 20° and 25° are not reproduced as the paper computed them.

The verdicts below are those of the preset without a tolerance. [benchmark/paper](../benchmark/paper/README.md) has its thresholds as tables.
This page is written by `python docs/paper.py` from the descriptions in the program.

"""
END = """
## Where to go next

- [model.md](model.md#corrections-to-the-paper): what is corrected in the article's equations.
- [protocol.md](protocol.md): how load steps, contact and packing change a threshold.
- [benchmark.md](benchmark.md): the same scenes for a solver of your own.
"""


def text() -> str:
    """Write the page."""
    lines = ["| no | claim | in the article | verdict |", "|---|---|---|---|"]
    for number, claim in enumerate(CLAIMS, 1):
        row = [str(number), _line(claim.says), _line(claim.where), WORDS[claim.verdict]]
        lines.append(f"| {' | '.join(row)} |")
    lines += ["", "## Why", ""]
    for number, claim in enumerate(CLAIMS, 1):
        verdict = WORDS[claim.verdict].capitalize()
        lines += [f"**{number}. {verdict}.** {_line(claim.why)}", ""]
    return HEAD + "\n".join(lines).rstrip() + "\n" + END


def _line(told: str) -> str:
    """A text on one line, in which Markdown takes no star for its own."""
    return " ".join(told.split()).replace("*", r"\*")


if __name__ == "__main__":
    print(text(), end="")
