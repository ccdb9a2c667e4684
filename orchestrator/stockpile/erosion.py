"""What wind takes from a stockpile: the solved stress beside AP-42, section 13.2.5.

Between two disturbances a surface loses its erosion potential P, which the fastest mile
of that time decides (U.S. EPA, Industrial Wind Erosion, 2006). AP-42 has classes of
u_s/u_r, the speed 25 cm above a pile over that at 10 m, from a wind tunnel (Billman and
Arya, EPA/600/S3-85/059).
"""

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import log
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Patch
from numpy.typing import ArrayLike

from orchestrator import plan
from orchestrator.bed.line import BedLine
from orchestrator.digits import signed_percent
from orchestrator.errors import InputError
from orchestrator.experiment import (
    Experiment,
    ExperimentResults,
    Runs,
    page_texts,
    piles,
)
from orchestrator.fidelity import limits
from orchestrator.flow.model import of_scene
from orchestrator.flow.stress import WallStress
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.threshold import thresholds_of
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.report import labels, style
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import IN_SENTENCES, Limits, Paragraphs, Section, Table
from orchestrator.report.solved import USTAR
from orchestrator.report.style import Figure
from orchestrator.study import fields
from orchestrator.study.closed_form import single_grain
from orchestrator.study.parts import Fluid, PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.types import FloatArray, Row

TEXTS = page_texts(__file__, "erosion")
"""What the page says around its figure and tables."""
MEASURED = Path(__file__).parent / "measured"
AREAS = pd.read_csv(MEASURED / "ap42_areas.csv", keep_default_na=False)
"""Shares of the surfaces of the four piles of AP-42, by class."""
MATERIALS = pd.read_csv(MEASURED / "ap42_thresholds.csv", keep_default_na=False)
"""Threshold friction velocities of AP-42."""
FLOWS = pd.read_csv(MEASURED / "flows.csv")
"""The heaps of the preset under other turbulence models and first cells: what each
loses, and the factor on u* of all faces of the default flow that loses as much."""
PAIRED_FACTORS = FLOWS.pivot_table(
    "ustar_factor", ["heap", "flow"], "obstacle", sort=False
)
"""These factors without an obstacle and behind a fence, a row for each of both."""
USTAR_T = dict(zip(MATERIALS["material"], MATERIALS["ustar_m_s"], strict=True))
"""The same by material, m/s."""
MOST_USTAR_T = 10.0
"""Largest threshold friction velocity that a wind can reach, m/s."""
CLASSES = np.unique(AREAS["us_over_ur"])
"""Classes of u_s/u_r."""
WIND_HEIGHT = 10.0
"""Height of the fastest mile and of u_r, m."""
OVER_FLAT = log(WIND_HEIGHT / 0.005) / log(0.25 / 0.005)
"""u*/u*_0 over u_s/u_r, by the log laws of both heights over a z0 of 5 mm."""
PILE = 0.10
"""AP-42: u* over u_s on a pile."""
FLAT = 0.053
"""AP-42: u* over the wind on flat ground."""
FLAT_BELOW = 0.2
"""Height over base below which AP-42 takes a pile for flat ground."""
LEVEL_DEG = 5.0
"""Slope up to which a surface is neither windward nor lee, degrees."""
GROUND = 0.01
"""Height of the bed over the pile's up to which it is the ground around."""
BASE_PLACES = 10_001
"""Places at which the length of a base is looked for."""
IN_NAME = {"bed_shape", "profile", "h_m", "alpha_deg", "solve_z0_m", "obstacles"}
"""Columns of a scene that the name of its pile, or of its surface, has in any case."""
LOOKS: tuple[style.Look, ...] = (
    {"color": style.ANSWER, "ls": "-"},
    {"color": style.FLOW, "ls": (0, (5, 2))},
    {"color": style.INK, "ls": (0, (1.5, 1.5))},
    {"color": style.NONE, "ls": (0, (6, 2, 1, 2))},
)
"""Looks of the surfaces of a pile in the figures."""
AP42 = "AP-42, the range of its piles"
"""What a legend calls its band."""
DRAWN = len(LOOKS)
"""Most piles of a figure, and most surfaces of a pile in it."""
CLASS_COLOURS = ("#d0e1ee", "#82b1d4", "#2f7db8", "#0b3d63")
"""Colours of the classes of u_s/u_r, from pale to dark."""
CLASS_INKS = ("black", "black", "white", "white")
"""Colours of the numbers in them."""
LEAST_NAMED = 6.0
"""Fraction of the surface from which its bar has a number, %."""
LOG_FROM, LOG_OF = 8.0, 100.0
"""Factor between two losses from which their axis is logarithmic, and that which such
an axis shows at most below its largest; an arrow stands for what is further down."""
ROOM = 0.3
"""Room for numbers to the right of the largest loss, over the length of the axis."""
BAR, NAMES = 0.42, 0.55
"""Heights of a row and of the title of a panel, inches."""


