"""Hills over which others measured the flow: computed by each turbulence model, beside that."""

from collections.abc import Iterator

import pandas as pd
from matplotlib.axes import Axes

from orchestrator.report import captions, style
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results
from orchestrator.study.parts import Flow
from orchestrator.tables.flows import measured_hill

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


def draw(results: Results) -> Iterator[Figure]:
    """One figure, a panel for each hill; none where no hill of the study was measured."""
    flows = results.tables.get("flow", pd.DataFrame())
    if "measured_source" not in flows:
        return
    flows = flows.dropna(subset=["measured_source"])
    hills = [rows for _, rows in flows.groupby("alpha_deg", sort=True)][::-1]
    canvas = style.canvas(HEIGHT * len(hills) + 0.3)
    panels = canvas.subplots(2 * len(hills), 1, sharex=True, height_ratios=[3, 1] * len(hills))
    for number, rows in enumerate(hills):
        _hill(panels[2 * number], panels[2 * number + 1], results, rows)
    panels[-1].set(xlabel="$x/h$ from the top", xlim=AROUND)
    names = [name for name in COLOURS if name in set(flows["turbulence_model"])]
    style.legends(canvas, [style.entry(_label(name), COLOURS[name]) for name in names], [])
    cases = tuple(flows["flow_case"])
    yield Figure("hills", "Hills that others measured", captions.hills(), cases, canvas)


def _label(name: str) -> str:
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
        reversed_.axvline(at, color="black", lw=1.2, gid="measured")
    aspect = measured_hill(results.flows[str(one["flow_case"])])
    assert aspect
    stress.axhline(0, color="0.4", lw=0.6)
    stress.set(ylabel=r"$u^\star/u^\star_0$")
    stress.set_title(f"half length {aspect.aspect:g} h, {one['alpha_deg']:.3g}°", loc="left")
    reversed_.set(yticks=[], ylim=(len(rows) - 0.3, -0.7), ylabel="reversed")
