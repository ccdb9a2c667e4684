"""The answer card: a question, at most three numbers with units, and their worth.

Pages and the terminal are both made from it. It imports nothing that is slow: the
command `threshold` prints one.
"""

import math
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from orchestrator.report.lines import BETWEEN, head_width, table
from orchestrator.runs import terminal

Mark = Literal["good", "care", "bad"]
"""What an answer is worth: usable, usable with something, not usable."""
DISCS: dict[Mark, str] = {"good": "●", "care": "◐", "bad": "○"}
"""A full disc, a half disc and a ring, as the page draws them."""
WIDTH = 79
"""Letters of a line in a terminal."""
INDENT = "  "
"""What stands before the figures in a terminal."""
MOST_LETTERS = 22
"""Letters of a column of figures in a terminal; longer cells have several lines."""
MOST_DIGITS = 9
"""Largest number of digits that tell two ends of an interval apart."""
MOST_NUMBERS = 3
"""Largest number of large figures of a card."""


@dataclass(frozen=True)
class Number:
    """A large figure of a card: the number that a reader should take.

    Attributes
    ----------
    value
        The number in its unit.
    unit
        The unit, such as ``m/s``; a count has words such as ``of 17``.
    meaning
        What the number is, in a few words.
    note
        A term of its meaning in plain words, or where it counts from.
    low, high
        Ends of its one interval in that unit; NaN where one is not known.
    interval_of
        What the interval contains, such as ``the six force laws that hold``.
    not_in
        What is known and wider than the interval; empty where that is nothing.
    other
        Another value in that unit to stand beside it; NaN without one.
    other_is
        What that value is called, such as ``model alone``.
    other_low, other_high, other_interval_of
        Its interval, where it stands with equal right.
    other_word
        An answer in place of the other value.
    value_is
        What the number itself is called, where it stands with equal right.
    last, other_last
        The other end of a range of numbers, NaN of one number.
    is_other_measured
        Whether the other value is what was measured; else it is of a model or formula.
    is_grey
        Whether the number is not usable.
    is_measured
        Whether it is what was measured, to be taken in place of the model's.
    is_ratio
        Whether the number is a factor, which stands behind ``×``.
    decimals
        Digits behind the point; None for as many as the number needs.
    mark
        Of a number that is a verdict, which.
    word
        An answer in place of a number, such as ``none``.
    """

    value: float
    unit: str
    meaning: str
    note: str = ""
    low: float = math.nan
    high: float = math.nan
    interval_of: str = ""
    not_in: str = ""
    other: float = math.nan
    other_is: str = "measured"
    other_low: float = math.nan
    other_high: float = math.nan
    other_interval_of: str = ""
    other_word: str = ""
    value_is: str = ""
    last: float = math.nan
    other_last: float = math.nan
    is_other_measured: bool = False
    is_grey: bool = False
    is_measured: bool = False
    is_ratio: bool = False
    decimals: int | None = None
    mark: Mark | None = None
    word: str = ""

    @classmethod
    def counted(
        cls, value: int, of: int, meaning: str, note: str = "", mark: Mark | None = None
    ) -> "Number":
        """Make the number of a count.

        Parameters
        ----------
        value
            The count.
        of
            All that could be counted.
        meaning, note, mark
            As those of the number.

        Returns
        -------
        Number
            The number, without decimals.
        """
        return cls(value, f"of {of}", meaning, note, decimals=0, mark=mark)

    @property
    def figure(self) -> str:
        """The number as it is written, or its word."""
        times = "× " if self.is_ratio else ""
        return self.word or f"{times}{self._written(self.value, self.last, '–')}"

    @property
    def interval(self) -> str:
        """The interval as it is written, without its unit; empty without one.

        Its ends have more digits than the number where they would be written alike.
        """
        return self._between(self.low, self.high)

    @property
    def other_interval(self) -> str:
        """The interval of the other value as it is written."""
        return self._between(self.other_low, self.other_high)

    @property
    def beside(self) -> str:
        """The other value as it is written, without its unit; empty without one."""
        if self.other_word or math.isnan(self.other):
            return self.other_word
        return self._written(self.other, self.other_last, "–")

    @property
    def is_pair(self) -> bool:
        """Whether both values stand with equal right."""
        return bool(self.value_is and self.beside)

    def _between(self, low: float, high: float) -> str:
        """An interval with the digits of this figure."""
        has_low = math.isfinite(low)
        has_high = math.isfinite(high)
        if has_low and has_high:
            return apart(low, high, self._digits, "f")
        if has_low:
            return f"above {self._one(low)}, open"
        return f"below {self._one(high)}, open" if has_high else ""

    def _written(self, first: float, last: float, between: str) -> str:
        """One number, or two where they differ."""
        if math.isnan(last):
            return self._one(first)
        return between.join(dict.fromkeys([self._one(first), self._one(last)]))

    def _one(self, value: float) -> str:
        """A number with the digits of this figure."""
        if math.isnan(value):
            return "–"
        return f"{value:.{self._digits}f}".replace("-", "−")

    @property
    def _digits(self) -> int:
        """Digits behind the point: two that matter below 10, three from there on."""
        if self.decimals is not None:
            return self.decimals
        return decimals(self.value)