class PileSurface(NamedTuple):
    """The surface of a pile.

    Attributes
    ----------
    name
        What it has on it: its obstacles, or that it is one of AP-42's.
    faces
        Its faces, with the columns `part`, `share` and `ratio`, the friction velocity
        |u*| over that of the undisturbed flow.
    ustar0_over_wind
        Friction velocity of the undisturbed flow over the wind at 10 m.
    threshold
        u*_t, m/s.
    line
        Faces along the middle, which the figure has in place of all.
    factors
        Factors on u* by other flows over such a surface; None for those of a plane
        flow over a heap.
    """

    name: str
    faces: pd.DataFrame
    ustar0_over_wind: float
    threshold: float
    line: pd.DataFrame | None = None
    factors: tuple[float, ...] | None = None

    @property
    def drawn(self) -> pd.DataFrame:
        """The faces that the figure has."""
        return self.faces if self.line is None else self.line

    def potential(self, winds: ArrayLike) -> FloatArray:
        """Mean erosion potential of the surface.

        AP-42, Eq. 3: P = 58 (u* - u*_t)^2 + 25 (u* - u*_t), 0 where u* is below u*_t.

        Parameters
        ----------
        winds
            Winds at 10 m, m/s.

        Returns
        -------
        FloatArray
            P of each wind, g/m2.
        """
        ratio = self.faces["ratio"].to_numpy()
        share = self.faces["share"].to_numpy()
        ustar = np.multiply.outer(winds, self.ustar0_over_wind * ratio)
        excess = np.maximum(ustar - self.threshold, 0)
        lost = 58 * excess**2 + 25 * excess
        return np.asarray(lost @ (share / share.sum()))

    def under(self, factor: float) -> "PileSurface":
        """Take another flow, by a factor on the friction velocity of all faces.

        Parameters
        ----------
        factor
            The factor.

        Returns
        -------
        PileSurface
            The surface under that flow.
        """
        return self._replace(ustar0_over_wind=factor * self.ustar0_over_wind)

    @property
    def area(self) -> float:
        """Sum of the shares of its faces: of a surface in three dimensions m2."""
        return float(self.faces["share"].sum())

    def total(self, winds: ArrayLike) -> float:
        """Erosion potential of several winds, one after another.

        Parameters
        ----------
        winds
            Winds at 10 m, m/s.

        Returns
        -------
        float
            The sum of P, g/m2.
        """
        return float(self.potential(winds).sum())


@dataclass(frozen=True)
class Stockpile:
    """A pile with the surfaces that it has without and with obstacles, at least one.

    They are alike in everything else: shape, grains, flow and how that is solved.

    Attributes
    ----------
    name
        What tells it from other piles.
    surfaces
        Its surfaces; that without an obstacle comes first, if there is one.
    is_flat
        Whether AP-42 takes the pile for flat ground.
    has_bare
        Whether there is a surface without an obstacle.
    """

    name: str
    surfaces: Sequence[PileSurface]
    is_flat: bool
    has_bare: bool

    @property
    def by_epa(self) -> list[PileSurface]:
        """The surfaces by which AP-42 answers it: flat ground, or its four piles."""
        threshold = self.surfaces[0].threshold
        if self.is_flat:
            faces = AREAS[:1].assign(part="all", ratio=1.0)
            return [PileSurface("AP-42, flat ground", faces, FLAT, threshold)]
        every = AREAS.assign(part="all", ratio=OVER_FLAT * AREAS["us_over_ur"])
        found = []
        for name, faces in every.groupby("pile"):
            found.append(
                PileSurface(f"AP-42, {name}", faces, PILE / OVER_FLAT, threshold)
            )
        return found


def without_obstacles(scene: Scene) -> Scene:
    """Take the obstacles from a pile: piles of one such scene may be compared.

    Parameters
    ----------
    scene
        The scene of the pile.

    Returns
    -------
    Scene
        The scene without them.
    """
    return scene.without_obstacles()


