"""What wind takes from a stockpile: the solved stress on its surface beside AP-42, section 13.2.5.

Between two disturbances a surface loses its erosion potential P, which the fastest mile of that
time decides (U.S. EPA, Industrial Wind Erosion, 2006). AP-42 has classes of u_s/u_r, the speed
25 cm above a pile over that at 10 m, from a wind tunnel (Billman and Arya, EPA/600/S3-85/059).
"""

from collections.abc import Iterator, Sequence
from itertools import groupby
from math import log
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas
from numpy.typing import ArrayLike

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.experiments.experiment import TEXTS, Experiment, Results, Runs, piles
from orchestrator.fidelity import limits
from orchestrator.flow.model import FlowModel
from orchestrator.physics.threshold import thresholds_of
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.report import style
from orchestrator.report.flows import USTAR
from orchestrator.report.page import Section
from orchestrator.report.style import Figure
from orchestrator.study.closed_form import single_grain
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.types import FloatArray

AREAS, MATERIALS = (
    pd.read_csv(Path(__file__).parent / "measured" / f"ap42_{name}.csv", keep_default_na=False)
    for name in ("areas", "thresholds")
)
USTAR_T = dict(zip(MATERIALS["material"], MATERIALS["ustar_m_s"], strict=True))
CLASSES = np.unique(AREAS["us_over_ur"])
WIND_HEIGHT = 10.0  # of the fastest mile and of u_r, m
OVER_FLAT = log(WIND_HEIGHT / 0.005) / log(0.25 / 0.005)  # u*/u*_0 over u_s/u_r, by the log laws
PILE, FLAT = 0.10, 0.053  # AP-42: u* over u_s on a pile, and over the wind on flat ground
FLAT_BELOW = 0.2  # height over base below which AP-42 takes a pile for flat ground
LEVEL_DEG = 5.0  # slope up to which a surface is neither windward nor lee
GROUND = 0.01  # height of the bed over the pile's up to which it is the ground around
COLOURS, LINES, GREY = ("#0072b2", "#d55e00", "#009e73", "#cc79a7"), ("-", "--", "-.", ":"), "0.3"


ALIKE = attrgetter("pile", "threshold")  # the same of surfaces that differ in obstacles alone
Groups = Sequence[Sequence["Surface"]]


class Surface(NamedTuple):
    """The surface of a pile in the columns `part`, `share` and `ratio`, |u*|/u*_0, of its faces."""

    pile: str
    obstacles: str
    faces: pd.DataFrame
    ustar0_over_wind: float
    threshold: float  # u*_t, m/s
    is_flat: bool = False  # to AP-42

    def potential(self, winds: ArrayLike) -> FloatArray:
        """P = 58 (u* - u*_t)^2 + 25 (u* - u*_t), its mean in winds at 10 m (m/s), g/m2."""
        ustar = np.multiply.outer(winds, self.ustar0_over_wind * self.faces["ratio"].to_numpy())
        excess, share = np.maximum(ustar - self.threshold, 0), self.faces["share"].to_numpy()
        return np.asarray((58 * excess**2 + 25 * excess) @ (share / share.sum()))

    def by_epa(self) -> list["Surface"]:
        """The surfaces by which AP-42 answers it: flat ground, or the four piles measured."""
        every = AREAS.assign(part="all", ratio=OVER_FLAT * AREAS["us_over_ur"])
        parts = [(str(name), faces, PILE / OVER_FLAT) for name, faces in every.groupby("pile")]
        if self.is_flat:
            parts = [("flat ground", every[:1].assign(ratio=1.0), FLAT)]
        return [Surface(f"AP-42, {n}", "none", f, over, self.threshold) for n, f, over in parts]