def apart(low: float, high: float, digits: int, form: str) -> str:
    """Write both ends of an interval, with as many digits as tell them apart.

    Parameters
    ----------
    low, high
        The ends.
    digits
        Digits behind the point, or of ``#g`` those that matter, if these are enough.
    form
        Format of a number without its digits: ``f``, ``g`` or ``#g``.

    Returns
    -------
    str
        The text.

    Examples
    --------
    >>> apart(0.1717, 0.1721, 2, "f"), apart(0.17, 0.17, 2, "f")
    ('0.1717 … 0.1721', '0.17 … 0.17')
    """
    flag, kind = form[:-1], form[-1]
    ends = (low, high)
    texts = [f"{end:{flag}.{digits}{kind}}" for end in ends]
    while texts[0] == texts[1] and low != high and digits < MOST_DIGITS:
        digits += 1
        texts = [f"{end:{flag}.{digits}{kind}}" for end in ends]
    return " … ".join(texts).replace("-", "−")


def decimals(value: float) -> int:
    """Count the digits behind the point with which a number is told.

    Parameters
    ----------
    value
        The number.

    Returns
    -------
    int
        As many as leave two digits that matter below 10, and three from there on.

    Examples
    --------
    >>> [decimals(value) for value in (0.0412, 8.61, 13.2, 149.0)]
    [3, 1, 1, 0]
    """
    if value == 0 or not math.isfinite(value):
        return 1
    size = math.floor(math.log10(abs(value)))
    return max(0, (1 if size < 1 else 2) - size)


@dataclass(frozen=True)
class Worth:
    """What an answer is worth.

    Attributes
    ----------
    mark
        The kind of worth.
    word
        In a few words: usable, usable with something, not usable and why.
    advice
        A sentence that says what to do.
    """

    mark: Mark
    word: str
    advice: str = ""


@dataclass(frozen=True)
class Card:
    """An answer that a report can quote.

    Attributes
    ----------
    question
        The question in words.
    scene
        One line: shape, size, grains, fluid.
    numbers
        At most three large figures.
    source
        Where the values beside the numbers are from.
    worth
        What the answer is worth, and what to do.
    heads
        Heads of the source and of the worth.
    """

    question: str
    scene: str
    numbers: tuple[Number, ...]
    source: str
    worth: Worth
    heads: tuple[str, str] = ("Where the numbers come from", "Can it be used?")

    def __post_init__(self) -> None:
        if len(self.numbers) > MOST_NUMBERS:
            raise ValueError(f"a card has at most {MOST_NUMBERS} numbers")


def lines(card: Card) -> Iterator[str]:
    """Write a card for a terminal.

    Yields
    ------
    str
        Its lines.
    """
    return map(terminal.plain, marked_lines(card))


