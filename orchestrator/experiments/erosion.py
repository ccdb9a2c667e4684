"""What wind takes from a stockpile: the solved stress on its surface beside AP-42, section 13.2.5.

Between two disturbances a surface loses its erosion potential P, which the fastest mile of
that time decides (U.S. EPA, Industrial Wind Erosion, 2006). AP-42 has classes of u_s/u_r,
the speed 25 cm above a pile over that at 10 m, from a wind tunnel (Billman and Arya,
EPA/600/S3-85/059).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import log
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from numpy.typing import ArrayLike

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.experiments.experiment import TEXTS, Experiment, Results, Runs, piles
from orchestrator.fidelity import limits
from orchestrator.flow.model import FlowModel
from orchestrator.physics.threshold import thresholds_of
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.report import labels, style
from orchestrator.report.flows import USTAR
from orchestrator.report.page import Section
from orchestrator.report.style import Figure
from orchestrator.study import fields
from orchestrator.study.closed_form import single_grain
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.types import FloatArray, Row

MEASURED = Path(__file__).parent / "measured"
AREAS = pd.read_csv(MEASURED / "ap42_areas.csv", keep_default_na=False)
MATERIALS = pd.read_csv(MEASURED / "ap42_thresholds.csv", keep_default_na=False)
USTAR_T = dict(zip(MATERIALS["material"], MATERIALS["ustar_m_s"], strict=True))
CLASSES = np.unique(AREAS["us_over_ur"])
WIND_HEIGHT = 10.0  # of the fastest mile and of u_r, m
OVER_FLAT = log(WIND_HEIGHT / 0.005) / log(0.25 / 0.005)
"""u*/u*_0 over u_s/u_r, by the log laws of both heights over a roughness length of 5 mm."""
PILE, FLAT = 0.10, 0.053
"""AP-42: u* over u_s on a pile, and over the wind on flat ground."""
FLAT_BELOW = 0.2  # height over base below which AP-42 takes a pile for flat ground
LEVEL_DEG = 5.0  # slope up to which a surface is neither windward nor lee
GROUND = 0.01  # height of the bed over the pile's up to which it is the ground around
IN_NAME = {"bed_shape", "profile", "h_m", "alpha_deg", "solve_z0_m", "obstacles"}
"""Columns of a scene that the name of its pile, or of its surface, has in any case."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
"""Colours of the surfaces of a pile in the figure."""
LINES = ("-", "--", "-.", ":")
"""Line styles of the four piles of AP-42."""
GREY = "0.3"
DRAWN = 4  # most piles of the figure


class Surface(NamedTuple):
    """The surface of a pile in the columns `part`, `share` and `ratio` of its faces.

    The ratio is the friction velocity |u*| over that of the undisturbed flow. `name` says
    what the surface has on it: its obstacles, or that it is one of AP-42's.
    """

    name: str
    faces: pd.DataFrame
    ustar0_over_wind: float
    threshold: float  # u*_t, m/s

    def potential(self, winds: ArrayLike) -> FloatArray:
        """Erosion potential, mean of the surface, in winds at 10 m (m/s), g/m2.

        AP-42, Eq. 3: P = 58 (u* - u*_t)^2 + 25 (u* - u*_t), 0 where u* is below u*_t.
        """
        ratio = self.faces["ratio"].to_numpy()
        share = self.faces["share"].to_numpy()
        ustar = np.multiply.outer(winds, self.ustar0_over_wind * ratio)
        excess = np.maximum(ustar - self.threshold, 0)
        lost = 58 * excess**2 + 25 * excess
        return np.asarray(lost @ (share / share.sum()))

    def total(self, winds: ArrayLike) -> float:
        """Erosion potential of several winds, one after another, g/m2."""
        return float(self.potential(winds).sum())


@dataclass(frozen=True)
class Pile:
    """A pile with the surfaces that it has without and with obstacles, at least one.

    They are alike in everything else: shape, grains, flow and how that is solved. The
    surface without an obstacle comes first, if there is one. `is_flat` says whether AP-42
    takes the pile for flat ground.
    """

    name: str
    surfaces: Sequence[Surface]
    is_flat: bool
    has_bare: bool

    @property
    def by_epa(self) -> list[Surface]:
        """The surfaces by which AP-42 answers it: flat ground, or the four piles measured."""
        threshold = self.surfaces[0].threshold
        if self.is_flat:
            faces = AREAS[:1].assign(part="all", ratio=1.0)
            return [Surface("AP-42, flat ground", faces, FLAT, threshold)]
        every = AREAS.assign(part="all", ratio=OVER_FLAT * AREAS["us_over_ur"])
        found = []
        for name, faces in every.groupby("pile"):
            found.append(Surface(f"AP-42, {name}", faces, PILE / OVER_FLAT, threshold))
        return found


