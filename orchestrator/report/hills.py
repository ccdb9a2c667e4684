"""Hills over which others measured the flow: computed by each turbulence model, beside that."""

from collections.abc import Iterator

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from orchestrator.report import captions, labels, style
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results
from orchestrator.study.parts import Flow
from orchestrator.tables.scenes import measured_hill

COLOURS = {
    "kEpsilon": "#0072b2",
    "RNGkEpsilon": "#d55e00",
    "realizableKE": "#009e73",
    "kOmegaSST": "#cc79a7",
}
HEIGHT = 2.7
"""Height of a hill's panels, inches."""
AROUND = (-9.0, 13.0)
"""Bed shown around the top, h."""
MEASURED: style.Look = {
    "color": "black",
    "lw": 1.2,
    "gid": "measured",
    "label": "measured end of the reversed flow",
}
NOTHING: style.Look = {**style.NOTE, "ha": "center", "va": "center"}


def draw(results: Results) -> Iterator[Figure]:
    """One figure, a panel for each hill; none where no hill of the study was measured."""
    hills = list(_hills(results))
    if not hills:
        return
    flows = pd.concat([rows for _, rows in hills])
    canvas = style.canvas(HEIGHT * len(hills) + 0.3)
    panels = canvas.subplots(2 * len(hills), 1, sharex=True, height_ratios=[3, 1] * len(hills))
    for number, (aspect, rows) in enumerate(hills):
        _hill(panels[2 * number], panels[2 * number + 1], results, rows)
        steepest = labels.amount(float(rows["alpha_deg"].iloc[0]), "°")
        panels[2 * number].set_title(f"half length {aspect:g} h, {steepest}", loc="left")
    panels[-1].set(xlabel="$x/h$ from the top", xlim=AROUND)
    names = [name for name in COLOURS if name in set(flows["turbulence_model"])]
    colours = [style.entry(label(name), COLOURS[name]) for name in names]
    known = flows["measured_reattachment_over_h"].notna().any()
    unverified = "" if flows["measured_verified"].all() else " (unverified)"
    measured_end = {**MEASURED, "label": f"{MEASURED['label']}{unverified}"}
    style.legends(canvas, colours, [Line2D([], [], **measured_end)] if known else [])
    cases = tuple(flows["flow_case"])
    yield Figure("hills", "Hills that others measured", captions.hills(), cases, canvas, first=True)


def sentences(results: Results) -> Iterator[str]:
    """Where reversed flow ends behind each hill, by model and as measured."""
    for hill, rows in _hills(results):
        models = [label(str(name)) for name in rows["turbulence_model"]]
        ends = list(zip(models, rows["reattachment_over_h"].tolist(), strict=True))
        found = [f"by {name} to {end:.1f} h" for name, end in ends if pd.notna(end)]
        none = [name for name, end in ends if pd.isna(end)]
        if none:
            found.append(f"none by {', '.join(none)}")
        known = rows["measured_reattachment_over_h"].iloc[0]
        measured_ = f"measured to {known:.1f} h" if pd.notna(known) else "none measured"
        if not rows["measured_verified"].all():
            measured_ += " (unverified)"
        yield (
            f"Reversed flow behind the top of the hill of half length {hill:g} h: {measured_}; "
            f"{', '.join(found)}."
        )


def _hills(results: Results) -> Iterator[tuple[float, pd.DataFrame]]:
    """The flows over each measured hill with its half length, the steepest first."""
    flows = results.tables.get("flow", pd.DataFrame())
    if "measured_source" not in flows:
        return
    for _, rows in reversed(list(flows.dropna(subset=["measured_source"]).groupby("alpha_deg"))):
        hill = measured_hill(results.flows[str(rows["flow_case"].iloc[0])])
        assert hill
        yield hill.aspect, rows


def label(name: str) -> str:
    """The name of a turbulence model for people."""
    info = Flow.model_fields["turbulence_model"].metadata
    choices = next(one.choices for one in info if hasattr(one, "choices"))
    return str(choices[name])


def _hill(stress: Axes, reversed_: Axes, results: Results, rows: pd.DataFrame) -> None:
    table = results.tables["wall_stress"]
    for place, (_, row) in enumerate(rows.iterrows()):
        along = table[table["flow_case"] == row["flow_case"]]
        line, colour = results.flows[row["flow_case"]].model.line, COLOURS[row["turbulence_model"]]
        x = (along["x_m"].to_numpy(float) - line.crest[0]) / line.h
        stress.plot(x, along["ustar_over_ustar0_wall"], color=colour, lw=1.0, gid="stress")
        ends = [row["separation_over_h"], row["reattachment_over_h"]]
        reversed_.plot(ends, [place, place], color=colour, lw=3, gid="reversed flow")
    one = rows.iloc[0]
    if pd.notna(one["measured_reattachment_over_h"]):
        at = one["measured_reattachment_over_h"]
        reversed_.axvline(at, **MEASURED)
    if rows["reattachment_over_h"].isna().all():
        reversed_.text(0.5, 0.5, "no reversed flow", transform=reversed_.transAxes, **NOTHING)
    stress.axhline(0, color="0.4", lw=0.6)
    stress.set(ylabel=r"$u^\star/u^\star_0$")
    reversed_.set(yticks=[], ylim=(len(rows) - 0.3, -0.7), ylabel="reversed")