def marked_lines(card: Card) -> Iterator[str]:
    """Write a card for a terminal, with the marks of `terminal.bold`.

    Yields
    ------
    str
        Its lines; the question, the numbers and the verdict are marked.
    """
    yield from map(terminal.bold, in_terminal(card.question))
    if card.scene:
        yield from in_terminal(card.scene)
    yield ""
    yield from _numbers(card.numbers)
    yield ""
    word = card.worth.word
    said = f"{DISCS[card.worth.mark]} {word[:1].upper()}{word[1:]}."
    first, *others = in_terminal(f"{said} {card.worth.advice}".strip(), "  ", "    ")
    # a long verdict is marked up to the end of its first line
    ends = min(len(first), len(INDENT) + len(said))
    yield f"{INDENT}{terminal.bold(first[len(INDENT) : ends])}{first[ends:]}"
    yield from others
    intervals = [*_intervals(card.numbers)]
    if card.source or intervals:
        yield ""
    for text in intervals:
        yield from in_terminal(text, "  ", "    ")
    if card.source:
        head, _ = card.heads
        yield from in_terminal(f"{head}: {card.source}", "  ", "    ")


def _numbers(numbers: Sequence[Number]) -> Iterator[str]:
    """The figures below each other, with their intervals, and what each is."""
    if not numbers:
        return
    has_interval = any(number.interval for number in numbers)
    others = [*dict.fromkeys(each.other_is for each in numbers if each.beside)]
    pairs = [*dict.fromkeys(each.value_is for each in numbers if each.is_pair)]
    heads = [pairs[0] if len(pairs) == 1 else "answer"]
    heads += ["interval"] if has_interval else []
    heads += ["other value" if len(others) > 1 else others[0]] if others else []
    rows = []
    for number in numbers:
        cells = [f"{number.figure} {number.unit}".strip()]
        cells += [number.interval or "-"] if has_interval else []
        beside = number.beside or "-"
        if len(others) > 1 and number.beside:
            beside = f"{beside} ({number.other_is})"
        cells += [beside] if others else []
        told = filter(None, [number.meaning, number.note])
        rows.append([*cells, "; ".join(told)])
    *columns, _ = zip(*rows, strict=True)
    widths = [
        max(min(max(map(len, column)), MOST_LETTERS), head_width(head))
        for head, column in zip(heads, columns, strict=True)
    ]
    widths.append(WIDTH - len(INDENT) - sum(width + BETWEEN for width in widths))
    if len(heads) > 1:
        for line in table([[*heads, ""]], widths=widths):
            yield f"{INDENT}{line}".rstrip()
    for line in table(rows, widths=widths):
        figure = line[: widths[0]].rstrip()
        marked = f"{terminal.bold(figure)}{line[len(figure) :]}"
        yield f"{INDENT}{marked}".rstrip()


def _intervals(numbers: Sequence[Number]) -> Iterator[str]:
    """What the intervals of some figures contain, once each."""
    of_what = [each.interval_of for each in numbers if each.interval]
    told = [*dict.fromkeys(filter(None, of_what))]
    for each in numbers:
        if each.interval and each.interval_of in told:
            told.remove(each.interval_of)
            is_only = len({*of_what}) == 1
            of = f"{each.figure} {each.unit}".strip()
            head = "Interval" if is_only else f"Interval of {of}"
            beyond = f" Not in it: {each.not_in}." if each.not_in else ""
            yield f"{head}: {each.interval_of}.{beyond}"
        if each.is_pair and each.other_interval:
            of = f"{each.beside} {each.unit}"
            yield f"Interval of {of}, {each.other_is}: {each.other_interval}."


def in_terminal(text: str, first: str = "", later: str = "") -> list[str]:
    """Break a text into lines of a terminal.

    Parameters
    ----------
    text
        The text.
    first, later
        What stands before its first line, and before the others.

    Returns
    -------
    list of str
        The lines, of at most `WIDTH` letters where no word is longer.
    """
    return textwrap.wrap(
        text,
        WIDTH,
        initial_indent=first,
        subsequent_indent=later,
        break_long_words=False,
        break_on_hyphens=False,
        drop_whitespace=True,
    ) or [first.rstrip()]


@dataclass(frozen=True)
class Remark:
    """Caveats of an answer.

    Attributes
    ----------
    head
        A short sentence.
    text
        Its numbers.
    """

    head: str
    text: str


def remark_lines(remarks: Iterable[Remark]) -> Iterator[str]:
    """Write the caveats of an answer for a terminal.

    Parameters
    ----------
    remarks
        The remarks.

    Yields
    ------
    str
        A heading and the lines of each; nothing without remarks.
    """
    listed = list(remarks)
    if listed:
        yield "Caveats"
    for remark in listed:
        yield from in_terminal(f"{remark.head} {remark.text}".strip(), "  - ", "    ")