def solved(scene: Scene, threshold: float | None, cases: Path) -> Surface:
    """The surface of a pile by its flow; the threshold by default that of the grain, level bed."""
    bed, line, stress = scene.bed, FlowModel(scene).line, FlowModel(scene).stress(cases)
    assert isinstance(bed, PileBed)
    x, z, rises = stress.x_m, stress.z_m, bool(bed.profile) or bed.form.rises
    on = (x > line.x[1]) & (x < line.x[-2]) & ((z > GROUND * line.h) | (not rises))
    for start, end in line.bare:
        on &= (x < start) | (x > end)
    slope = line.slopes_deg[np.clip(np.searchsorted(line.x, x) - 1, 0, len(line.x) - 2)]
    part = np.select([slope > LEVEL_DEG, slope < -LEVEL_DEG], ["windward", "lee"], "top")
    faces = pd.DataFrame({"x_m": x, "z_m": z, "part": part, "share": stress.length_m})
    faces = faces.assign(ratio=np.abs(stress.ustar_over_ustar0_wall))[on]
    z0, base, level = scene.solve_roughness, float(np.ptp(x[on])), single_grain(scene)
    own = float(thresholds_of(scene.forces.law, [level._replace(slope_deg=0)])[0].friction_velocity)
    over_wind, is_flat = float(log_law_ustar(1.0, WIND_HEIGHT, z0)), line.h < FLAT_BELOW * base
    form = f"{bed.profile.name if bed.profile else bed.shape}, {line.h:g} m high"
    name = f"{form}, {bed.slope_deg:g}°, z₀ {1e3 * z0:g} mm"
    obstacles = ", ".join(map(str, bed.obstacles)) or "no obstacle"
    return Surface(name, obstacles, faces, over_wind, threshold or own, is_flat or not rises)


def experiment(study: Study, out: Path) -> Experiment:
    """The erosion potential of the piles of a study, by the solved flow and by AP-42."""
    winds, asked = study.erosion.fastest_mile, study.erosion.threshold
    where = study.file or study.name
    least = USTAR_T.get(asked, -1.0) if isinstance(asked, str) else asked
    if least is not None and not 0 < least <= 10:
        remedy = f"a value in m/s up to 10, or one of: {', '.join(USTAR_T)}"
        raise InputError(f"{asked!r} is not accepted", f"{where}: erosion.threshold", remedy)
    source = f" (AP-42, {asked})" * isinstance(asked, str) or " (closed form)" * (asked is None)
    flows = {scene: FlowModel(scene) for scene in piles(study)}
    for scene in flows:
        limits.check(scene, where, grains=False)

    def results(runs: Runs) -> Results:
        done = (s for s, flow in flows.items() if all(run.name in runs.done for run in flow.cases))
        surfaces = sorted((solved(scene, least, runs.cases) for scene in done), key=ALIKE)
        if not surfaces:
            return {}, ()
        alike = [list(each) for _, each in groupby(surfaces, ALIKE)][: len(COLOURS)]
        words, table = TEXTS["erosion"], rows(surfaces, winds)
        figure = Figure("erosion", "Stress and loss", words["figure"], (), picture(alike, winds))
        return {"erosion": table}, [
            Section("", "\n\n".join([*sentences(alike, winds, source), words["sure"]]), [figure]),
            Section("Parts", words["rows"], (), [table], words["limits"].split("\n\n")),
            Section("The tables of AP-42", words["sources"], (), [AREAS, MATERIALS]),
        ]

    every = plan.listed(run for flow in flows.values() for run in flow.cases)
    planned = plan.Plan({}, {}, (), {}, every)
    return Experiment("erosion", study.title, planned, results, study.time_limit_s)


