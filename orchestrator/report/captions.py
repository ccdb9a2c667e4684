"""Captions of the figures."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from orchestrator.grains.pile import Pile
from orchestrator.physics import curves
from orchestrator.physics.measured import MEASURED_SOURCE
from orchestrator.report import labels, laws, reference
from orchestrator.report.apart import varying
from orchestrator.report.fits import Fit
from orchestrator.report.results import Results, valid
from orchestrator.study import fields

DRAG_LAW = (
    "Right of the line “drag law ends” V_f d/ν exceeds 1000, up to which the drag law of Eq. 4 "
    "(Schiller and Naumann) holds."
)
PAIR = "Eq. 2 holds for Re* < 3 and Eq. 4 for Re* ≥ 30; shaded: where neither does"
OUTSIDE = ", whose Re* can lie outside the shaded range by one of the two"
HOLLOW = "Hollow markers: not usable, for the reason in the column `why_not` of the tables."


def listed(values: Iterable[float], scale: float = 1) -> str:
    """Numbers for a sentence."""
    return ", ".join(f"{value * scale:.6g}" for value in sorted(set(values)))


def closed_form(scenes: pd.DataFrame, by: str, number: int) -> str:
    """Describe the closed form by entrainment angle or by slope."""
    what = "entrainment angle β" if by == "beta_deg" else "slope α (the flow goes up it)"
    return (
        f"After Fig. {number} of the paper. Threshold stress of one grain against the friction "
        f"Reynolds number, by {what}, with δ = z₀; force laws: {force_laws(scenes)}. "
        f"{_drag_law(scenes)}In this diagram d, ν and the densities only say which part of a line "
        "a grain is on. Lines end where their law does; dotted ones go on as far as this study has "
        f"grains"
        f"{OUTSIDE if _has_pair(scenes) else ''}. {_references(scenes, by)}"
    )


def force_laws(rows: pd.DataFrame) -> str:
    """The laws of some rows, each with where it ends."""
    names = [labels.value("force_law", name) for name in laws.drawn(rows["force_law"])]
    return "; ".join(names) + (f". {PAIR}" if _has_pair(rows) else "")


def _drag_law(rows: pd.DataFrame) -> str:
    return f"{DRAG_LAW} " if _has_pair(rows) else ""


def _hollow(rows: pd.DataFrame) -> str:
    return "" if valid(rows).all() else f"{HOLLOW} "


def overview(
    results: Results, found: Sequence[Fit], piles: pd.DataFrame, grains: pd.DataFrame
) -> str:
    """Describe the one diagram of a study."""
    scenes = results.scenes
    points = []
    if len(piles):
        points.append(
            "Squares: mean wall stress over the grains of a pile that had moved when their "
            f"fraction was first {', '.join(f'{f:.0%}' for f in sorted(set(piles['fraction'])))}; "
            f"{labels.methods(piles)}. {low_regime(piles)}"
        )
    if len(grains):
        points.append(f"Dots: one grain; {labels.methods(grains)}.")
    told = "" if all(valid(one).all() for one in (piles, grains) if len(one)) else HOLLOW
    lines = "; ".join(fit.name for fit in found)
    return (
        f"{' '.join(points)} Bars are intervals. {told} Lines: one grain on a flat bed ({lines}); "
        f"dotted beyond the range of the law. {_references(scenes, 'beta_deg')}"
    )


def by_angle(scenes: pd.DataFrame, points: pd.DataFrame) -> str:
    """Describe the laws side by side, a panel for each entrainment angle."""
    dem = (
        f" Markers: DEM of one grain. {hold_protocol(points)} {_hollow(points)}"
        if len(points)
        else ""
    )
    return (
        "Threshold stress of one grain on a flat bed against the friction Reynolds number, by "
        f"force law. Lines are dotted beyond the range of their law.{dem} "
        f"{_references(scenes, 'beta_deg')}"
    )


def _has_pair(rows: pd.DataFrame) -> bool:
    return bool(rows["force_law"].isin(laws.PAIR).any())


def _references(scenes: pd.DataFrame, by: str) -> str:
    air = reference.air_lines(scenes)
    if by == "alpha_deg":
        sloped = (
            f"Dashed: the curve of {reference.SLOPED} for horizontal beds in air, times "
            "√(cos α + sin α/tan φ) on u*. "
        )
        wet = not air or not reference.in_gas(scenes).all()
        water = f"{_water()} They are for horizontal beds."
        return (sloped if air else "") + (water if wet else "")
    brown = (
        " Brown: curves for grains in air, of this study’s grains and gas over the same diameters "
        f"({', '.join(air)}; the latter two include cohesion, Bagnold’s holds for Re* > "
        f"{reference.BAGNOLD_FROM:g})."
    )
    return _water() + (brown if air else "")


def _water() -> str:
    return (
        "Blue: the spread of published curves for water, between the lowest and the highest "
        "wherever at least two were published for that Re*; thin lines are the curves themselves "
        f"({'; '.join(curve.name for curve in curves.WATER)}). They are fits, not measured points. "
        f"Black: {MEASURED_SOURCE}; the median of each range of Re*, and from the tenth to the "
        "ninetieth percentile."
    )


def _values(column: str, piles: Iterable[Pile]) -> str:
    """The values of a column that some piles were run with, as a text."""
    used = dict.fromkeys(fields.COLUMNS[column].used(pile.scene) for pile in piles)
    return ", ".join(labels.value(column, value) for value in used)


def hold_protocol(rows: pd.DataFrame) -> str:
    """How thresholds were found: by the load step protocol where DEM ran, else by what was run."""
    held = rows[rows["answered_method"] == "dem"]
    rest = rows[rows["answered_method"] != "dem"]
    other = f"Without dynamics or holds: {labels.methods(rest)}." if len(rest) else ""
    if held.empty:
        return other
    criterion = listed(held["answered_displacement_criterion"])
    return (
        f"Holding protocol: u* rises by {listed(held['answered_load_increment'], 100)} % from one "
        f"load step to the next. A load step ends when no grain has passed {criterion} d along the "
        f"bed for {listed(held['answered_waiting_time'])} √(d/g′); such a grain has moved. {other}"
    )


def grain_dem(points: pd.DataFrame, number: int) -> str:
    """Describe the single grains by DEM on the lines of the closed form."""
    return (
        f"After Fig. {number} of the paper. Markers: thresholds of one mobile sphere on its two "
        "fixed neighbours, by LIGGGHTS; lines, band and curves as in the figure before. "
        f"{hold_protocol(points)} Bars run from the last load step without to the first with "
        f"motion; most are smaller than the markers. {_hollow(points)}"
    )


def accuracy(dem: pd.DataFrame) -> str:
    """Describe the ratio of DEM and closed form."""
    ratio = dem["ustar_m_s"] / dem["ustar_closed_form_m_s"] - 1
    holds = valid(dem)
    parts = []
    for chosen, name in ((holds, "where its law holds"), (~holds, "where it does not")):
        if ratio[chosen].notna().any():
            parts.append(f"{ratio[chosen].abs().max():.2%} {name}")
    return (
        "Friction velocity at the threshold by DEM over that of the closed form with the same "
        f"forces: {force_laws(dem)}. Bars: between the load steps without and with motion, so a "
        "threshold met exactly lies within its bar. "
        f"{'Panels differ in scale. ' if dem['load_increment'].nunique() > 1 else ''}"
        f"Largest deviation: {', '.join(parts)}. {hold_protocol(dem)} {_hollow(dem)}"
    )


def stress(results: Results, piles: list[Pile]) -> str:
    """Describe the friction velocity along the bed."""
    mean, crest = eq10_over_wall(results, [pile.flow.name for pile in piles])
    return (
        "Signed friction velocity along the bed over the undisturbed u*₀ = 0.41 U_e/ln((10 h + "
        "z₀)/z₀). Black: from the wall shear stress of the OpenFOAM solution; blue: Eq. 10 at the "
        "centre of the first cell, with the logarithm of the rough wall and as printed. Eq. 10 is "
        f"{mean:+.0%} from the wall stress’s u* on the mean of the windward face and {crest:+.0%} "
        "at the crest: a model uncertainty of every threshold of a pile. The crest is a spike of "
        "one cell that does not converge with the mesh; therefore a grain feels the stress "
        f"averaged over {averaged(piles)} of bed (orange). Shaded: flow that runs back. Below: the "
        "bed, heights exaggerated."
    )


def where() -> str:
    """Describe the map of thresholds."""
    return (
        "Each bed, from the top: signed friction velocity along the bed over the undisturbed one "
        "(shaded: flow that runs back); the bed with the speed of the flow over it, where its "
        "files are kept, heights exaggerated; and for each counted grain the undisturbed friction "
        "velocity at which it goes, against its place. Colour: the fraction of the counted "
        "grains that has gone by then. Grey: grains that never went. Where the flow runs back "
        "it pushes grains upstream. No interval is drawn; the tables have them."
    )


def hills() -> str:
    """Describe hills that others measured."""
    return (
        "Hills of the wind-tunnel experiment RUSHIL, each with the flow of each turbulence model: "
        "signed friction velocity along the bed over the undisturbed one, and below it where the "
        "flow runs back, computed (bars) and measured (black: its end, a line; the experiment "
        "found none behind the two gentler hills). The stress on the bed was not measured. The "
        "table flow has the numbers and where the measured ones are from."
    )


def averaged(piles: Iterable[Pile]) -> str:
    """The length of bed that the stress on a grain is averaged over."""
    return f"max(d, {_values('averaging_length', piles)})"


def eq10_over_wall(results: Results, flow_cases: Iterable[str]) -> tuple[float, float]:
    """Relative difference of u* by Eq. 10: mean of the windward faces, largest at their crests."""
    table = results.tables["wall_stress"]
    means, crests = [], []
    for name in flow_cases:
        rows = table[table["flow_case"] == name]
        line = results.flows[name].model.line
        face = rows[(rows["s_m"] > 0) & (rows["s_m"] < line.crest_s)]
        wall, eq10 = face["ustar_over_ustar0_wall"], face["ustar_over_ustar0_eq10"]
        means.append(eq10.mean() / wall.mean() - 1)
        crests.append(eq10.max() / wall.max() - 1)
    return float(np.mean(means)), float(np.max(crests))


def fractions(rows: pd.DataFrame) -> str:
    """Describe n/N against the flow."""
    return (
        "After Fig. 14 of the paper. Fraction of the N(d) exposed grains of the windward face that "
        "had moved at a flow (a marker), against τ of the mean signed wall stress over the grains "
        "that had moved, as in the paper: the mean falls where the next grains to move feel less. "
        "Above n/N = 90 % a curve may leave the frame. "
        f"Forces: {force_laws(rows)}. {hold_protocol(rows)} {_hollow(rows)}{low_regime(rows)}"
    )


def extended(rows: pd.DataFrame) -> str:
    """Describe the extended Shields diagram."""
    return (
        "After Figs. 15 and 16 of the paper. Mean signed wall stress over the grains that had "
        "moved when their fraction first reached n/N; thin lines join piles that differ in d "
        "alone. Bars hold the step between two flows and the count’s resolution of half a grain; "
        "Re* is that of the marker’s stress. A fraction that was not reached has no marker. Black: "
        "the closed form of one grain at the same slope, entrainment angle and z₀/d; dotted where "
        f"its force law does not hold. Force laws: {force_laws(rows)}. {_drag_law(rows)}"
        f"{hold_protocol(rows)} {_hollow(rows)}{low_regime(rows)}"
        f"{_references(rows, 'alpha_deg')}"
    )


def low_regime(rows: pd.DataFrame) -> str:
    """The assumption behind piles in a fluid made viscous."""
    if rows["nu_m2_s"].nunique() < 2:
        return ""
    return (
        "Points at a raised ν use the stress field of the rough turbulent flow at the flow’s own "
        "ν: there ν moves the grain’s Re* only, an assumption. "
    )


def flow(piles: list[Pile]) -> str:
    """Describe the picture of the flow."""
    return (
        f"Steady turbulent flow by OpenFOAM ({_values('turbulence_model', piles)}, rough wall), at "
        f"the last iteration, for U_e = {_values('solve_u_e_m_s', piles)} at 10 h; the fields of "
        "other speeds are taken to be similar. White: streamlines, the closed ones "
        "around the flow that runs back, at arbitrary spacing. Only the part near "
        f"the pile is shown. {_lid(piles)}To scale."
    )


def _lid(piles: Iterable[Pile]) -> str:
    """A flow without a surface ends at a lid, beyond the picture."""
    return "" if any(pile.scene.flow.depth for pile in piles) else "The lid is far above. "


def wear() -> str:
    """Describe the figure of beds that change."""
    return (
        "The threshold at which n grains have moved, the mean stress on them. Dashed: the flow of "
        "the whole pile acts until the end, as in the paper. Solid: after each part of the grains "
        "that protocol.update says the bed line is drawn anew through those that are there, and "
        "the flow is solved over it. Dot: where the two are first more than 5 % apart "
        "(holds_until); by DEM one load step is twice its increment in θ."
    )


def mesh(pile: Pile) -> str:
    """Describe the picture of the mesh."""
    flow, z0 = pile.flow, pile.bed.roughness
    return (
        "After Fig. 11 of the paper, which has triangles. Hexahedra, one cell deep, by gmsh: "
        f"{flow.cells_per_face} along each face of the pile; the first cells are "
        f"{flow.first_cell_m / z0:.3g} z₀ high, as the log law of the rough wall needs, and grow "
        "away from the bed and from the pile. Above: near the pile; below: "
        f"the crest, as boxed. {_lid([pile])}To scale. No grains: the flow sees the smooth faces."
    )


def bed(results: Results, pile: Pile) -> str:
    """Describe the picture of the bed."""
    moved = (
        f"moved, that is {_values('displacement_criterion', [pile])} downstream along the bed; "
        "hollow: left the box, where it lay"
        if pile.by_dem
        else f"moves by then, by {pile.scene.protocol.method}, a method without dynamics"
    )
    when = "at the end of a load step" if pile.by_dem else "as packed, at a flow"
    wears = (
        f"Blue line: the bed line, drawn anew after each {pile.scene.protocol.update:.0%} of the "
        "grains; hollow: gone, where it lay. "
        if pile.scene.protocol.update
        else ""
    )
    strip = f"all rows of a strip of {pile.bed.width:g} d from the side, " * bool(pile.bed.width)
    flow = (
        "The shade of blue is the speed of the flow by OpenFOAM over the bed without grains, over "
        "that of the approaching flow at 10 h. "
        if pile.model.cases
        else ""
    )
    return (
        f"After Fig. 13 of the paper. Grains {strip}{when}; orange: {moved}; pale "
        "yellow: exposed, has not moved; beige: mobile under it; grey: fixed. "
        f"{flow}{wears}d is one diameter. {_pile(results, pile)}"
    )


def _pile(results: Results, pile: Pile) -> str:
    """Properties of a pile beside slope and diameter, as far as the study's piles differ."""
    columns = ["z0_over_d", "packing", "force_law"]
    columns += varying(results.beds("pile"), "alpha_deg", "d_m", *columns)
    used = {column: fields.COLUMNS[column].used(pile.scene) for column in columns}
    return ", ".join(labels.plain(c, value) for c, value in used.items() if value is not None) + "."
