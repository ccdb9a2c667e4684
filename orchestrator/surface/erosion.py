"""What wind takes from heaps in three dimensions, beside AP-42, section 13.2.5."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from orchestrator.digits import number, percent, plain_number, signed_percent
from orchestrator.experiment import ExperimentResults, page_texts
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import IN_SENTENCES, Limits, Paragraphs, Section, Table
from orchestrator.stockpile import erosion
from orchestrator.surface import cards, onset
from orchestrator.surface.answer import HEAP, RATIO, Direction, SurfaceAnswer
from orchestrator.surface.heights import Heap
from orchestrator.surface.mesh import wind_axes
from orchestrator.surface.pipeline import OverSurfaces
from orchestrator.surface.study import SurfaceStudy

ROW = 0.5
"""Distance from the middle up to which faces are of its row, cells of the flow."""
GRAMS = 1000.0
"""Grams of a kilogram."""


@dataclass(frozen=True)
class Wind:
    """The heaps of a surface under the wind of one direction.

    Attributes
    ----------
    from_deg
        Where the wind comes from, degrees.
    whole
        The faces of all heaps.
    heaps
        The faces of each.
    """

    from_deg: float
    whole: erosion.PileSurface
    heaps: Sequence[erosion.PileSurface]

    @classmethod
    def of(cls, answer: SurfaceAnswer, direction: Direction) -> "Wind":
        """Divide the faces of the heaps of a surface.

        Parameters
        ----------
        answer
            The surface.
        direction
            The wind of one direction.

        Returns
        -------
        Wind
            The heaps; shares are areas, m2.
        """
        form = direction.form
        heaps = []
        for one, heap in enumerate(answer.surface.heaps, 1):
            faces = form[form[HEAP] == one]
            heaps.append(_surface_of(answer, direction.from_deg, faces, heap))
        highest = answer.surface.heaps[0]
        whole = _surface_of(answer, direction.from_deg, form, highest)
        return cls(direction.from_deg, whole, heaps)

    def loss_kg(self, winds: Sequence[float]) -> float:
        """Add up what winds, one after another, can take from all heaps.

        Parameters
        ----------
        winds
            The winds at 10 m, m/s.

        Returns
        -------
        float
            The mass, kg.
        """
        return self.whole.total(winds) * self.whole.area / GRAMS


@dataclass(frozen=True)
class Heaps:
    """The heaps of a surface under the winds of all directions.

    Attributes
    ----------
    name
        The surface in words.
    heaps
        The heaps.
    winds
        The directions, the one that takes the most first.
    speeds
        Winds at 10 m, one after another, m/s.
    rose
        The winds of the rose by the flows that answer them; None without one.
    """

    name: str
    heaps: Sequence[Heap]
    winds: Sequence[Wind]
    speeds: Sequence[float]
    rose: pd.DataFrame | None = None

    @classmethod
    def of(cls, answer: SurfaceAnswer, speeds: Sequence[float]) -> "Heaps":
        """Put the heaps of a surface under winds.

        Parameters
        ----------
        answer
            The surface.
        speeds
            Winds at 10 m, one after another, m/s.

        Returns
        -------
        Heaps
            The heaps.
        """
        winds = [Wind.of(answer, direction) for direction in answer.directions]
        winds.sort(key=lambda wind: -wind.loss_kg(speeds))
        rose = None if answer.rose is None else answer.rose.by_flow
        return cls(answer.name, answer.surface.heaps, winds, speeds, rose)

    @property
    def worst(self) -> Wind:
        """The direction that takes the most."""
        return self.winds[0]

    @cached_property
    def piles(self) -> list[erosion.Stockpile]:
        """Each heap as a pile of its own, with its surface by every direction."""
        found = []
        for place, heap in enumerate(self.heaps):
            surfaces = [wind.heaps[place] for wind in self.winds]
            is_flat = heap.height < erosion.FLAT_BELOW * 2 * heap.radius
            name = self._name_of(place, heap)
            found.append(erosion.Stockpile(name, surfaces, is_flat, has_bare=False))
        return found

    def _name_of(self, place: int, heap: Heap) -> str:
        """The name of a heap: where there are several, with its number and place."""
        if len(self.heaps) == 1:
            return self.name
        where = f"x = {heap.x:.0f} m, y = {heap.y:.0f} m"
        return f"{self.name}, heap {place + 1} at {where}, {heap.height:.3g} m high"

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the loss by the worst direction, g/m2, by other flows over a cone."""
        whole = self.worst.whole
        return erosion.loss_interval(whole, self.speeds, has_obstacle=False)

    @property
    def by_epa(self) -> tuple[float, float]:
        """The least and the largest loss of all heaps together by AP-42, kg."""
        low = high = 0.0
        for pile in self.piles:
            lost = [surface_.total(self.speeds) for surface_ in pile.by_epa]
            area = pile.surfaces[0].area
            low += min(lost) * area / GRAMS
            high += max(lost) * area / GRAMS
        return low, high

    def by_rose(self) -> "pd.Series[float]":
        """Mean loss of a disturbance whose strongest wind is one of the rose, kg.

        Returns
        -------
        Series
            The part of each direction of the flow, by degrees.
        """
        assert self.rose is not None
        found = {}
        for wind in self.winds:
            rows = self.rose[self.rose["solved_deg"] == wind.from_deg]
            lost = wind.whole.potential(rows["speed_m_s"].to_numpy(float))
            mean = float(lost @ rows["share"].to_numpy(float))
            found[wind.from_deg] = mean * wind.whole.area / GRAMS
        return pd.Series(found)