def without_obstacles(scene: Scene) -> Scene:
    """The scene of a pile with nothing on it: piles of one such scene may be compared."""
    bed = scene.bed.model_copy(update={"obstacles": ()})
    parts = {name: getattr(scene, name) for name in Scene.model_fields}
    return Scene.model_construct(**{**parts, "bed": bed})


def names_of(scenes: Sequence[Scene]) -> list[str]:
    """A name for each of some different piles, from what tells it from the others."""
    table = pd.DataFrame([fields.asked(scene) for scene in scenes])
    differing = [name for name in table if table[name].nunique(dropna=False) > 1]
    apart = set(differing) - {*IN_NAME, *fields.TWINS}
    columns = [column for column in fields.COLUMNS if column in apart]
    found: list[str] = []
    for scene, (_, row) in zip(scenes, table.iterrows(), strict=True):
        bed = scene.bed
        assert isinstance(bed, PileBed)
        words = [str(bed.profile.name if bed.profile else bed.shape)]
        if _rises(bed):
            height = FlowModel(scene).line.h
            words += [f"{height:g} m high", f"{bed.slope_deg:g}°"]
        words.append(f"z₀ {1e3 * scene.solve_roughness:g} mm")
        words += labels.told(row, columns)
        name = ", ".join(words)
        # fields that are in no table tell them apart
        same = sum(other.partition(" (pile ")[0] == name for other in found)
        found.append(f"{name} (pile {same + 1})" if same else name)
    return found


def solved(scene: Scene, threshold: float | None, cases: Path) -> Surface:
    """The surface of a pile by its flow.

    Parameters
    ----------
    scene
        The scene of the pile.
    threshold
        u*_t, m/s; None for that of its grain on a level bed, by the closed form.
    cases
        The directory of the finished runs.

    Returns
    -------
    The surface; its faces have the columns ``x_m`` and ``z_m`` as well.
    """
    bed = scene.bed
    assert isinstance(bed, PileBed)
    line = FlowModel(scene).line
    stress = FlowModel(scene).stress(cases)
    x, z = stress.x_m, stress.z_m
    is_on = (x > line.x[1]) & (x < line.x[-2])
    if _rises(bed):
        is_on &= z > GROUND * line.h
    for start, end in line.bare:
        is_on &= (x < start) | (x > end)
    segment = np.searchsorted(line.x, x) - 1
    slope = line.slopes_deg[np.clip(segment, 0, len(line.x) - 2)]
    part = np.select(
        [slope > LEVEL_DEG, slope < -LEVEL_DEG], ["windward", "lee"], "top"
    )
    columns = {
        "x_m": x,
        "z_m": z,
        "part": part,
        "share": stress.length_m,
        "ratio": np.abs(stress.ustar_over_ustar0_wall),
    }
    faces = pd.DataFrame(columns)[is_on]
    if threshold is None:
        level = single_grain(scene)._replace(slope_deg=0)
        (own,) = thresholds_of(scene.forces.law, [level])
        threshold = float(own.friction_velocity)
    over_wind = float(log_law_ustar(1.0, WIND_HEIGHT, scene.solve_roughness))
    name = " and a ".join(map(str, bed.obstacles)) or "no obstacle"
    return Surface(name, faces, over_wind, threshold)


def _rises(bed: PileBed) -> bool:
    """Whether a bed has a form on it, and is not flat ground."""
    return bool(bed.profile) or bed.form.rises


