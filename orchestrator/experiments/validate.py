"""Validation: what the model says beside what was measured, with nothing fitted.

Each set of measurements is a table beside this file, in the folder ``measured``. Level beds are
answered on strips poured from a mixture of sand. They depend on the Galileo number
``Ga = sqrt((rho_sol/rho_f - 1) g d^3)/nu``, the slope and the cohesion alone, so that a few solves
answer hundreds of rows. Each set has the ratio of the model's value to the measured one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas

from orchestrator import plan
from orchestrator.bed.packing import Packing, Places
from orchestrator.errors import InputError
from orchestrator.experiments.experiment import TEXTS, Experiment, Results, Runs
from orchestrator.fidelity.decision import as_asked
from orchestrator.fidelity.levels import Fields, changed
from orchestrator.flow.stress import WallStress, bubble
from orchestrator.grains import peeling, sheltering, threshold
from orchestrator.grains.loads import Geometry
from orchestrator.grains.peeling import PLACES, RANGE, ForceTable
from orchestrator.physics.constants import GRAVITY
from orchestrator.physics.gusts import peak_over_mean
from orchestrator.physics.laws import CLIFT_GAUVIN, LAWS, Exposure
from orchestrator.physics.measured import kirchner_pivot
from orchestrator.physics.threshold import LAWS_OF, PAPER, Threshold, weight
from orchestrator.physics.threshold import threshold as threshold_of
from orchestrator.report import style
from orchestrator.report.page import Section
from orchestrator.report.style import Figure
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.types import FloatArray

FOLDER = Path(__file__).with_name("measured")
TITLE = "The model against measurements"
MOVED = 0.1
"""Part of the exposed grains that has moved at the threshold of a bed."""
INTENSITY, EVENTS = 0.4, 100
"""Of the gusts: intensity of the wall stress, and one event in so many."""
GALILEO = np.geomspace(0.3, 1e5, 12)
SLOPES = np.array([0.0, 0.1, 0.2, 0.3, 0.4])
"""Tangents of beds that fall with the flow."""
ROUGH = 1e4
"""Galileo number at which the effect of the slope is found."""
FREE = 5000.0
"""Particle Reynolds number of the spheres whose drag was measured, about."""
PERCENTILES = np.array([10.0, 25.0, 50.0, 75.0, 90.0])
ENOUGH = 1.5
"""Factor over all sets within which a model would be made the default."""
LEVEL = 0.01
"""Slope below which a bed is drawn as a level one."""
WINDWARD = (0.095, 0.605)
"""Part of the hump's chord on which its stress is compared: from its steep front to its brink."""
LAID = 40
"""Test grains that are laid on each strip for their pivots."""


class Model(NamedTuple):
    """A model: its name, the fields of a scene that it sets, and the stress of its gusts."""

    name: str
    fields: Fields
    gust: float = 1.0


LONE = {"forces.exposure": "protrusion"}
BALANCED = {"forces.exposure": "protrusion", "forces.sheltering": "balanced"}
MODELS = (
    Model("paper", {"forces.law": PAPER}),
    Model("bridged", {}),
    Model("bridged, protrusion", LONE),
    Model("balanced", BALANCED),
    Model("balanced, gusts", BALANCED, peak_over_mean(INTENSITY, EVENTS)),
)
COLOURS = ("#009e73", "#999999", "#56b4e9", "#e69f00", "#d55e00")