def _surface_of(
    answer: SurfaceAnswer, from_deg: float, faces: pd.DataFrame, heap: Heap
) -> erosion.PileSurface:
    """The surface of a pile by its faces, whose shares are areas."""
    listed = _listed(answer, from_deg, faces, heap)
    ground = answer.ground
    # stress is inverse to the wind in which motion starts
    low, high = cards.factors_of_wind(onset.STARTS)
    return erosion.PileSurface(
        f"wind from {from_deg:g}°",
        listed,
        float(log_law_ustar(1.0, onset.WIND_HEIGHT, ground.roughness)),
        ground.level_ustar,
        listed[listed["off_middle_m"] <= ROW * answer.cell_m],
        (1 / high, 1 / low),
    )


def _listed(
    answer: SurfaceAnswer, from_deg: float, faces: pd.DataFrame, heap: Heap
) -> pd.DataFrame:
    """The faces of a heap along the wind, with their distances from its middle."""
    faces = faces.sort_values("along_m")
    is_level = faces["slope_deg"] < erosion.LEVEL_DEG
    side = np.where(faces["uphill"] > 0, "windward", "lee")
    off = np.array([heap.x, heap.y]) - np.array(answer.surface.centre)
    along, across = wind_axes(from_deg) @ off
    columns = {
        "x_m": faces["along_m"] - along,
        "z_m": faces["z_m"],
        "part": np.where(is_level, "top", side),
        "share": faces["area_m2"],
        "ratio": faces[RATIO],
        "off_middle_m": (faces["across_m"] - across).abs(),
    }
    return pd.DataFrame(columns)


class HeapErosion(OverSurfaces):
    """The erosion potential of heaps in three dimensions.

    Parameters
    ----------
    study
        The study.

    Raises
    ------
    InputError
        If the threshold is no number that a wind can reach, nor a material of AP-42, if
        the rose blows from where no flow is, or if the fluid is a liquid.
    """

    name = "erosion"

    def __init__(self, study: SurfaceStudy) -> None:
        erosion.check_winds((scene.fluid for scene in study.scenes), study.file)
        self.winds = study.erosion.fastest_mile
        super().__init__(study)

    def results_of(self, found: Sequence[SurfaceAnswer]) -> ExperimentResults:
        """List the losses of the heaps of each surface."""
        heaps = [Heaps.of(each, self.winds) for each in found]
        said = [each.rose.said for each in found[:1] if each.rose is not None]
        read = [*cards.files_read(self.understood), *said]
        return ExperimentResults(
            {"erosion": heaps_rows(heaps)},
            erosion_sections(heaps, self.threshold_from, read),
        )