def names_of(scenes: Sequence[Scene]) -> list[str]:
    """Name some different piles, each by what tells it from the others.

    Parameters
    ----------
    scenes
        Their scenes.

    Returns
    -------
    list of str
        The names.
    """
    table = pd.DataFrame([fields.asked(scene) for scene in scenes])
    differing = [name for name in table if table[name].nunique(dropna=False) > 1]
    apart = set(differing) - {*IN_NAME, *fields.TWINS}
    columns = [column for column in fields.COLUMNS if column in apart]
    found: list[str] = []
    for scene, (_, row) in zip(scenes, table.iterrows(), strict=True):
        name = ", ".join([*_form(scene), *labels.told(row, columns)])
        # fields that are in no table tell them apart
        same = sum(other.partition(" (pile ")[0] == name for other in found)
        found.append(f"{name} (pile {same + 1})" if same else name)
    return found


def _form(scene: Scene) -> list[str]:
    """The form of a pile in words."""
    bed = scene.bed
    assert isinstance(bed, PileBed)
    words = [str(bed.profile.name if bed.profile else bed.shape)]
    if _rises(bed):
        height = of_scene(scene).line.h
        words += [f"{height:g} m high", f"{bed.slope_deg:g}°"]
    words.append(f"z₀ {1e3 * scene.solve_roughness:g} mm")
    return words


def solved(scene: Scene, threshold: float | None, cases: Path) -> PileSurface:
    """Find the surface of a pile by its flow.

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
    Surface
        The surface; its faces have the columns ``x_m`` and ``z_m`` as well.
    """
    bed = scene.bed
    assert isinstance(bed, PileBed)
    faces = _faces(bed, of_scene(scene).line, of_scene(scene).stress(cases))
    if threshold is None:
        level = single_grain(scene).changed(slope_deg=0.0)
        own = thresholds_of(scene.forces.law, level)
        threshold = float(own.friction_velocity)
    over_wind = float(log_law_ustar(1.0, WIND_HEIGHT, scene.solve_roughness))
    name = " and a ".join(map(str, scene.obstacles)) or "no obstacle"
    return PileSurface(name, faces, over_wind, threshold)


def _faces(bed: PileBed, line: BedLine, stress: WallStress) -> pd.DataFrame:
    """The faces of a pile, without the ground around it and without obstacles."""
    x = stress.x_m
    z = stress.z_m
    is_on = (x > line.x[1]) & (x < line.x[-2])
    if _rises(bed):
        is_on &= z > GROUND * line.h
    for start, end in line.bare:
        is_on &= (x < start) | (x > end)
    segment = np.searchsorted(line.x, x) - 1
    slope = line.slopes_deg[np.clip(segment, 0, len(line.x) - 2)]
    sides = [slope > LEVEL_DEG, slope < -LEVEL_DEG]
    part = np.select(sides, ["windward", "lee"], "top")
    columns = {
        "x_m": bed.place(x),
        "z_m": z,
        "part": part,
        "share": stress.length_m,
        "ratio": np.abs(stress.ustar_over_ustar0_wall),
    }
    return pd.DataFrame(columns)[is_on]


def _rises(bed: PileBed) -> bool:
    """Whether a bed has a form on it, and is not flat ground."""
    return bool(bed.profile) or bed.form.rises


def grouped(
    scenes: Sequence[Scene], threshold: float | None, cases: Path
) -> list[Stockpile]:
    """Find the piles of some scenes, each without and with its obstacles.

    Parameters
    ----------
    scenes
        The scenes, whose flows are done.
    threshold
        u*_t, m/s; None for that of each grain.
    cases
        The directory of the finished runs.

    Returns
    -------
    list of Pile
        The piles.
    """
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
        line = of_scene(bare).line
        base = _base(line.x, line.z, line.h)
        is_flat = not _rises(bed) or line.h < FLAT_BELOW * base
        found.append(Stockpile(name, surfaces, is_flat, bare in members))
    return found


def _base(x: Sequence[float], z: Sequence[float], height: float) -> float:
    """Length of a bed line from its first to its last place above the ground, m."""
    places = np.linspace(x[1], x[-2], BASE_PLACES)
    above = places[np.interp(places, x, z) > GROUND * height]
    return float(np.ptp(above)) if len(above) else 0.0