@dataclass(frozen=True)
class Strips:
    """Level strips of sand; `scenes` differ in their seeds alone."""

    scenes: Sequence[Scene]
    cases: Path

    def geometries(self, fields: Fields, galileo: float, bond: float = 0.0) -> list[Geometry]:
        """The strips under a model at a Galileo number, with a pull of contacts over the weight."""
        first = self.scenes[0]
        d, excess = first.grain.diameter, first.grain.density / first.fluid.density - 1
        viscosity = float(np.sqrt(excess * first.fluid.gravity * d**3) / galileo)
        cohesion = bond * first.weight / d
        changes = {**fields, "fluid.viscosity": viscosity, "grain.cohesion": cohesion}
        return [Geometry(changed(scene, changes), self.cases) for scene in self.scenes]

    def grains(
        self, fields: Fields, galileo: float, slope: float = 0.0, bond: float = 0.0
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Of each strip, Shields number at which each counted grain moves by its pivot, and size.

        The bed falls with the flow by a slope (a tangent): the strip and its forces are turned.
        """
        angle = np.arctan(slope)
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        answers = []
        for bed in self.geometries(fields, galileo, bond):
            packed, scene, loads = bed.packing, bed.scene, bed.loads(self.cases)
            loading = loads.loading
            places = Places.of(packed.centres @ turn.T, packed.across, packed.width)
            ways = {"along": loading.along @ turn.T, "outward": loading.outward @ turn.T}
            ratio = np.where(packed.windward, loading.ratio, 0.0)
            turned = replace(loading, ratio=ratio, **ways)
            ustar = peeling.pivots(places, packed.sizes, turned, loads.tables, scene.bond)
            excess = (scene.grain.density - scene.fluid.density) * scene.fluid.gravity
            unit = excess * scene.grain.diameter / scene.fluid.density
            answers.append((ustar[packed.windward] ** 2 / unit, packed.sizes[packed.windward]))
        return answers

    def shields(self, fields: Fields, galileo: float, slope: float = 0, bond: float = 0) -> float:
        """Threshold at which `MOVED` of the grains have moved, geometric mean of the strips.

        Grains that the bed's slope alone sets in motion have gone before the flow begins.
        """
        every = (theta for theta, _ in self.grains(fields, galileo, slope, bond))
        strips = [np.sort(theta[theta > 0]) for theta in every]
        least = [each[max(int(np.ceil(MOVED * len(each))) - 1, 0)] for each in strips]
        return float(np.exp(np.mean(np.log(least))))

    def level(self, fields: Fields) -> Callable[[FloatArray, FloatArray], FloatArray]:
        """The threshold of a bed as a function of the Galileo number and of its slope."""
        values = np.log([self.shields(fields, float(galileo)) for galileo in GALILEO])
        steep = np.array([self.shields(fields, ROUGH, float(slope)) for slope in SLOPES])
        factor = steep / steep[0]

        def shields(galileo: FloatArray, slope: FloatArray) -> FloatArray:
            flat = np.exp(np.interp(np.log(galileo), np.log(GALILEO), values))
            return np.asarray(flat * np.interp(slope, SLOPES, factor))

        return shields

    def pivots_deg(self) -> FloatArray:
        """Percentiles of the pivots of grains of d that are laid on the strips, degrees."""
        beds = self.geometries({}, ROUGH)
        angles = [laid(bed.packing, LAID, bed.bed.seed) for bed in beds]
        return np.asarray(np.nanpercentile(np.concatenate(angles), PERCENTILES))

    def hiding(self, fields: Fields) -> float:
        """Exponent g of theta_i ~ (D_i/D_50)^-g over the classes of the mixture."""
        every, sizes = map(np.concatenate, zip(*self.grains(fields, ROUGH), strict=True))
        own = every / sizes
        held = own > 0
        classes = [(size, held & chosen) for _, size, chosen in threshold.classes(sizes)]
        kept = [(size, np.quantile(own[at], MOVED)) for size, at in classes if at.sum() >= 20]
        size, theta = np.log(np.array(kept)).T
        return float(-np.polyfit(size, theta, 1)[0])


def laid(packed: Packing, count: int, seed: int = 0) -> FloatArray:
    """Pivot angles downstream (degrees) of grains of d laid on a strip, where they come to rest.

    Each rolls down the surface that its centre can reach, in random directions and ever shorter
    steps, until it lies on three grains.
    """
    width, rng = packed.width, np.random.default_rng(seed)
    xyz, reach = packed.places.xyz, (packed.sizes + 1) / 2

    def height(x: FloatArray, y: FloatArray) -> FloatArray:
        across = (y[:, None] - xyz[:, 1] + width / 2) % width - width / 2
        under = reach**2 - (x[:, None] - xyz[:, 0]) ** 2 - across**2
        on = xyz[:, 2] + np.sqrt(np.maximum(under, 0.0))
        return np.asarray(np.where(under > 0, on, -np.inf).max(axis=1))

    first, last = np.quantile(xyz[packed.windward, 0], [0.1, 0.9]).tolist()
    x, y = rng.uniform(first, last, count), rng.uniform(0, width, count)
    now = height(x, y)
    for step in np.geomspace(0.1, 1e-6, 20).repeat(80):
        way = rng.uniform(0, 2 * np.pi, count)
        to_x, to_y = x + step * np.cos(way), y + step * np.sin(way)
        falls = (to := height(to_x, to_y)) < now
        x, y, now = np.where(falls, to_x, x), np.where(falls, to_y, y), np.where(falls, to, now)
    sizes, along = np.append(1.0, packed.sizes), np.tile([1.0, 0.0], (len(packed.sizes) + 1, 1))
    grains = (Places(np.vstack([one, xyz]), width) for one in np.column_stack([x, y % width, now]))
    each = [peeling.pivot_angles_deg(places, sizes, along, only=0)[0] for places in grains]
    return np.array(each)


def sphere(fields: Fields, galileo: float, *, clear: bool) -> float:
    """Threshold of a sphere on a close-packed layer of equal ones, or level with them.

    The one on the layer rolls over the saddle between two, the other out of a pocket of 30 deg.
    """
    rows, columns, d, nu = 8, 20, 1.0, 1.0
    x, y = np.meshgrid(np.arange(columns) + 0.0, np.arange(rows) * np.sqrt(3) / 2)
    x = x + np.where(np.arange(rows)[:, None] % 2, 0.5, 0.0)
    flat = np.vstack([[columns / 2 + 0.5, np.sqrt(3) / 6], np.column_stack([x.ravel(), y.ravel()])])
    height = np.append(np.sqrt(2 / 3) if clear else 0.0, np.zeros(rows * columns))
    every = np.ones(len(flat), bool)
    centres, width = np.column_stack([flat[:, 0], height]), rows * np.sqrt(3) / 2
    ones = np.ones(len(flat))
    packing = Packing(centres, ones, every, every, ~every, flat[:, 0], flat[:, 1], width)
    law, fluid, gaps = LAWS["bridged-gravel"], (d / 30, 1.0, nu), d / 30 + height
    submerged, unit = np.pi / 6 * galileo**2, galileo * 0.2

    def drag(ustar: FloatArray, sizes: FloatArray, over: FloatArray) -> FloatArray:
        return law.drag(ustar, Exposure(sizes, *fluid, gap=over))

    level: Callable[[FloatArray], FloatArray] = np.zeros_like
    if fields.get("forces.sheltering") == "balanced":
        patch, areas = sheltering.patches(packing, 1.0)
        given = {"diameter": d, "unit": unit, "density": 1.0}
        shelter = sheltering.balanced(drag, patch, ones, gaps, areas, **given)
        level = partial(shelter.level, patch=patch[0])
    raised = gaps[0] if "forces.exposure" in fields else d / 30

    def around(ustar: FloatArray) -> Exposure:
        return Exposure(d, *fluid, gap=raised - level(ustar))

    drags, lifts = (lambda u: law.drag(u, around(u)), lambda u: law.lift(u, around(u)))
    ustar = unit * np.geomspace(*RANGE, PLACES)
    (table,) = ForceTable.of(drags, lifts, np.array([submerged]), ustar)
    pivot = np.arctan(np.sqrt(1 / 8)) if clear else np.radians(30)
    return float(table.reaching(np.cos(pivot), np.sin(pivot), np.sin(pivot)) ** 2 / galileo**2)


def speed_of(density: float, tangent: float) -> float:
    """Speed of water (m/s) next to a sphere of 8 mm whose drag balances its pivot."""
    d, at = 8e-3, Exposure(8e-3, 1e-4, 1000.0, 1e-6)
    goal = weight(diameter=d, density=density, fluid_density=1000.0) * tangent
    speeds = np.geomspace(0.01, 1.0, 2001)
    return float(np.interp(goal, CLIFT_GAUVIN.force(speeds, at), speeds))


def by_paper(beds: pd.DataFrame) -> FloatArray:
    """Threshold of a single grain by Eq. 2 or Eq. 4, where one holds; NaN in the transition."""
    answers = []
    for name in LAWS_OF["transition"]:
        at, (low, high) = single(beds, name), LAWS[name].reynolds
        answers.append(np.where((at.reynolds >= low) & (at.reynolds < high), at.shields, np.nan))
    return np.asarray(np.fmax(*answers))


def single(beds: pd.DataFrame, law: str, beta_deg: float = 60, ratio: float = 30) -> Threshold:
    """Thresholds of single grains of the diameters of some beds, with z0 = d/ratio."""
    names = ("d_m", "rho_f_kg_m3", "nu_m2_s", "rho_sol_kg_m3", "slope", "cohesion_n_m")
    d, fluid, nu, density, slope, cohesion = (beds[name].to_numpy(float) for name in names)
    grain = {"density": density, "slope_deg": -np.degrees(np.arctan(slope)), "cohesion": cohesion}
    around = Exposure(d, d / ratio, fluid, nu)
    return threshold_of(LAWS[law], around, entrainment_angle_deg=beta_deg, **grain)


def over_hump(stress: WallStress) -> pd.DataFrame:
    """Measured and computed stress on the windward side of the hump, each over its own mean."""
    hump = pd.read_csv(FOLDER / "hump_stress.csv")
    hump = hump[hump["x_over_chord"].between(*WINDWARD)]
    chord = pd.read_csv(FOLDER / "hump.csv")["x_m"].max()
    tau = np.interp(hump["x_over_chord"] * chord, stress.x_m, stress.tau_wall)
    rows = pd.DataFrame({"measured": hump["cf"] / hump["cf"].mean(), "value": tau / tau.mean()})
    source = "Naughton, Viken and Greenblatt 2006"
    return rows.assign(set="stress over a hump", source=source, sure="read")


def compared(strips: Strips, hump: pd.DataFrame, lengths: Mapping[str, float]) -> pd.DataFrame:
    """A row for each measurement and model: set, source, measured value, that of the model.

    The stress over the `hump`, and the `lengths` of reversed flow, are alike in all models.
    """
    beds = pd.read_csv(FOLDER / "beds.csv").rename(columns={"shields": "measured"})
    excess = beds["rho_sol_kg_m3"] / beds["rho_f_kg_m3"] - 1
    galileo = np.sqrt(excess * GRAVITY * beds["d_m"] ** 3) / beds["nu_m2_s"]
    density = {"density": beds["rho_sol_kg_m3"], "fluid_density": beds["rho_f_kg_m3"]}
    bond = beds["cohesion_n_m"] * beds["d_m"] / weight(diameter=beds["d_m"], **density)
    beds = beds.assign(galileo=galileo, sure="read")
    single = pd.read_csv(FOLDER / "single.csv")
    pivots = pd.DataFrame({"measured": kirchner_pivot(PERCENTILES), "value": strips.pivots_deg()})
    pivots = pivots.assign(set="pivots of laid grains", source="Kirchner et al. 1990", sure="read")
    by_all = {
        "saddle": speed_of(2500.0, 0.354),
        "top": speed_of(1430.0, 0.707),
        "drag": float(24 / FREE * CLIFT_GAUVIN.factor(np.array(FREE))),
        **lengths,
    }
    rows = []
    for name, fields, gust in MODELS:
        if gust == 1:  # the model with gusts follows on the same one without: a part of its stress
            clear, level = (sphere(fields, ROUGH, clear=clear) for clear in (True, False))
            if name == PAPER:
                steady, hiding = by_paper(beds), np.nan
            else:
                steady = strips.level(fields)(galileo.to_numpy(), beds["slope"].to_numpy())
                for place in np.flatnonzero(bond):
                    steady[place] = strips.shields(fields, galileo[place], bond=bond[place])
                hiding = strips.hiding(fields)
        known = {**by_all, "clear": clear / gust, "level": level / gust, "hiding": hiding}
        alone = single.assign(value=single["what"].map(known))
        parts = [beds.assign(value=steady / gust), alone, pivots, hump]
        rows += [part.assign(model=name) for part in parts]
    table = pd.concat(rows, ignore_index=True)
    return table.assign(ratio=table["value"] / table["measured"])


def scores(rows: pd.DataFrame) -> pd.DataFrame:
    """For each set and model: rows, median ratio, its 10 to 90 %, factor in the median, worst.

    A factor is the ratio or its inverse, whichever is above 1. Rows from memory count in no score.
    """
    read = rows[rows["sure"] == "read"]
    # a value of the wrong sign has no factor
    factor = np.exp(np.abs(np.log(read["ratio"].where(read["ratio"] > 0))))
    groups = read.assign(factor=factor).groupby(["set", "model"], sort=False)
    ratio = groups["ratio"]
    return pd.DataFrame(
        {
            "rows": ratio.size(),
            "answered": ratio.count(),
            "ratio": ratio.median(),
            "ratio_10": ratio.quantile(0.1),
            "ratio_90": ratio.quantile(0.9),
            "factor": groups["factor"].median(),
            "worst": groups["factor"].max(),
        }
    ).reset_index()


def experiment(study: Study, out: Path) -> Experiment:
    """Answer what was measured, on the strips, the hill and the hump of a study."""
    strips = [scene for scene in study.scenes if scene.is_poured]
    forms = {
        "hill": [scene for scene in study.scenes if getattr(scene.bed, "shape", "") == "rushil"],
        "hump": [scene for scene in study.scenes if getattr(scene.bed, "profile", None)],
    }
    if not strips or any(len(scenes) != 1 for scenes in forms.values()):
        what = "it needs poured strips, one hill of RUSHIL and one profile, the hump"
        raise InputError(what, study.name, "start from the preset validate")
    asked = {scene.id: as_asked(scene) for scene in study.scenes}
    planned = plan.of(asked, cases=out.absolute() / "cases")

    def results(runs: Runs) -> Results:
        if not runs.are_done(*asked):
            return {}, ()
        lengths = dict[str, float]()
        for name, (scene,) in forms.items():
            pile = planned.piles[scene.id]
            stress = pile.stress(runs.cases)
            start, end = bubble(stress, pile.model.line.h) or (np.nan, np.nan)
            lengths |= {f"{name}, separation": start, f"{name}, reattachment": end}
        rows = compared(Strips(strips, runs.cases), over_hump(stress), lengths)
        return {"measured": rows, "scores": (scored := scores(rows))}, _sections(rows, scored)

    limit_s = study.time_limit_s
    return Experiment("validate", TITLE, planned, results, limit_s, source=study.source)


def _sections(rows: pd.DataFrame, scored: pd.DataFrame) -> list[Section]:
    words = TEXTS["validate"]
    chart = Figure("factors", "Model over measurement", words["factors"], (), factors(scored))
    points = Figure("shields", "Thresholds of level beds", words["shields"], (), diagram(rows))
    # flows and drags that all models share say nothing of which is nearer
    differ = scored.groupby("set")["factor"].transform("nunique") > 1
    every = scored[differ].groupby("model", sort=False)["factor"].median()
    every = every.rename("median of the sets in which they differ")
    least, better = float(every.min()), every.idxmin()
    ends = "The default model is kept: none is within." if least > ENOUGH else ""
    said = f"Of {len(every)} models “{better}” is nearest to the measurements, off by a factor of"
    said += f" {least:.2f} in the median of their sets; asked is {ENOUGH:g}. {ends}"
    wide = scored.pivot(index="set", columns="model", values="factor").reset_index()
    summary = [every.reset_index(), wide[["set", *(model.name for model in MODELS)]]]
    memory = rows[(rows["sure"] != "read") & (rows["model"] == MODELS[-1].name)]
    memory = memory[["set", "source", "measured", "value", "ratio"]]
    return [
        Section("", said),
        Section("Model over measurement", words["sets"], (chart,), summary),
        Section("Thresholds", words["thresholds"], (points,), [scored]),
        Section("From memory", words["memory"], (), [memory]),
    ]


def factors(scored: pd.DataFrame) -> Canvas:
    """The ratio of each model to each set: median, and 10 to 90 % of the rows."""
    sets = list(dict.fromkeys(scored["set"]))
    canvas = style.canvas(0.42 * len(sets) + 1.0)
    ax = canvas.subplots()
    for number, (model, colour) in enumerate(zip(MODELS, COLOURS, strict=True)):
        part = scored[scored["model"] == model.name]
        y = [sets.index(name) + 0.18 * (number - (len(MODELS) - 1) / 2) for name in part["set"]]
        ax.hlines(y, part["ratio_10"], part["ratio_90"], color=colour, lw=2.5, alpha=0.5)
        ax.plot(part["ratio"], y, "o", color=colour, label=model.name)
    ax.axvline(1.0, color="0.2", lw=0.8)
    ax.axvspan(1 / ENOUGH, ENOUGH, color="0.93", zorder=0)
    ax.set_xscale("log")
    style.plain_ticks(ax.xaxis)
    counts = scored.groupby("set")["rows"].first()
    ax.set_yticks(range(len(sets)), [f"{name} ({counts[name]})" for name in sets])
    ax.invert_yaxis()
    ax.set_xlabel("model over measurement")
    style.legends(canvas, ax.get_lines()[: len(MODELS)], [])
    return canvas


def diagram(rows: pd.DataFrame) -> Canvas:
    """Measured thresholds of level beds over the Galileo number, and the models' curves."""
    canvas = style.canvas(3.6)
    ax = canvas.subplots()
    level = rows[rows["galileo"].notna() & (rows["slope"] < LEVEL) & (rows["cohesion_n_m"] == 0)]
    for name, mark in zip(dict.fromkeys(level["set"]), "osv^D", strict=False):
        part = level[(level["set"] == name) & (level["model"] == MODELS[0].name)]
        ax.plot(part["galileo"], part["measured"], mark, ms=3, color="0.6", label=name)
    for model, colour in zip(MODELS, COLOURS, strict=True):
        part = level[level["model"] == model.name].sort_values("galileo")
        ax.plot(part["galileo"], part["value"], color=colour, label=model.name)
    ax.set(xscale="log", yscale="log", xlabel="Galileo number", ylabel="Shields number $θ$")
    style.plain_ticks(ax.yaxis)
    style.legends(canvas, [], ax.get_lines())
    return canvas
