"""The page of the budget: a tornado for each scene, the shares, the alternatives."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from orchestrator.experiments.budget import curves, tornado
from orchestrator.experiments.budget.choices import CHOICES
from orchestrator.experiments.budget.shares import QUANTITIES
from orchestrator.fidelity.spread import FROZEN, together
from orchestrator.grains.pile import Pile
from orchestrator.report import document
from orchestrator.report.document import Section
from orchestrator.report.figure import Figure
from orchestrator.runs.workspace import Workspace

TITLE = "What a threshold is worth"
TEXT = (
    "The fidelity levels are measured against the dearest one. What all of them share does not show"
    " there: it is changed here, one choice at a time. Each bar spans the largest change over the "
    "fractions, downwards and upwards; the top bar is the root of the sum of squares, as if the "
    "choices had nothing to do with one another."
)
CAPTION = (
    "Quasi-static levels (coarse flow, peeling) except for the friction angle, which DEM alone "
    "feels. The Shields number is that of the mean stress on the grains that moved; u*₀ is that of "
    "the flow far from the bed."
)
CHANGING = (
    "The levels keep the flow over the whole pile until the end, as the paper does. Here the bed "
    "line is drawn anew after each tenth of the counted grains, the flow is solved again, and the "
    "grains go on by peeling. The table has the threshold on the bed that changes over that on the "
    "frozen one, less 1."
)
WEAR = (
    "Left: the threshold at each n/N. Right: the bed line at the start and after each tenth, "
    "darker as it wears; its edges are rounded over 2 d. Grains that come to light are not loaded."
)
SYMBOLS = {"shields": "θ", "ustar0": "u*₀"}
LIMITS = (
    "The ranges of the choices are judgements, with the reason beside each; no statistics.",
    "Alternatives that are refused at a scene, or do not hold at its Re*, are left out.",
)


def write(
    tables: Mapping[str, pd.DataFrame],
    lost: pd.DataFrame,
    worn: Sequence[tuple[Pile, Pile]],
    space: Workspace,
    solvers: Mapping[str, str],
) -> None:
    """Write the page from the tables ``changes`` and ``shares``; `lost` has no answer.

    `worn` are piles on the frozen bed, each beside the same on one that changes.
    """
    shared = tables["shares"]
    scenes = [
        _scene(number, rows)
        for number, (_, rows) in enumerate(shared.groupby("scene_id", sort=False), 1)
    ]
    changing = [_changing(tables["changes"], worn, space.cases)] if worn else []
    sections = [_all(shared), *changing, *scenes, _choices(tables["changes"], lost)]
    document.write(TITLE, sections, space.folder, space.page.name, solvers)


def _all(shared: pd.DataFrame) -> Section:
    rows = []
    for _, scene in shared.groupby("scene_id", sort=False):
        largest = scene.groupby("choice")[_ends()].max()
        row = {"scene": scene["scene"].iloc[0]}
        for name in QUANTITIES:
            low, high = (100 * together(largest[f"{name}_{end}"]) for end in ("low", "high"))
            widest = (largest[f"{name}_low"] + largest[f"{name}_high"]).idxmax()
            row |= {
                f"{SYMBOLS[name]}, %": f"−{low:.0f} … +{high:.0f}",
                f"{SYMBOLS[name]}: largest share": widest,
            }
        rows.append(row)
    return Section(
        "All choices together", TEXT, tables=(document.sheet(pd.DataFrame(rows)),), limits=LIMITS
    )


def _changing(moved: pd.DataFrame, worn: Sequence[tuple[Pile, Pile]], cases: Path) -> Section:
    drawing = Figure("wear", "Frozen bed and bed that changes", WEAR, (), curves.draw(worn, cases))
    rows = moved[moved["choice"] == FROZEN]
    table = pd.DataFrame(
        {
            "scene": rows["scene"],
            "n/N": rows["fraction"],
            "θ, %": 100 * rows["shields"],
            "u*₀, %": 100 * rows["ustar0"],
        }
    )
    return Section("The bed that changes", CHANGING, (drawing,), (document.sheet(table),))


def _scene(number: int, rows: pd.DataFrame) -> Section:
    name = str(rows["scene"].iloc[0])
    drawing = Figure(f"tornado-{number}", name, CAPTION, (), tornado.draw(rows))
    return Section(name, "", (drawing,), (document.sheet(_by_fraction(rows)),))


def _by_fraction(rows: pd.DataFrame) -> pd.DataFrame:
    """A row for each choice, a column for each fraction: the share of the Shields number."""
    cells = [
        f"−{100 * low:.1f} … +{100 * high:.1f}"
        for low, high in zip(rows["shields_low"], rows["shields_high"], strict=True)
    ]
    heads = [f"{fraction:.0%}" for fraction in rows["fraction"]]
    table = rows.assign(share=cells, head=heads)
    wide = table.pivot_table("share", "choice", "head", aggfunc="first", sort=False)
    return wide.add_prefix("change of θ at ").add_suffix(", %").reset_index()


def _choices(moved: pd.DataFrame, lost: pd.DataFrame) -> Section:
    tried = moved.groupby("choice")["alternative"].agg(lambda x: ", ".join(dict.fromkeys(x)))
    rows = [
        {"choice": one.name, "alternatives": tried[one.name], "why": one.why}
        for one in CHOICES
        if one.name in tried
    ]
    listed = [pd.DataFrame(rows), *([] if lost.empty else [lost])]
    text = "" if lost.empty else "The alternatives of the second table have no answer."
    return Section(
        "The choices and their alternatives", text, tables=[document.sheet(one) for one in listed]
    )


def _ends() -> list[str]:
    return [f"{name}_{end}" for name in QUANTITIES for end in ("low", "high")]