class PileErosion(Experiment):
    """The erosion potential of the piles of a study.

    Parameters
    ----------
    study
        The study.

    Raises
    ------
    InputError
        If the threshold is neither a number that a wind can reach nor a material of
        AP-42, if the study has no pile or one in a liquid, or if the flow over one
        cannot be solved.
    """

    name = "erosion"
    shares_cases = True

    def __init__(self, study: Study) -> None:
        self.title = study.title
        self.winds = study.erosion.fastest_mile
        where = study.file or study.name
        self.least, self.threshold_from = given_threshold(
            study.erosion.threshold, where
        )
        asked = piles(study)
        check_winds((scene.fluid for scene in asked), where)
        self.flows = {scene: of_scene(scene) for scene in asked}
        for scene in self.flows:
            limits.check(scene, where, grains=False)
        runs = (run for flow in self.flows.values() for run in flow.cases)
        super().__init__(plan.of_cases(runs), study)

    def results(self, runs: Runs) -> ExperimentResults | None:
        """List the losses of the piles whose flows are done."""
        done = []
        for scene, flow in self.flows.items():
            if all(run.name in runs.done for run in flow.cases):
                done.append(scene)
        if not done:
            return None
        found = grouped(done, self.least, runs.cases)
        return _results(found, self.winds, self.threshold_from)


def given_threshold(asked: str | float | None, where: str) -> tuple[float | None, str]:
    """Find the threshold that a study asks for.

    Parameters
    ----------
    asked
        A number, m/s, a material of AP-42, or None for that of each grain.
    where
        The study file, for messages.

    Returns
    -------
    least
        u*_t, m/s; None for that of each grain.
    source
        Where it is from, in words.

    Raises
    ------
    InputError
        If it is neither a number that a wind can reach nor a material of AP-42.
    """
    if asked is None:
        return None, " (closed form)"
    source = ""
    least = asked
    if isinstance(asked, str):
        source = f" (AP-42, {asked})"
        least = USTAR_T.get(asked, -1.0)
    assert not isinstance(least, str)
    if not 0 < least <= MOST_USTAR_T:
        what = f"{asked!r} is not accepted"
        materials = ", ".join(USTAR_T)
        remedy = f"a value in m/s up to {MOST_USTAR_T:g}, or one of: {materials}"
        raise InputError(what, f"{where}: erosion.threshold", remedy)
    return least, source


def check_winds(fluids: Iterable[Fluid], where: str) -> None:
    """Refuse liquids, whose current takes no dust.

    Parameters
    ----------
    fluids
        The fluids of a study.
    where
        The study file, for messages.

    Raises
    ------
    InputError
        If one of them is a liquid.
    """
    for fluid in fluids:
        if fluid.density >= GAS_BELOW:
            what = f"a fluid of {fluid.density:g} kg/m3 is no wind"
            remedy = "the losses of AP-42 are of wind"
            remedy += "; `orchestrator study` has the current"
            raise InputError(what, f"{where}: fluid.density", remedy)


def _results(
    found: Sequence[Stockpile], winds: Sequence[float], source: str
) -> ExperimentResults:
    """The table and the page of some piles."""
    table = erosion_rows(found, winds)
    loss, stress = pictures(found, winds)
    told = "\n\n".join([*erosion_sentences(found, winds, source), TEXTS["sure"]])
    in_sentences = Paragraphs(told, fold=IN_SENTENCES)
    parts = Paragraphs(TEXTS["rows"], "lead")
    limits = Limits(TEXTS["limits"].split("\n\n"))
    sources = Paragraphs(TEXTS["sources"], "lead")
    sections = [
        Section("", [erosion_card(found, winds, source), loss, in_sentences]),
        Section("Stress on the pile", [stress]),
        Section("Parts of the surface", [limits, parts, Table.of(table)]),
        Section("The tables of AP-42", [sources, *tables_of_epa()]),
    ]
    return ExperimentResults({"erosion": table}, sections)


def tables_of_epa() -> list[Table]:
    """Make the tables of AP-42 for a page, with heads in words.

    Returns
    -------
    list of Table
        The areas of the classes, and the thresholds.
    """
    heads = {
        "us_over_ur": "u_s/u_r",
        "share": "fraction of the surface, %",
        "sub_areas": "its parts, %",
        "share_sure": "source of the fraction",
        "sub_areas_sure": "source of the parts",
        "ustar_m_s": "threshold friction velocity, m/s",
        "z0_m": "roughness length, m",
        "sure": "source",
    }
    sources = {"read": "public code that applies it", "memory": "memory, not read"}
    tables = []
    for table in (AREAS, MATERIALS):
        shown = table.copy()
        for name in table.columns[table.columns.str.endswith("sure")]:
            shown[name] = table[name].map(sources)
        tables.append(Table.of(shown.rename(columns=heads)))
    return tables