def heaps_rows(found: Sequence[Heaps]) -> pd.DataFrame:
    """List the parts of each heap, as `erosion_rows` does, with areas and masses.

    Parameters
    ----------
    found
        The heaps of each surface.

    Returns
    -------
    DataFrame
        The rows; AP-42 is applied to the area of the heap by the worst direction.
    """
    tables = []
    for heaps in found:
        for pile in heaps.piles:
            table = erosion.erosion_rows([pile], heaps.speeds)
            areas = {one.name: one.area for one in pile.surfaces}
            whole = table["surface"].map(areas).fillna(pile.surfaces[0].area)
            area = whole * table["share, %"] / 100
            at = table.columns.get_loc("P, g/m²")
            assert isinstance(at, int)
            table.insert(at, "area, m²", area)
            table.insert(at + 2, "loss, kg", area * table["P, g/m²"] / GRAMS)
            tables.append(table)
    return pd.concat(tables, ignore_index=True)


def erosion_sections(
    found: Sequence[Heaps], source: str, read: Sequence[str] = ()
) -> list[Section]:
    """The page: the answer with its figure, the parts, and the tables of AP-42.

    Parameters
    ----------
    found
        The heaps of each surface.
    source
        Where the threshold is from, in words.
    read
        What was understood of the files of the study, a paragraph each.

    Returns
    -------
    list of Section
        The sections, in their order.
    """
    texts = erosion.TEXTS
    own = page_texts(__file__, "surface")
    piles = [pile for heaps in found for pile in heaps.piles]
    loss, stress = erosion.pictures(piles, found[0].speeds)
    said = [line for heaps in found for line in heaps_sentences(heaps, source)]
    told = "\n\n".join([*said, *read, own["erosion_sure"]])
    in_sentences = Paragraphs(told, fold=IN_SENTENCES)
    parts = Paragraphs(texts["rows"], "lead")
    limits = Limits(own["erosion_limits"].split("\n\n"))
    sources = Paragraphs(texts["sources"], "lead")
    return [
        Section("", [heaps_card(found, source), loss, in_sentences]),
        Section("Stress on the pile", [stress]),
        Section("Parts of the surface", [limits, parts, Table.of(heaps_rows(found))]),
        Section("The tables of AP-42", [sources, *erosion.tables_of_epa()]),
    ]


def heaps_sentences(heaps: Heaps, source: str) -> Iterator[str]:
    """Say what wind takes from each heap, by both, and from which directions less.

    Parameters
    ----------
    heaps
        The heaps of a surface.
    source
        Where the threshold is from, in words.

    Yields
    ------
    str
        A paragraph for each heap, and one for the wind rose.
    """
    speeds = ", ".join(map("{:g}".format, heaps.speeds))
    for pile in heaps.piles:
        first, *others = pile.surfaces
        lost = first.total(heaps.speeds)
        epa = [one.total(heaps.speeds) for one in pile.by_epa]
        ends = dict.fromkeys(f"{end:.3g}" for end in (min(epa), max(epa)))
        by_epa = "by AP-42, to which it is flat ground," if pile.is_flat else "by AP-42"
        told = (
            f"Wind of {speeds} m/s at 10 m can take {lost:.3g} g/m² from the surface of"
            f" a pile ({pile.name}; {first.name}), {lost * first.area / GRAMS:.3g} kg"
            f" from its {plain_number(first.area)} m², {by_epa}"
            f" {' to '.join(ends)} g/m²."
            f" Its threshold u*ₜ is {first.threshold:.3g} m/s{source}."
        )
        for other in others:
            left = other.total(heaps.speeds)
            change = f" ({signed_percent(left / lost - 1)})" if lost else ""
            told += f" With {other.name}: {left:.3g} g/m²{change}."
        yield told
    if heaps.rose is not None:
        yield _of_rose(heaps)