def grouped(
    scenes: Sequence[Scene], threshold: float | None, cases: Path
) -> list[Pile]:
    """The piles of some scenes whose flows are done, each without and with its obstacles."""
    alike: dict[Scene, list[Scene]] = {}
    for scene in scenes:
        alike.setdefault(without_obstacles(scene), []).append(scene)
    found = []
    for (bare, members), name in zip(alike.items(), names_of([*alike]), strict=True):
        bed = bare.bed
        assert isinstance(bed, PileBed)
        # a scene without obstacles is the first one, whatever the order of the file
        first_bare = sorted(members, key=lambda scene: scene != bare)
        surfaces = [solved(scene, threshold, cases) for scene in first_bare]
        line = FlowModel(bare).line
        base = _base(line.x, line.z, line.h)
        is_flat = not _rises(bed) or line.h < FLAT_BELOW * base
        found.append(Pile(name, surfaces, is_flat, bare in members))
    return found


def _base(x: Sequence[float], z: Sequence[float], height: float) -> float:
    """Length of a bed line between where it first and last stands above the ground, m."""
    places = np.linspace(x[1], x[-2], 10_001)
    above = places[np.interp(places, x, z) > GROUND * height]
    return float(np.ptp(above)) if len(above) else 0.0


def experiment(study: Study, out: Path) -> Experiment:
    """The erosion potential of the piles of a study, by the solved flow and by AP-42.

    Raises
    ------
    InputError
        If the threshold is neither a number that a wind can reach nor a material of AP-42,
        if the study has no pile, or if the flow over one cannot be solved.
    """
    winds, asked = study.erosion.fastest_mile, study.erosion.threshold
    where = study.file or study.name
    least = USTAR_T.get(asked, -1.0) if isinstance(asked, str) else asked
    if least is not None and not 0 < least <= 10:
        remedy = f"a value in m/s up to 10, or one of: {', '.join(USTAR_T)}"
        raise InputError(
            f"{asked!r} is not accepted", f"{where}: erosion.threshold", remedy
        )
    source = ""
    if isinstance(asked, str):
        source = f" (AP-42, {asked})"
    elif asked is None:
        source = " (closed form)"
    flows = {scene: FlowModel(scene) for scene in piles(study)}
    for scene in flows:
        limits.check(scene, where, grains=False)

    def results(runs: Runs) -> Results:
        done = []
        for scene, flow in flows.items():
            if all(run.name in runs.done for run in flow.cases):
                done.append(scene)
        if not done:
            return {}, ()
        found = grouped(done, least, runs.cases)
        words = TEXTS["erosion"]
        table = rows(found, winds)
        caption = words["figure"]
        if len(found) > DRAWN:
            caption += f" The first {DRAWN} of {len(found)} piles are drawn."
        drawing = picture(found[:DRAWN], winds)
        figure = Figure("erosion", "Stress and loss", caption, (), drawing)
        told = "\n\n".join([*sentences(found, winds, source), words["sure"]])
        return {"erosion": table}, [
            Section("", told, [figure]),
            Section("Parts", words["rows"], (), [table], words["limits"].split("\n\n")),
            Section("The tables of AP-42", words["sources"], (), [AREAS, MATERIALS]),
        ]

    every = plan.listed(run for flow in flows.values() for run in flow.cases)
    planned = plan.Plan({}, {}, (), {}, every)
    limit_s = study.time_limit_s
    return Experiment(
        "erosion", study.title, planned, results, limit_s, source=study.source
    )


def rows(found: Sequence[Pile], winds: ArrayLike) -> pd.DataFrame:
    """A row for each part of each surface of each pile, those of AP-42 after the solved ones.

    It has the part's share of the surface, P, u*/u*_0, its largest value, and the share of
    the whole surface that is nearest to each class of AP-42.
    """
    listed = []
    for pile in found:
        for surface in (*pile.surfaces, *pile.by_epa):
            whole = surface.faces["share"].sum()
            # the surfaces of AP-42 are whole
            by_part = {"all": surface.faces}
            for name, part_of in surface.faces.groupby("part", sort=False):
                by_part[str(name)] = part_of
            for part, faces in by_part.items():
                row: Row = {"pile": pile.name, "surface": surface.name, "part": part}
                row["u*ₜ, m/s"] = surface.threshold
                ratio = faces["ratio"].to_numpy()
                share = 100 * faces["share"].to_numpy() / whole
                row["share, %"] = share.sum()
                row["P, g/m²"] = surface._replace(faces=faces).total(winds)
                row["u*/u*₀"] = np.average(ratio, weights=share)
                row["largest"] = ratio[share > 0].max()
                apart = np.abs(ratio[:, None] - OVER_FLAT * CLASSES)
                shares = np.bincount(apart.argmin(axis=1), share, len(CLASSES))
                for us, near in zip(CLASSES, shares, strict=True):
                    row[f"{us:g} ({OVER_FLAT * us:.2f}), %"] = near
                listed.append(row)
    return pd.DataFrame(listed)


