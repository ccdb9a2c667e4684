"""The answer on a surface in words: the card, and the sentences below it."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from math import ceil, exp, hypot, isfinite, log, log10
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from orchestrator.digits import number, percent, plain_number
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.subjects import length
from orchestrator.surface import onset
from orchestrator.surface.answer import Direction, SurfaceAnswer

SURFACES = Path(__file__).with_name("measured") / "surfaces.csv"
"""Flows over surfaces beside others: `orchestrator validate --surfaces all`."""
MOST_TIED = 3
"""Most directions that a tie names."""
HALF, TENTH = 0.5, 0.1
"""Shares of the surface whose hours or winds the answer has."""
EXCEEDED = {
    onset.STARTS: "u*/u*_0 that 1 % of the area exceeds",
    HALF: "u*/u*_0 that half of the area exceeds",
}
"""Stresses of that table, by the share of the surface whose wind they decide."""
LITTLE = 0.005
"""Share of the surface that is not worth a word."""
NOT_MEASURED = (
    "Solved flow. No measured wall stress over such a bed is known to us; the wind at "
    "the masts of Askervein hill is met within {:.2f} to {:.2f} of the reference speed "
    "(root mean square)."
)
RMS = "rms of the differences"
"""Its quantity in the table, of each line of masts."""
INTERVAL_OF_FLOW = "that of the flow"
INTERVAL_OF = "other first cells, meshes and turbulence models, on a cone"
WORTH = Worth(
    "care",
    "usable, to compare directions and parts",
    "Quote the interval. It is that of the flow; the uncertainty of the threshold of "
    "the grain is not in it.",
)


def surface_card(found: Sequence[SurfaceAnswer], source: str) -> Card:
    """Make the answer card of surfaces: that of the one which moves first.

    Parameters
    ----------
    found
        The answers.
    source
        Where a given threshold is from, in words.

    Returns
    -------
    Card
        The wind in which motion starts, that in which half of the surface moves, and
        the hours a year by the wind rose or the share that moves before flat ground.
    """
    first = min(found, key=lambda answer: answer.easiest.starts)
    others = f"; {len(found)} surfaces are compared below" if len(found) > 1 else ""
    directions = [f"{each.from_deg:g}°" for each in first.directions]
    stream = first.ground.stream
    winds = f"{stream.word} from {', '.join(directions)}"
    if len(directions) > 4:
        winds = f"{stream.word} from {len(directions)} directions"
    return Card(
        f"At what {stream.word} does this surface start to move, and how much of it "
        "moves?",
        f"{first.name}; {heaps(first)}; {_grain(first, source)}; {winds}{others}.",
        tuple(_numbers(first)),
        NOT_MEASURED.format(*_ends_at_masts()),
        WORTH,
    )


def heaps(answer: SurfaceAnswer) -> str:
    """Say how many heaps a surface has, and their area, in words.

    Parameters
    ----------
    answer
        The answer on it.

    Returns
    -------
    str
        The words.
    """
    counted = number(len(answer.surface.heaps), "heap")
    return f"{counted} of {plain_number(answer.easiest.area)} m²"


def _of_winds(answer: SurfaceAnswer) -> Iterator[str]:
    """The hours of the winds of the place, and how well flows between are known."""
    tenth, half = hours(answer, TENTH), hours(answer, HALF)
    yield (
        f"By the winds of the place a tenth of it moves in {tenth.text} hours a year, "
        f"half of it in {half.text}; the interval is {tenth.of}."
    )
    assert answer.rose is not None
    yield answer.rose.said
    if len(answer.directions) < 2:
        return
    told = "Between the flows u* on the surface is interpolated"
    of_tenth, of_half = answer.left_out(TENTH), answer.left_out(HALF)
    if of_tenth is None or of_half is None:
        yield f"{told}; flows 45° apart would tell how well, each left out once."
        return
    yield (
        f"{told}. Each flow left out once, its neighbours, {of_tenth.gap:g}° apart, "
        "meet its wind for a tenth of the surface within "
        f"{100 * of_tenth.off:.1f} % (that from {of_tenth.from_deg:g}°), "
        f"for half of it within {100 * of_half.off:.1f} % (from {of_half.from_deg:g}°)."
    )


def _grain(answer: SurfaceAnswer, source: str) -> str:
    """What lies on the surface, in words."""
    ground = answer.ground
    if ground.threshold is not None:
        return f"threshold friction velocity {ground.threshold:.3g} m/s{source}"
    return f"grains of {length(float(ground.grain.diameter))}"


def _numbers(answer: SurfaceAnswer) -> Iterator[Number]:
    """The figures of the card."""
    first = answer.easiest
    flat = answer.ground.flat
    stream = answer.ground.stream
    notes = [f"at {_place(answer)}", f"flat ground: {flat:.3g} m/s"]
    high = factors_of_wind(onset.STARTS)[1] * first.starts
    alike = [each for each in answer.directions if each.starts <= high]
    tied = tie(
        [each.from_deg for each in alike], first.from_deg, len(answer.directions)
    )
    yield _wind(
        first,
        onset.STARTS,
        f"threshold {stream.at} from {first.from_deg:g}°, first motion",
        "; ".join(filter(None, [*notes, tied])),
    )
    if isfinite(first.shares().wind_for(HALF)):
        what = f"threshold {stream.at} from {first.from_deg:g}°, half of the surface"
        yield _wind(first, HALF, what)
    if answer.rose is not None:
        some, half = hours(answer, onset.STARTS), hours(answer, HALF)
        tenth = hours(answer, TENTH)
        yield Number(
            tenth.value,
            "hours a year",
            "with at least a tenth of the surface in motion, by the wind rose",
            f"some of it: {some.text} hours; half of it: {half.text} hours",
            low=tenth.low,
            high=tenth.high,
            interval_of=tenth.of,
            decimals=0,
        )
        return
    low, high = factors_of_wind(HALF)
    least, share, most = first.shares().at([flat / high, flat, flat / low])
    yield Number(
        100 * float(share),
        "%",
        "of the surface is above threshold",
        f"at {flat:.3g} m/s, the threshold of flat ground",
        low=100 * float(least),
        high=100 * float(most),
        interval_of=INTERVAL_OF,
        decimals=0,
    )


class Hours(NamedTuple):
    """Hours a year, with the interval of the threshold carried through.

    Attributes
    ----------
    value, low, high
        The hours and their ends.
    of
        What the interval is of.
    """

    value: float
    low: float
    high: float
    of: str

    @property
    def text(self) -> str:
        """The ends in words; one where they are alike."""
        ends = dict.fromkeys(f"{end:,.0f}" for end in (self.low, self.high))
        return " to ".join(ends)


def hours(answer: SurfaceAnswer, share: float) -> Hours:
    """Count the hours a year in which a share of a surface moves, with their interval.

    Parameters
    ----------
    answer
        The answer on it, with the winds of the place.
    share
        The share: `onset.STARTS`, `TENTH` or `HALF`.

    Returns
    -------
    Hours
        The hours. The interval of the wind is that of the flow, and of the grain's
        threshold where it has one: both are independent.
    """
    of_flow = factors_of_wind(share if share in EXCEEDED else onset.STARTS)
    of_grain = answer.ground.factors
    words = INTERVAL_OF_FLOW
    ends = of_flow
    if all(map(isfinite, of_grain)):
        words = f"{words} and of the grain's threshold"
        low, high = (
            hypot(log(one), log(other))
            for one, other in zip(of_flow, of_grain, strict=True)
        )
        ends = exp(-low), exp(high)
    value, low, high = (
        answer.hours_of(share, factor) for factor in (1.0, ends[1], ends[0])
    )
    return Hours(value, low, high, words)


def files_read(understood: Mapping[str, str]) -> list[str]:
    """Say what was understood of the files of a study.

    Parameters
    ----------
    understood
        The words by the names of the files.

    Returns
    -------
    list of str
        A paragraph for each file.
    """
    return [f"Read from {name}: {text}." for name, text in understood.items()]


def _wind(direction: Direction, share: float, meaning: str, note: str = "") -> Number:
    """The wind in which a share of a surface moves, with its interval."""
    wind = direction.shares().wind_for(share)
    low, high = factors_of_wind(share)
    return Number(
        wind,
        "m/s",
        meaning,
        note,
        low=low * wind,
        high=high * wind,
        interval_of=INTERVAL_OF,
    )


def tie(alike: Sequence[float], first: float, count: int) -> str:
    """Say which directions are no better known apart from the first than its interval.

    Parameters
    ----------
    alike
        Directions within the interval of the first, degrees.
    first
        The first of all, degrees.
    count
        Number of all directions.

    Returns
    -------
    str
        The words; empty where there is none but the first.
    """
    others = [f"{each:g}°" for each in alike if each != first]
    if not others:
        return ""
    if len(others) == count - 1 and count > 2:
        return "the directions differ by less than the interval"
    if len(others) > MOST_TIED:
        return f"{len(others)} other directions lie within the interval"
    verb = "lies" if len(others) == 1 else "lie"
    return f"{' and '.join(others)} {verb} within the interval"


@cache
def factors_of_wind(share: float) -> tuple[float, float]:
    """Find how far other flows move the wind in which a share of a surface moves.

    The wind is inverse to the stress.

    Parameters
    ----------
    share
        The share, of `EXCEEDED`.

    Returns
    -------
    low, high : float
        The least and the largest factor, which 1 lies between.
    """
    table = pd.read_csv(SURFACES)
    is_meant = (table["part"] == "interval") & (table["quantity"] == EXCEEDED[share])
    factors = table["compared_with"][is_meant] / table["value"][is_meant]
    return min(1.0, float(factors.min())), max(1.0, float(factors.max()))


def _ends_at_masts() -> tuple[float, float]:
    """The least and the largest difference of all lines of masts."""
    table = pd.read_csv(SURFACES)
    rms = table["value"][table["quantity"] == RMS]
    return float(rms.min()), float(rms.max())


def _place(answer: SurfaceAnswer) -> str:
    """Where motion starts, in the axes of the file."""
    row = answer.easiest.first
    x, y = (in_axes(float(row[name]), answer.cell_m) for name in ("x_m", "y_m"))
    where = f"x = {x} m, y = {y} m".replace("-", "−")
    return f"{where}, {row['z_m']:.3g} m high"


def in_axes(place: float, cell_m: float) -> str:
    """Write a place on an axis of a file, whose zero may be far away.

    Parameters
    ----------
    place
        The place, m.
    cell_m
        Length of the flow's cells, m: a place is known to a tenth of it.

    Returns
    -------
    str
        The place, m.
    """
    return f"{place:.{max(0, ceil(1 - log10(cell_m)))}f}"


def surface_sentences(answer: SurfaceAnswer, source: str) -> Iterator[str]:
    """Say the caveats of an answer.

    Parameters
    ----------
    answer
        The answer.
    source
        Where a given threshold is from, in words.

    Yields
    ------
    str
        A sentence.
    """
    first = answer.easiest
    shares = first.shares()
    stream = answer.ground.stream
    yield (
        f"On {answer.name} ({_grain(answer, source)}) motion starts in a {stream.word} "
        f"of {first.starts:.3g} m/s at {stream.height:g} m from {first.from_deg:g}°. "
        f"A tenth of the surface moves in {shares.wind_for(TENTH):.3g} m/s."
    )
    if len(answer.directions) > 1:
        last = max(answer.directions, key=lambda each: each.starts)
        high = factors_of_wind(onset.STARTS)[1] * first.starts
        tied = ", which is within the interval" if last.starts <= high else ""
        yield (
            f"From {last.from_deg:g}° motion starts at {last.starts:.3g} m/s, "
            f"of the {len(answer.directions)} directions the highest{tied}."
        )
    if answer.rose is not None:
        yield from _of_winds(answer)
    entrained = first.entrained
    if entrained is not None:
        yield (
            "Motion is sustained: a gust entrains a grain, which moves on after it; "
            f"without gusts grains are entrained at {entrained:.3g} m/s."
        )
    said = "; ".join(answer.smooth.said)
    yield f"The surface is {said}: {answer.smooth.relief:.4g} m high in the flow."
    loose = max(each.loose for each in answer.directions)
    if loose > LITTLE:
        angle = 90 - answer.ground.grain.entrainment_angle_deg
        yield (
            f"{percent(loose)} of it is steeper than {angle:g}° of the pockets of its "
            "grains, which lie loose there: it is left out."
        )