def _of_rose(heaps: Heaps) -> str:
    """What the winds of the rose take, in words."""
    parts = heaps.by_rose()
    if not parts.sum():
        return "No wind of the rose reaches the threshold anywhere on the heaps."
    shares = parts / parts.sum()
    named = [
        f"{percent(share)} in wind from {at:g}°"
        for at, share in shares.items()
        if share
    ]
    return (
        f"A disturbance after which the strongest wind is one of the rose costs "
        f"{parts.sum():.3g} kg in the mean: {', '.join(named)}. A year has that times "
        "the number of its disturbances. The fastest mile of AP-42 is a gust of a "
        "minute or less, stronger than the mean wind of an hour."
    )


def heaps_card(found: Sequence[Heaps], source: str) -> Card:
    """Make the answer card: what the wind from the worst direction takes.

    Parameters
    ----------
    found
        The heaps of each surface; the card is on the first.
    source
        Where the threshold is from, in words.

    Returns
    -------
    Card
        The loss by the solved flow and by AP-42, and that by the wind rose or from the
        direction that takes the least.
    """
    heaps = found[0]
    speeds = ", ".join(map("{:g}".format, heaps.speeds))
    counted = number(len(heaps.heaps), "heap")
    subject = f"{heaps.name}; {counted} of {plain_number(heaps.worst.whole.area)} m²"
    if len(found) > 1:
        subject += f"; {len(found)} surfaces are compared below"
    return Card(
        f"How much dust does a wind of {speeds} m/s take from this pile?",
        f"{subject}.",
        tuple(_numbers(heaps, source)),
        erosion.TEXTS["measured"],
        Worth(
            "care",
            "usable, to compare",
            "Compare heaps and directions. Do not quote the g/m² as an emission.",
        ),
    )


def _numbers(heaps: Heaps, source: str) -> Iterator[Number]:
    """The figures of the card."""
    worst = heaps.worst
    whole = worst.whole
    low, high = heaps.interval
    of_all = f", the worst of {len(heaps.winds)}" if len(heaps.winds) > 1 else ""
    notes = [
        f"{worst.loss_kg(heaps.speeds):.3g} kg in all",
        f"the threshold friction velocity is {whole.threshold:.3g} m/s{source}",
        _tie(heaps),
    ]
    yield Number(
        whole.total(heaps.speeds),
        "g/m²",
        f"of dust by the solved flow, with a {whole.name}{of_all}",
        "; ".join(filter(None, notes)),
        low=low,
        high=high,
        interval_of=cards.INTERVAL_OF,
        not_in=erosion.TEXTS["tests"],
    )
    least, most = heaps.by_epa
    yield Number(
        GRAMS * least / whole.area,
        "g/m²",
        "of dust by AP-42",
        f"{' to '.join(dict.fromkeys(f'{end:.3g}' for end in (least, most)))} kg; the "
        "range of its patterns of the wind over piles",
        last=GRAMS * most / whole.area,
    )
    if heaps.rose is not None:
        yield _by_rose(heaps)
    elif len(heaps.winds) > 1:
        last = heaps.winds[-1]
        meaning = f"with a {last.whole.name}, the least of all"
        note = f"{last.loss_kg(heaps.speeds):.3g} kg"
        yield Number(last.whole.total(heaps.speeds), "g/m²", meaning, note)


def _by_rose(heaps: Heaps) -> Number:
    """The mean loss by the wind rose."""
    parts = heaps.by_rose()
    meaning = "in the mean over the winds of the rose, for each disturbance"
    if not parts.sum():
        return Number(0.0, "kg", meaning, "none of them reaches the threshold")
    most = parts.index[int(parts.argmax())]
    share = parts.max() / parts.sum()
    note = f"{percent(share)} of it in wind from {most:g}°"
    return Number(float(parts.sum()), "kg", meaning, note)


def _tie(heaps: Heaps) -> str:
    """Say which directions are not told from the worst."""
    low, _ = heaps.interval
    alike = []
    for wind in heaps.winds:
        if wind.whole.total(heaps.speeds) >= low:
            alike.append(wind.from_deg)
    return cards.tie(alike, heaps.worst.from_deg, len(heaps.winds))