def sentences(
    found: Sequence[Pile], winds: Sequence[float], source: str
) -> Iterator[str]:
    """The answer in words: each pile by both, and what its obstacles take away."""
    speeds = ", ".join(map("{:g}".format, winds))
    for pile in found:
        first, *others = pile.surfaces
        lost = first.total(winds)
        epa = [surface.total(winds) for surface in pile.by_epa]
        ends = " to ".join(dict.fromkeys(f"{end:.3g}" for end in (min(epa), max(epa))))
        with_what = first.name if pile.has_bare else f"with {_named(first)}"
        by_epa = "by AP-42, to which it is flat ground," if pile.is_flat else "by AP-42"
        told = (
            f"Wind of {speeds} m/s at 10 m can take {lost:.3g} g/m² from the surface of a pile "
            f"({pile.name}; {with_what}), {by_epa} {ends} g/m². Its threshold u*ₜ is "
            f"{first.threshold:.3g} m/s{source}."
        )
        for other in others:
            left = other.total(winds)
            # obstacles are compared with none, not with one another
            change = f" ({left / lost - 1:+.0%})" if lost and pile.has_bare else ""
            told += f" With {_named(other)}: {left:.3g} g/m²{change}."
        yield told


def _named(surface: Surface) -> str:
    """The obstacles of a surface with an article, such as "a fence of 2 m at -3 m"."""
    return f"a {surface.name}"


def picture(found: Sequence[Pile], winds: Sequence[float]) -> Canvas:
    """A row for each pile: u*/u*_0 over it, its share of the surface, P over the wind."""
    canvas = style.canvas(2.3 * len(found) + 1.0)
    grid = canvas.subplots(len(found), 3, squeeze=False, width_ratios=[1.3, 1, 1])
    for axes, pile in zip(grid, found, strict=True):
        _draw(axes, pile, winds)
    style.legends(canvas, [], style.samples(grid[:, 1].tolist()))
    return canvas


def _draw(axes: Sequence[Axes], pile: Pile, winds: Sequence[float]) -> None:
    """Draw the row of one pile: three panels."""
    left, middle, right = axes
    axis = np.linspace(0, 1.4 * max(winds), 141)
    for number, surface in enumerate(pile.surfaces):
        colour = COLOURS[number % len(COLOURS)]
        _draw_shares(middle, surface, colour, "-")
        right.plot(axis, surface.potential(axis), color=colour)
        left.plot(
            surface.faces["x_m"], surface.faces["ratio"], ".", ms=2.5, color=colour
        )
    for surface, line_style in zip(pile.by_epa, LINES, strict=False):
        _draw_shares(middle, surface, GREY, line_style)
        right.plot(axis, surface.potential(axis), color=GREY, ls=line_style)
    bed = left.twinx()
    x, z = pile.surfaces[0].faces[["x_m", "z_m"]].to_numpy().T
    bed.fill_between(x, z, color=style.BED, lw=0)
    bed.set(ylim=(0, 4 * (z.max() or 1)), yticks=[])
    middle.set(xlim=(0, 100), ylim=(0, None), xlabel="share of the surface above, %")
    left.set(
        zorder=1, frame_on=False, ylim=middle.get_ylim(), xlabel="x, m", ylabel=USTAR
    )
    left.set_title(pile.name, loc="left")
    right.set(xlim=(0, axis[-1]), ylim=(0, None), xlabel="wind at 10 m, m/s")
    right.set_title("P, g/m² of surface", loc="left")
    right.vlines(winds, 0, right.get_ylim()[1], color="0.7", lw=0.8, zorder=0)


def _draw_shares(ax: Axes, surface: Surface, colour: str, line_style: str) -> None:
    """Draw u*/u*_0 over the share of the surface where it is larger."""
    faces = surface.faces.sort_values("ratio", ascending=False)
    above = 100 * faces["share"].cumsum() / faces["share"].sum()
    first = faces["ratio"].max()
    x = [0, *above]
    y = [first, *faces["ratio"]]
    ax.step(x, y, color=colour, ls=line_style, label=surface.name)