def erosion_rows(found: Sequence[Stockpile], winds: ArrayLike) -> pd.DataFrame:
    """List the parts of the surfaces of some piles.

    Parameters
    ----------
    found
        The piles.
    winds
        Winds at 10 m, m/s.

    Returns
    -------
    DataFrame
        A row for each part of each surface of each pile, those of AP-42 after the
        solved ones: the share of the surface that it has, P, u*/u*_0, its largest
        value, and the share of the whole surface that is nearest to each class of
        AP-42.
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
                row |= _row(surface._replace(faces=faces), whole, winds)
                listed.append(row)
    return pd.DataFrame(listed)


def _row(part: PileSurface, whole: float, winds: ArrayLike) -> Row:
    """The numbers of a part of a surface; `whole` is the sum of all its shares."""
    ratio = part.faces["ratio"].to_numpy()
    share = 100 * part.faces["share"].to_numpy() / whole
    row: Row = {
        "u*ₜ, m/s": part.threshold,
        "share, %": share.sum(),
        "P, g/m²": part.total(winds),
        "u*/u*₀": np.average(ratio, weights=share),
        "largest": ratio[share > 0].max(),
    }
    apart = np.abs(ratio[:, None] - OVER_FLAT * CLASSES)
    shares = np.bincount(apart.argmin(axis=1), share, len(CLASSES))
    for us, near in zip(CLASSES, shares, strict=True):
        row[_class_head(us)] = near
    return row


def _class_head(us: float) -> str:
    """The column of the fraction of a surface that is nearest to a class of AP-42."""
    return f"{us:g} ({OVER_FLAT * us:.2f}), %"


def erosion_sentences(
    found: Sequence[Stockpile], winds: Sequence[float], source: str
) -> Iterator[str]:
    """Say what wind takes from each pile, by both, and what its obstacles take away.

    Parameters
    ----------
    found
        The piles.
    winds
        Winds at 10 m, m/s.
    source
        The source of the threshold, in words.

    Yields
    ------
    str
        A paragraph for each pile.
    """
    speeds = ", ".join(map("{:g}".format, winds))
    for pile in found:
        first, *others = pile.surfaces
        lost = first.total(winds)
        epa = [surface.total(winds) for surface in pile.by_epa]
        ends = [f"{min(epa):.3g}"]
        if f"{max(epa):.3g}" not in ends:
            ends.append(f"{max(epa):.3g}")
        with_what = first.name if pile.has_bare else f"with {_named(first)}"
        by_epa = "by AP-42, to which it is flat ground," if pile.is_flat else "by AP-42"
        told = (
            f"Wind of {speeds} m/s at 10 m can take {lost:.3g} g/m² from the surface of"
            f" a pile ({pile.name}; {with_what}), {by_epa} {' to '.join(ends)} g/m²."
            f" Its threshold u*ₜ is {first.threshold:.3g} m/s{source}."
        )
        for other in others:
            left = other.total(winds)
            # obstacles are compared with none, not with one another
            change = ""
            if lost and pile.has_bare:
                change = f" ({signed_percent(left / lost - 1)})"
            told += f" With {_named(other)}: {left:.3g} g/m²{change}."
        yield told


def erosion_card(
    found: Sequence[Stockpile], winds: Sequence[float], source: str
) -> Card:
    """Make the answer card: what the first pile loses, and what an obstacle saves.

    Parameters
    ----------
    found
        The piles.
    winds
        Winds at 10 m, m/s.
    source
        Where the threshold is from, in words.

    Returns
    -------
    Card
        The change by the obstacle that leaves the least, the loss by the solved flow
        and by AP-42.
    """
    pile = found[0]
    first, *others = pile.surfaces
    speeds = ", ".join(map("{:g}".format, winds))
    best = min(others, key=lambda each: each.total(winds)) if others else None
    numbers: list[Number | None] = []
    asked = f"How much dust does a wind of {speeds} m/s take from this pile"
    if best is not None and pile.has_bare and first.total(winds):
        numbers.append(_change_by(best, first, winds))
        asked += f", and what does {_kind_of(best)} save"
    numbers += [
        _loss(first, winds, has_obstacle=not pile.has_bare),
        _by_epa(pile, winds),
    ]
    if best is not None and not pile.has_bare:
        numbers.append(_loss(best, winds, has_obstacle=True))
    subject = f"{pile.name[:1].upper()}{pile.name[1:]}"
    subject += f"; threshold friction velocity {first.threshold:.3g} m/s{source}"
    if len(found) > 1:
        subject += f"; {len(found)} piles are compared below"
    return Card(
        f"{asked}?",
        f"{subject}.",
        tuple(each for each in numbers if each is not None),
        TEXTS["measured"],
        Worth(
            "care",
            "usable, to compare",
            "Compare piles and obstacles, with the intervals. Do not quote the g/m² as "
            "an emission.",
        ),
    )


def _kind_of(surface: PileSurface) -> str:
    """The kind of obstacle of a surface, such as "a fence"."""
    return f"a {surface.name.partition(' ')[0]}"


def _change_by(
    behind: PileSurface, bare: PileSurface, winds: Sequence[float]
) -> Number:
    """What an obstacle changes the loss by, %, with its paired interval."""
    losses = [bare.total(winds), behind.total(winds)]
    pairs = PAIRED_FACTORS.to_dict("records")
    ratios = [losses[1] / losses[0]]
    for pair in pairs:
        of_bare = bare.under(pair["none"]).total(winds)
        if of_bare:
            ratios.append(behind.under(pair["fence"]).total(winds) / of_bare)
    return Number(
        100 * (ratios[0] - 1),
        "%",
        f"change of the loss by {_named(behind)}",
        f"{losses[0]:.2g} → {losses[1]:.2g} g/m²",
        low=100 * (min(ratios) - 1),
        high=100 * (max(ratios) - 1),
        interval_of=f"paired, with and without it: {TEXTS['flows']}",
        decimals=0,
    )


def loss_interval(
    surface: PileSurface, winds: Sequence[float], *, has_obstacle: bool
) -> tuple[float, float]:
    """Find the interval of the loss of a surface by the solved flow.

    Parameters
    ----------
    surface
        The surface.
    winds
        Winds at 10 m, m/s.
    has_obstacle
        Whether it has one, behind which other flows differ otherwise.

    Returns
    -------
    low, high : float
        Its ends by other turbulence models and first cells, g/m2.
    """
    if surface.factors is not None:
        factors = surface.factors
    else:
        factors = tuple(PAIRED_FACTORS["fence" if has_obstacle else "none"])
    ends = [surface.under(factor).total(winds) for factor in (*factors, 1.0)]
    return min(ends), max(ends)


def _loss(
    surface: PileSurface, winds: Sequence[float], *, has_obstacle: bool
) -> Number:
    """The loss of a surface by the solved flow, with its interval."""
    low, high = loss_interval(surface, winds, has_obstacle=has_obstacle)
    with_what = f", with {_named(surface)}" if has_obstacle else ", no obstacle"
    return Number(
        surface.total(winds),
        "g/m²",
        f"loss by the solved flow{with_what}",
        "mean over the surface",
        low=low,
        high=high,
        interval_of=TEXTS["flows"],
        not_in=TEXTS["tests"],
    )


def _by_epa(pile: Stockpile, winds: Sequence[float]) -> Number:
    """The loss by AP-42."""
    losses = [surface.total(winds) for surface in pile.by_epa]
    what = "its flat ground" if pile.is_flat else "the range of its four patterns"
    return Number(
        min(losses),
        "g/m²",
        "loss by AP-42",
        f"{what}; a law of emission factors, no measurement of this pile",
        last=max(losses),
    )


def _named(surface: PileSurface) -> str:
    """The obstacles of a surface with an article, such as "a fence of 2 m at -3 m"."""
    return f"a {surface.name}"


def pictures(found: Sequence[Stockpile], winds: Sequence[float]) -> list[Figure]:
    """Make the figures of some piles: loss beside AP-42, and stress over each pile.

    Parameters
    ----------
    found
        The piles, of which the first `DRAWN` are drawn.
    winds
        Winds at 10 m, m/s.

    Returns
    -------
    list of Figure
        The figures.
    """
    drawn = found[:DRAWN]
    more = ""
    if len(found) > DRAWN:
        more = f" The first {DRAWN} of {len(found)} piles are drawn."
    return [
        Figure.of_both_widths(
            "loss",
            "Loss beside AP-42, g/m², and the fractions of the surface behind it, %",
            TEXTS["loss"] + more,
            partial(_losses, drawn, winds),
        ),
        Figure.of_both_widths(
            "erosion",
            "Friction velocity on the pile over that of the flat ground",
            TEXTS["stress"] + more,
            partial(_stresses, drawn, winds),
        ),
    ]


def _losses(found: Sequence[Stockpile], winds: Sequence[float], width: float) -> Canvas:
    """Draw for each pile the classes of its surfaces, and their losses."""
    is_wide = width >= style.WIDE
    rows = [len(pile.surfaces[:DRAWN]) + len(pile.by_epa) for pile in found]
    high = [BAR * count + NAMES for count in rows]
    if is_wide:
        canvas = style.canvas(sum(high) + 0.6, width)
        panels = canvas.subplots(
            len(found), 2, squeeze=False, height_ratios=rows, width_ratios=[1.5, 1]
        )
    else:
        canvas = style.canvas(2 * sum(high) + 0.9, width)
        ratios = [count for count in rows for _ in range(2)]
        panels = canvas.subplots(2 * len(found), 1, squeeze=False, height_ratios=ratios)
        panels = panels.reshape(-1, 2)
    for (left, right), pile in zip(panels, found, strict=True):
        names = [surface.name for surface in (*pile.surfaces[:DRAWN], *pile.by_epa)]
        _classes(left, pile, winds)
        _amounts(right, pile, winds, has_names=not is_wide)
        left.set_title(textwrap.fill(pile.name, int(6.5 * width)), loc="left")
        fits = 26 if is_wide else 13
        left.set_yticks(range(len(names)), [textwrap.fill(one, fits) for one in names])
    bottom, right = panels[-1]
    bottom.set_xlabel("fraction of the surface, %")
    right.set_xlabel(f"loss in {_speeds(winds)} m/s, g/m²")
    samples = []
    for us, colour in zip(CLASSES, CLASS_COLOURS, strict=True):
        samples.append(
            Patch(fc=colour, ec=style.EDGE, lw=0.5, label=f"$u_s/u_r$ {us:g}")
        )
    style.legends_below(canvas, samples, [])
    return canvas


def _speeds(winds: Sequence[float]) -> str:
    """Winds in words."""
    return ", ".join(map("{:g}".format, winds))


def _classes(ax: Axes, pile: Stockpile, winds: ArrayLike) -> None:
    """Draw the fraction of each surface that is nearest to each class of AP-42."""
    for place, surface in enumerate((*pile.surfaces[:DRAWN], *pile.by_epa)):
        start = 0.0
        row = _row(surface, surface.faces["share"].sum(), winds)
        for us, colour, ink in zip(CLASSES, CLASS_COLOURS, CLASS_INKS, strict=True):
            part = float(str(row[_class_head(us)]))
            name = f"{surface.name}, class {us:g}"
            look: style.Look = {"fc": colour, "ec": "white", "lw": 0.8, "gid": name}
            ax.barh(place, part, 0.76, left=start, **look)
            if part >= LEAST_NAMED:
                middle = start + part / 2
                ax.text(
                    middle, place, f"{part:.0f}", ha="center", va="center", color=ink
                )
            start += part
    ax.set(xlim=(0, 100))
    ax.invert_yaxis()


def _amounts(
    ax: Axes, pile: Stockpile, winds: Sequence[float], *, has_names: bool
) -> None:
    """Draw the loss of each surface, those of the solved flow with their intervals."""
    solved = pile.surfaces[:DRAWN]
    every = (*solved, *pile.by_epa)
    losses = [surface.total(winds) for surface in every]
    intervals = []
    for place, surface in enumerate(solved):
        has_obstacle = _has_obstacle(pile, place)
        intervals.append(loss_interval(surface, winds, has_obstacle=has_obstacle))
    start = _start(ax, [*losses, *np.ravel(intervals).tolist()])
    for place, (low, high) in enumerate(intervals):
        name = f"{every[place].name}, interval"
        ax.hlines(place, max(low, start), high, color=style.PALE, lw=7, gid=name)
        if low < start:
            ax.plot(start, place, "<", ms=8, color=style.PALE, clip_on=False)
    for place, (surface, lost) in enumerate(zip(every, losses, strict=True)):
        is_solved = place < len(solved)
        colour = style.ANSWER if is_solved else style.INK
        look: style.Look = {"marker": "o" if is_solved else "s", "mec": colour, "ms": 7}
        ax.plot(
            lost, place, mfc=colour if is_solved else "white", gid=surface.name, **look
        )
        end = intervals[place][1] if is_solved else lost
        text = f"{lost:#.2g}".rstrip(".")
        ax.annotate(text, (end, place), **_beside(colour))
    count = len(every)
    ax.set_ylim(count - 0.5, -0.5)
    ax.set_yticks(range(count), [""] * count)
    if has_names:
        names = [textwrap.fill(surface.name, 13) for surface in every]
        ax.set_yticks(range(count), names)
    ax.grid(axis="x", lw=0.4, color="0.85")


def _start(ax: Axes, losses: Sequence[float]) -> float:
    """Set the axis of some losses; the loss at which it starts."""
    most = max(losses)
    above = [lost for lost in losses if lost > most / LOG_OF]
    if min(losses) < most / LOG_FROM and len(above) > 1:
        start = min(above) / 1.5
        ax.set_xscale("log")
        ax.set_xlim(start, most * (most / start) ** ROOM)
        style.plain_ticks(ax.xaxis)
        return start
    ax.set_xlim(0, (1 + ROOM) * most or 1.0)
    return 0.0


def _beside(colour: str) -> style.Look:
    """How a number stands to the right of its mark."""
    return {
        "xytext": (8, 0),
        "textcoords": "offset points",
        "va": "center",
        "color": colour,
    }


def _has_obstacle(pile: Stockpile, place: int) -> bool:
    """Whether a surface of a pile, by its place, has an obstacle."""
    return place > 0 or not pile.has_bare


def _stresses(
    found: Sequence[Stockpile], winds: Sequence[float], width: float
) -> Canvas:
    """Draw for each pile u*/u*_0 over it, and the potential against the wind."""
    is_wide = width >= style.WIDE
    if is_wide:
        canvas = style.canvas(2.9 * len(found) + 0.8, width)
        panels = canvas.subplots(len(found), 2, squeeze=False, width_ratios=[1.4, 1])
    else:
        canvas = style.canvas(5.4 * len(found) + 1.2, width)
        panels = canvas.subplots(2 * len(found), 1, squeeze=False).reshape(-1, 2)
    for (left, right), pile in zip(panels, found, strict=True):
        _over_pile(left, pile)
        _potential(right, pile, winds)
        left.set_title(textwrap.fill(pile.name, int(6 * width)), loc="left")
    style.legends_below(canvas, [], style.samples(panels[:, 1].tolist()))
    return canvas


def _over_pile(left: Axes, pile: Stockpile) -> None:
    """Draw u*/u*_0 over a pile, and the pile below it."""
    for surface, look in zip(pile.surfaces, LOOKS, strict=False):
        line = surface.drawn.sort_values("x_m")
        left.plot(
            line["x_m"], line["ratio"], marker=".", ms=4, gid=surface.name, **look
        )
    bed = left.twinx()
    line = pile.surfaces[0].drawn.sort_values("x_m")
    x, z = line[["x_m", "z_m"]].to_numpy().T
    bed.fill_between(x, z, color=style.BED, lw=0, gid="the pile")
    bed.set(ylim=(0, 4 * (z.max() or 1)), yticks=[])
    left.set(zorder=1, frame_on=False, xlabel="x, m", ylabel=USTAR)
    left.set_ylim(0, None)
    left.axhline(1.0, color="0.6", lw=0.6)


def _potential(right: Axes, pile: Stockpile, winds: Sequence[float]) -> None:
    """Draw the erosion potential against the wind, AP-42 as the band of its piles."""
    axis = np.linspace(0, 1.4 * max(winds), 141)
    for surface, look in zip(pile.surfaces, LOOKS, strict=False):
        right.plot(axis, surface.potential(axis), label=surface.name, **look)
    of_epa = np.array([surface.potential(axis) for surface in pile.by_epa])
    ends = of_epa.min(0), of_epa.max(0)
    right.fill_between(axis, *ends, color=style.RANGE, ec=style.NONE, label=AP42)
    right.set(xlim=(0, axis[-1]), ylim=(0, None), xlabel="wind at 10 m, m/s")
    right.set_ylabel("P, g/m²")
    for wind in winds:
        right.axvline(wind, color="0.6", lw=0.8, ls=":", zorder=0)