def rows(surfaces: Sequence[Surface], winds: ArrayLike) -> pd.DataFrame:
    """A row for each part of each surface: share, P, u*/u*_0, share nearest to each class."""
    by_epa = {(each.pile, each.threshold): each for one in surfaces for each in one.by_epa()}
    found = []
    for one in (*surfaces, *by_epa.values()):
        parts = {"all": one.faces, **dict(iter(one.faces.groupby("part", sort=False)))}
        for part, faces in parts.items():
            ratio, share = faces["ratio"].to_numpy(), 100 * faces["share"].to_numpy()
            share = share / one.faces["share"].sum()
            nearest = np.abs(ratio[:, None] - OVER_FLAT * CLASSES).argmin(axis=1)
            lost = one._replace(faces=faces).potential(winds).sum()
            numbers = (share.sum(), lost, np.average(ratio, weights=share), ratio[share > 0].max())
            shares = np.bincount(nearest, share, len(CLASSES))
            found.append((one.pile, one.obstacles, part, one.threshold, *numbers, *shares))
    heads = ["pile", "obstacles", "part", "u*ₜ, m/s", "share, %", "P, g/m²", "u*/u*₀", "largest"]
    near = [f"{us:g} ({OVER_FLAT * us:.2f}), %" for us in CLASSES]
    return pd.DataFrame(found, columns=[*heads, *near])


def sentences(alike: Groups, winds: Sequence[float], source: str) -> Iterator[str]:
    """The answer in words: each pile by both, and what its obstacles take away."""
    speeds = ", ".join(map("{:g}".format, winds))
    for first, *others in alike:
        lost, *epa = (each.potential(winds).sum() for each in (first, *first.by_epa()))
        ends = " to ".join(dict.fromkeys(f"{end:.3g}" for end in (min(epa), max(epa))))
        told = (
            f"Wind of {speeds} m/s at 10 m can take {lost:.3g} g/m² from the surface of a pile "
            f"({first.pile}; {first.obstacles}), by AP-42 {ends} g/m². Its threshold u*ₜ is "
            f"{first.threshold:.3g} m/s{source}."
        )
        for one in others:
            change = f" ({one.potential(winds).sum() / lost - 1:+.0%})" if lost else ""
            told += f" With a {one.obstacles}: {one.potential(winds).sum():.3g} g/m²{change}."
        yield told


def picture(alike: Groups, winds: Sequence[float]) -> Canvas:
    """A row for each pile: u*/u*_0 over it, its share of the surface, P over the wind."""
    canvas, axis = style.canvas(2.3 * len(alike) + 1.0), np.linspace(0, 1.4 * max(winds), 141)
    grid = canvas.subplots(len(alike), 3, squeeze=False, width_ratios=[1.3, 1, 1])
    for (left, middle, right), surfaces in zip(grid, alike, strict=True):
        solves = [(one, one.obstacles, c, "-") for one, c in zip(surfaces, COLOURS, strict=False)]
        by_epa = zip(surfaces[0].by_epa(), LINES, strict=False)
        for one, label, colour, ls in (*solves, *((s, s.pile, GREY, ls) for s, ls in by_epa)):
            faces = one.faces.sort_values("ratio", ascending=False)
            above, first = (
                100 * faces["share"].cumsum() / faces["share"].sum(),
                faces["ratio"].max(),
            )
            middle.step([0, *above], [first, *faces["ratio"]], color=colour, ls=ls, label=label)
            right.plot(axis, one.potential(axis), color=colour, ls=ls)
            if colour != GREY:
                left.plot(faces["x_m"], faces["ratio"], ".", ms=2.5, color=colour)
        bed, (x, z) = left.twinx(), surfaces[0].faces[["x_m", "z_m"]].to_numpy().T
        bed.fill_between(x, z, color=style.BED, lw=0)
        bed.set(ylim=(0, 4 * (z.max() or 1)), yticks=[])
        middle.set(xlim=(0, 100), ylim=(0, None), xlabel="share of the surface above, %")
        left.set(zorder=1, frame_on=False, ylim=middle.get_ylim(), xlabel="x, m", ylabel=USTAR)
        left.set_title(surfaces[0].pile, loc="left")
        right.set(xlim=(0, axis[-1]), ylim=(0, None), xlabel="wind at 10 m, m/s")
        right.set_title("P, g/m² of surface", loc="left")
        right.vlines(winds, 0, right.get_ylim()[1], color="0.7", lw=0.8, zorder=0)
    style.legends(canvas, [], style.samples(grid[:, 1].tolist()))
    return canvas
