"""Size-selective mobility: the fraction of each size that is entrained."""

from collections.abc import Iterator
from functools import partial

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.digits import percent
from orchestrator.report import labels, sheets, style, theory
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import filled
from orchestrator.report.results import Results, case_names, valid
from orchestrator.report.style import ANSWER, INK, NONE, Figure, Look

MARKERS = ("o", "^", "D", "s")
"""Markers of the methods, in the order of their rows."""
APART = 1.035
"""Ratio of the places at which two beds are drawn at one size."""
EQUAL: Look = {"color": INK, "ls": style.MEASURED, "lw": 1.0, "gid": "equal mobility"}
CAPTION = """\
{{ trend }} Fraction of the exposed grains of each size that is entrained when
{{ part }} of all are, for each bed of this mixture; bars: the interval that so few
grains leave (binomial, 80 %); open: fewer than ten grains. Dashed: equal
mobility.{% if unusable %} Grey: the stress is not usable.{% endif %}"""


def draw(results: Results) -> Iterator[Figure]:
    """Draw the fraction of each size that is entrained at the answer's fraction.

    Yields
    ------
    Figure
        One figure of all beds of the mixture of the card, or none.
    """
    rows = results.exemplars
    if rows.empty or theory.are_many(results) or sheets.sizes_sheet(results) is None:
        return
    row = rows.iloc[0]
    beds = results.at_fraction
    for column in ("sizes", "alpha_deg", "rho_f_kg_m3", "d_m"):
        beds = beds[beds[column] == row[column]]
    classes = results.tables["size_class"]
    classes = classes[classes["fraction"] == row["fraction"]]
    known = beds["scene_id"].isin(classes["scene_id"])
    beds = beds[known].sort_values("method", kind="stable")
    part = percent(row["fraction"])
    text = filled(
        CAPTION, part=part, trend=trend(classes, beds), unusable=not valid(beds).all()
    )
    title = f"Fraction of each size entrained when {part} of all grains are, %"
    drawing = partial(_draw, classes, beds)
    yield Figure("mobility", title, text, case_names(beds), drawing, place="under")


def trend(classes: pd.DataFrame, beds: pd.DataFrame) -> str:
    """Say which sizes go first, of those with ten grains or more on each bed.

    Parameters
    ----------
    classes
        Rows of ``size_class`` at one fraction.
    beds
        The beds.

    Returns
    -------
    str
        The sentence.
    """
    differences = []
    for scene_id in beds["scene_id"]:
        here = classes[(classes["scene_id"] == scene_id) & ~classes["few"]]
        moved = here.sort_values("size_over_d")["class_moved"].to_numpy(float)
        if len(moved) > 1:
            differences.append(moved[0] - moved[-1])
    if differences and min(differences) > 0:
        return "Fine grains go first on each bed."
    if differences and max(differences) < 0:
        return "Coarse grains go first on each bed."
    return "Which size goes first differs from bed to bed, or is not known."


def _draw(classes: pd.DataFrame, beds: pd.DataFrame) -> Canvas:
    """A marker for each size and bed, with its interval."""
    figure = style.canvas(3.2, style.NARROW)
    ax = figure.subplots()
    methods = list(dict.fromkeys(beds["method"]))
    named: set[str] = set()
    for place, (_, bed) in enumerate(beds.iterrows()):
        here = classes[classes["scene_id"] == bed["scene_id"]]
        method = str(bed["method"])
        look: Look = {"marker": MARKERS[methods.index(method) % len(MARKERS)]}
        look["color"] = ANSWER if bed["usable"] else NONE
        look["label"] = "_again" if method in named else _name(bed, beds)
        named.add(method)
        beside = APART ** (place - (len(beds) - 1) / 2)
        _bed(ax, here.sort_values("size_over_d"), 1e3 * bed["d_m"] * beside, look)
    ax.axhline(100 * float(beds["fraction"].iloc[0]), **EQUAL)
    here = classes[classes["scene_id"].isin(beds["scene_id"])]
    sizes = 1e3 * float(beds["d_m"].iloc[0]) * here["size_over_d"].sort_values()
    ax.set(xscale="log", xlim=(sizes.min() / 1.25, sizes.max() * 1.25), ylim=(-4, 100))
    ax.minorticks_off()
    named_sizes = {f"{size:.3g}": size for size in sizes}
    ax.set_xticks([*named_sizes.values()], [*named_sizes])
    ax.set(xlabel="grain diameter, mm", ylabel="entrained, %")
    handles = style.samples([ax])
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _bed(ax: Axes, classes: pd.DataFrame, d_mm: float, look: Look) -> None:
    """The sizes of one bed, each with its interval."""
    x = d_mm * classes["size_over_d"].to_numpy(float)
    moved, low, high = (
        100 * classes[f"class_moved{end}"].to_numpy(float)
        for end in ("", "_low", "_high")
    )
    ax.vlines(x, low, high, color=look["color"], lw=1.0, alpha=0.45, gid="interval")
    few = classes["few"].to_numpy(bool)
    marker: Look = {**look, "ls": "", "ms": 6, "gid": "mobility"}
    ax.plot(x[~few], moved[~few], **marker)
    ax.plot(x[few], moved[few], **{**marker, "mfc": "white", "label": "_few"})


def _name(bed: pd.Series, beds: pd.DataFrame) -> str:
    """What a method is called, with the number of its beds."""
    count = int((beds["method"] == bed["method"]).sum())
    replicates = f", {count} replicates" if count > 1 else ""
    return labels.value("method", str(bed["method"])) + replicates


FIGURE = FigureKind(order=78, draws=draw, needs=("size_class", "pile_threshold"))
