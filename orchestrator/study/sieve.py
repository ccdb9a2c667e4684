"""Sieve tables as laboratories write them: classes of grains, and what was cut.

A table has the openings of its sieves in mm, um, phi or by the numbers of ASTM E11, and
for each what passes it or what stays on it. Grains between two sieves are a class with
the geometric mean of both as its diameter.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from orchestrator.digits import number as counted
from orchestrator.digits import rounded
from orchestrator.errors import InputError
from orchestrator.study.cells import POINT, Marks, TextTable, marks_of, read_cells
from orchestrator.study.heads import name_of
from orchestrator.study.lengths import INCH, LENGTHS, UNIT_NAMES, shown_unit

LARGEST_RATIO = 10.0
"""Largest ratio of a mixture's grains: the time of DEM rises with its square."""
CLASSES = ("diameter_m", "fraction")
"""Columns of a sieve table of classes."""
PASSING = ("sieve_mm", "passing_percent")
"""Columns of a sieve table of what passes."""
SIZE = (
    "sieve",
    "sieves",
    "sieve size",
    "sieve opening",
    "sieve aperture",
    "sieve no",
    "sieve no.",
    "sieve number",
    "mesh",
    "mesh size",
    "size",
    "size class",
    "grain size",
    "particle size",
    "particle diameter",
    "diameter",
    "d",
    "opening",
    "aperture",
    "phi",
    "φ",
    "phi size",
    "grain size phi",
    "sieve phi",
    "sieb",
    "siebgröße",
    "siebgroesse",
    "siebweite",
    "maschenweite",
    "korngröße",
    "korngroesse",
    "korndurchmesser",
    "durchmesser",
    "fraktion",
    "tamis",
    "tamiz",
    "zeef",
    "zeefmaat",
)
"""Columns of the openings of sieves or of the diameters of classes."""
PASSES = (
    "passing",
    "passes",
    "passed",
    "pass",
    "finer",
    "undersize",
    "durchgang",
    "siebdurchgang",
    "doorval",
    "tamisat",
    "passant",
    "pasa",
    "pasante",
)
"""Words for what passes a sieve."""
STAYS = (
    "retained",
    "retain",
    "rückstand",
    "rueckstand",
    "siebrückstand",
    "zeefrest",
    "refus",
    "retenu",
    "retenido",
)
"""Words for what stays on a sieve."""
COARSER = ("coarser", "oversize", "siebsummenrückstand", "summenrückstand")
"""Words for all that is coarser than a sieve."""
AMOUNT = (
    "weight",
    "wt",
    "mass",
    "masse",
    "gewicht",
    "massenanteil",
    "masseanteil",
    "percent",
    "frequency",
    "volume",
    "poids",
    "peso",
)
"""Words for an amount, which is that on a sieve if nothing else is said."""
PANS = ("pan", "base pan", "pfanne", "boden", "schale", "bottom", "receiver", "tray",
        "rest", "fond", "fondo", "bodem", "blind", "fines")  # fmt: skip
"""Words for what has passed all sieves."""
TOTALS = ("total", "totals", "sum", "summe", "gesamt", "totaal", "somme")
ASTM: Mapping[str, float] = {
    "3.5": 5.6, "4": 4.75, "5": 4.0, "6": 3.35, "7": 2.8, "8": 2.36, "10": 2.0,
    "12": 1.7, "14": 1.4, "16": 1.18, "18": 1.0, "20": 0.85, "25": 0.71, "30": 0.6,
    "35": 0.5, "40": 0.425, "45": 0.355, "50": 0.3, "60": 0.25, "70": 0.212,
    "80": 0.18, "100": 0.15, "120": 0.125, "140": 0.106, "170": 0.09, "200": 0.075,
    "230": 0.063, "270": 0.053, "325": 0.045, "400": 0.038,
}  # fmt: skip
"""Openings of sieves by their numbers in ASTM E11, mm."""
INCHES: Mapping[str, float] = {
    "4": 100.0, "3 1/2": 90.0, "3": 75.0, "2 1/2": 63.0, "2": 50.0, "1 3/4": 45.0,
    "1 1/2": 37.5, "1.5": 37.5, "1 1/4": 31.5, "1": 25.0, "7/8": 22.4, "3/4": 19.0,
    "5/8": 16.0, "1/2": 12.5, "7/16": 11.2, "3/8": 9.5, "5/16": 8.0, "1/4": 6.3,
}  # fmt: skip
"""Openings of sieves by inches in ASTM E11, mm."""
OF_NUMBER = re.compile(r"(?:no\.?|nr\.?|#|mesh) *([\d.]+)|([\d.]+) *(?:mesh)")
FRACTION = re.compile(r"(?:\d+[ -])?\d+/\d+")
"""Inches, in which alone openings are written so."""
OF_INCHES = re.compile(r"([\d ./]+?) *(?:in\.?|inch|inches|\"|″|”)")
_LENGTH = r"([+-]?[\d.,]+(?:e[+-]?\d+)?)"
_UNIT = rf"({UNIT_NAMES})?"
RANGE = re.compile(
    rf"{_LENGTH} *{_UNIT} *(?:-|–|—|to|bis|\.\.\.|…) *{_LENGTH} *{_UNIT}"
)
ONE = re.compile(rf"([<>≥≤]?) *=? *{_LENGTH} *{_UNIT}")
OPEN_TOP = 10.0
"""Most per cent of the mass on the largest sieve: these grains have no upper end."""
OFF_TOTAL = 3.0
"""Largest difference of percentages that are retained from 100: losses of a sieving."""
OFF_COLUMNS = 1.0
"""Largest difference of two columns of one table, in per cent of the mass."""
MOST_CUT = 0.5
"""Largest part of the mass that may be cut."""
REMEDY = (
    f"the first line must name a column of openings ({', '.join(SIZE[:4])}, size, phi, "
    "Siebweite, …, with its unit: mm, um or phi) and one of what passes or stays "
    "(passing, finer, Durchgang; retained, cumulative retained, coarser, weight, "
    f"Rückstand; in % or g); or {','.join(CLASSES)}; then numbers"
)
TOP_REMEDY = "begin with the sieve that all pass"
PERCENT = re.compile(r"per ?cent|pct|%")
_MASS = re.compile(r"[(\[_ ](g|gr|kg|gramm|grams)[)\]]?$")


@dataclass(frozen=True)
class Cut:
    """What a bed leaves out of a sieve table.

    Attributes
    ----------
    low, high
        Between which diameters it lies, m; 0 and infinity where it has no end.
    fraction
        Its part of the whole mass.
    """

    low: float
    high: float
    fraction: float

    @property
    def is_fine(self) -> bool:
        """Whether it is finer than all that is kept."""
        return math.isfinite(self.high)

    @property
    def said(self) -> str:
        """What was cut, in words."""
        part = f"{100 * self.fraction:.3g} % of the mass"
        if self.is_fine:
            return f"{part} is finer than {1e3 * self.high:.3g} mm and was cut"
        return f"{part} is coarser than {1e3 * self.low:.3g} mm and was cut"


@dataclass(frozen=True)
class SieveTable:
    """The classes of a sieve table.

    Attributes
    ----------
    rows
        Diameter, m, rising, and fraction of the mass of each class.
    said
        What was understood, in words.
    cuts
        What was left out.
    """

    rows: tuple[tuple[float, float], ...]
    said: str
    cuts: tuple[Cut, ...] = ()


@dataclass(frozen=True)
class _Class:
    """Grains between two openings, mm, and their amount."""

    low: float
    high: float
    amount: float

    @property
    def diameter(self) -> float:
        """Geometric mean of its ends, m."""
        return rounded(1e-3 * math.sqrt(self.low * self.high))


def read_sieve(text: str, where: str) -> SieveTable:
    """Read a sieve table.

    Parameters
    ----------
    text
        The file.
    where
        The file, for messages.

    Returns
    -------
    SieveTable
        Its classes. Those of a table of what passes or stays are cut to `LARGEST_RATIO`
        in size, and their fractions add up to 1.

    Raises
    ------
    InputError
        With the line and the remedy.
    """
    table = read_cells(text, _is_head, where, REMEDY)
    size = _size_column(table, where)
    values = _value_columns(table, size)
    if not values:
        return _of_classes(table, size, where)
    return _Sieving(table, size, values, where).read()


def _is_head(cells: Sequence[str]) -> bool:
    """Whether some cells name a sieve and what passes it or stays on it."""
    has_size = [at for at, cell in enumerate(cells) if _is_size(cell)]
    others = [cell for at, cell in enumerate(cells) if at not in has_size]
    is_class = any(cell.lower() == CLASSES[1] for cell in others)
    return bool(has_size) and (is_class or any(map(_kind_of, others)))


def _is_size(cell: str) -> bool:
    """Whether a column has the openings of sieves."""
    name = _without_phi(cell)[0]
    if _bare_unit(name):
        return True
    return name_of(name).plain in SIZE and not PERCENT.search(cell.lower())


def _bare_unit(cell: str) -> str:
    """The unit that a column of openings has for a name; empty for another name."""
    unit = cell.strip(" ()[]").lower()
    return unit if LENGTHS.get(unit, 1.0) < 1 and unit.isalpha() else ""


def _without_phi(cell: str) -> tuple[str, bool]:
    """A name without the unit phi, and whether it had it."""
    bare, marks = re.subn(r"[ _]*[(\[] *(phi|φ|ϕ) *[)\]]|_phi$", "", cell.lower())
    return bare, bool(marks) or bare.strip() in ("phi", "φ", "ϕ")


def _kind_of(cell: str) -> str:
    """What a column has of each sieve: "passing", "cumulative", "coarser", "retained".

    It is empty for other columns.
    """
    name = " ".join(cell.lower().split())
    words = _words(cell)
    is_sum = any(word.startswith(("cum", "kum", "summe")) for word in words)
    if any(word in words for word in PASSES):
        return "passing"
    if any(word in words for word in COARSER):
        return "coarser"
    if any(word in words for word in STAYS):
        return "coarser" if is_sum else "retained"
    if any(word in words for word in AMOUNT) or PERCENT.search(name):
        return "cumulative" if is_sum else "retained"
    return "cumulative" if is_sum else ""


def _words(cell: str) -> set[str]:
    """The words of the name of a column."""
    return set(re.findall(r"[^\W\d_]+", cell.lower()))


def _is_told(cell: str) -> bool:
    """Whether a column says that it is of what passes or stays."""
    return bool(_words(cell) & {*PASSES, *STAYS, *COARSER})


def _is_total(cell: str) -> bool:
    """Whether a line with such an opening has totals."""
    return cell.lower().strip(" :") in TOTALS


def _size_column(table: TextTable, where: str) -> int:
    """The place of the column of openings."""
    called = [at for at, name in enumerate(table.names) if _is_size(name)]
    with_unit = [at for at in called if name_of(table.names[at]).unit]
    found = with_unit or called
    if len(found) > 1 and len({_mm_unit(table.names[at]) for at in found}) > 1:
        # the openings of one table in two units are the same openings
        return next((at for at in found if _mm_unit(table.names[at]) == 1), found[0])
    if len(found) != 1:
        listed = " or ".join(table.names[at] for at in found)
        what = f"which column has the openings: {listed}?"
        raise InputError(what, f"{where}: line {table.head}", "leave one of them")
    return found[0]


def _mm_unit(name: str) -> float | None:
    """The unit of a column of openings, mm; 0 of phi, None where it says none."""
    bare, is_phi = _without_phi(name)
    if is_phi:
        return 0.0
    unit = name_of(bare).unit or _bare_unit(bare)
    return rounded(LENGTHS[unit] / LENGTHS["mm"]) if unit else None


def _value_columns(table: TextTable, size: int) -> dict[int, str]:
    """Columns of what passes or stays, by their places, those to go by first."""
    order = ("passing", "coarser", "cumulative", "retained")
    found = {
        at: kind
        for at, name in enumerate(table.names)
        if at != size and not _is_size(name) and (kind := _kind_of(name))
    }
    found = {at: kind for at, kind in found.items() if any(table.column(at))}
    told = {at: kind for at, kind in found.items() if _is_told(table.names[at])}
    # an amount is that on a sieve only where nothing else is named so
    found = told or found

    def rank(at: int) -> tuple[int, bool]:
        return order.index(found[at]), not PERCENT.search(table.names[at].lower())

    return {at: found[at] for at in sorted(found, key=rank)}


def _of_classes(table: TextTable, size: int, where: str) -> SieveTable:
    """Classes by their diameters and fractions."""
    parts = [at for at, name in enumerate(table.names) if name.lower() == CLASSES[1]]
    unit = _mm_unit(table.names[size])
    if len(parts) != 1 or unit is None:
        raise InputError(
            "its unit of the diameters is missing, or it has two columns of fractions",
            f"{where}: line {table.head}",
            REMEDY,
        )
    marks = _marks(table, [size, parts[0]], where)
    rows = []
    for line, cells in table.cells([size, parts[0]]):
        place = f"{where}: line {line}"
        one, fraction = _numbers(cells, [table.names[size], CLASSES[1]], marks, place)
        diameter = 1e-3 * (2.0**-one if unit == 0 else unit * one)
        if unit == LENGTHS["m"] / LENGTHS["mm"]:
            diameter = one
        if not diameter > 0:
            what = f"{table.names[size]}: {one:g} is no size"
            raise InputError(what, place, "diameters are above 0")
        if not fraction >= 0:
            what = f"{CLASSES[1]}: {fraction:g} is no part of the mass"
            raise InputError(what, place, "fractions are from 0 to 1")
        rows.append((diameter if unit == 1e3 else rounded(diameter), fraction))
    said = f"{counted(len(rows), 'size')} by their diameters ({table.names[size]})"
    return SieveTable(tuple(rows), _with_marks(said, marks))


def _marks(table: TextTable, columns: Sequence[int], where: str) -> Marks:
    """How the numbers of some columns are written."""
    try:
        return marks_of(
            word
            for at in columns
            for cell in table.column(at)
            for word in re.findall(r"[+-]?\d[\d.,]*(?:e[+-]?\d+)?", cell)
        )
    except ValueError as error:
        raise InputError(str(error), where, REMEDY) from None


def _numbers(
    cells: Sequence[str], names: Sequence[str], marks: Marks, place: str
) -> list[float]:
    """The numbers of some cells of a line."""
    found = []
    for cell, name in zip(cells, names, strict=True):
        is_amount = _kind_of(name) == "retained"
        number = "the mass on this sieve, or 0" if is_amount else "its number"
        remedy = f"write {number}, or remove the line"
        if not cell:
            raise InputError(f"the cell of {name} is empty", place, remedy)
        try:
            found.append(marks.number(cell))
        except ValueError as error:
            raise InputError(f"{name}: {error}", place, remedy) from None
    return found


def _with_marks(said: str, marks: Marks) -> str:
    """Words with those on the numbers of a file."""
    return f"{said}, {marks.said}" if marks.said else said


_Line = tuple[int, tuple[float, float], dict[int, float]]
"""Number of a line, its openings, mm, from and to, and its amounts by their columns.

Both openings are alike of one sieve, and 0 of the pan.
"""


@dataclass
class _Sieving:
    """A table of what passes or stays, while it is read."""

    table: TextTable
    size: int
    values: dict[int, str]
    where: str
    marks: Marks = field(default_factory=Marks)
    other_sizes: Sequence[int] = ()

    def read(self) -> SieveTable:
        """Its classes."""
        # a table may name its sieves in two columns, of which the pan has one
        self.other_sizes = [
            at
            for at, name in enumerate(self.table.names)
            if at != self.size and _is_size(name)
        ]
        self.marks = _marks(self.table, [self.size, *self.values], self.where)
        lines = self._lines()
        first, *others = self.values
        classes = self._classes(lines, first)
        for other in others:
            self._check_alike(classes, self._classes(lines, other), first, other)
        return self._cut(classes, first)

    def _lines(self) -> list[_Line]:
        """Number, openings and amounts of each line, the coarsest first."""
        found: list[_Line] = []
        first = next(iter(self.values))
        columns = [*self.values, self.size, *self.other_sizes]
        for line, cells in self.table.cells(columns):
            amounts = [cell.rstrip("% ") for cell in cells[: len(self.values)]]
            size = next(filter(None, cells[len(self.values) :]), "")
            if not any([size, *amounts]):
                continue
            place = f"{self.where}: line {line}"
            if _is_total(size):
                continue
            opening = self._opening(size, place)
            given = {}
            for at, cell in zip(self.values, amounts, strict=True):
                if not cell and (at != first or opening == (0.0, 0.0)):
                    continue
                (given[at],) = _numbers(
                    [cell], [self.table.names[at]], self.marks, place
                )
            found.append((line, opening, given))
        if len(found) < 2:
            what = "one class lies between two sieves"
            raise InputError(what, self.where, "give two sieves at least")
        found.sort(key=lambda each: (-each[1][1], -each[1][0]))
        every = range(len(self.table.names))
        self._check_totals([*self.table.cells(every)])
        for (_, one, _), (line, other, _) in pairwise(found):
            if one == other:
                what = f"{other[1]:g} mm stands twice"
                raise InputError(what, f"{self.where}: line {line}", "leave one line")
        return found

    def _check_totals(self, rows: Sequence[tuple[int, list[str]]]) -> None:
        """Refuse a total that is not the sum of what stays on the sieves."""
        totals = [row for row in rows if _is_total(row[1][self.size])]
        for at, name in enumerate(self.table.names):
            if at == self.size or self.values.get(at, _kind_of(name)) != "retained":
                continue
            for line, cells in totals:
                others = [row[at] for _, row in rows if not _is_total(row[self.size])]
                self._check_total(cells[at], others, name, line)

    def _check_total(
        self, cell: str, others: Sequence[str], name: str, line: int
    ) -> None:
        """Refuse a total that is not the sum of the other cells of its column."""
        given = [one.rstrip("% ") for one in (cell, *others)]
        try:
            marks = marks_of(given)
            total, *amounts = (marks.number(one) if one else math.nan for one in given)
        except ValueError:
            return  # a column that is not read says nothing
        known = [amount for amount in amounts if not math.isnan(amount)] or [0.0]
        is_of_sums = known in (sorted(known), sorted(known, reverse=True)) and any(
            math.isclose(total, end) for end in (known[0], known[-1])
        )
        if math.isnan(total) or is_of_sums:
            return
        if abs(sum(known) - total) > OFF_COLUMNS / 100 * abs(total):
            what = f"{name}: the total is {total:g}, and the lines add up to "
            what = f"{what}{sum(known):.6g}"
            remedy = "mend a line, or remove that of the total"
            raise InputError(what, f"{self.where}: line {line}", remedy)

    def _opening(self, cell: str, place: str) -> tuple[float, float]:
        """The openings that a cell names, mm; 0 of the pan."""
        name = self.table.names[self.size]
        bare = " ".join(cell.lower().replace("−", "-").split())
        if bare.strip(" .()") in PANS or bare.strip(" .()").startswith("pan "):
            return 0.0, 0.0
        unit = _mm_unit(name)
        numbered = OF_NUMBER.fullmatch(bare)
        if numbered:
            return self._astm(ASTM, numbered[1] or numbered[2], cell, place)
        in_inches = self._inches(bare, unit, cell, place)
        if in_inches is not None:
            return in_inches
        between = (
            RANGE.fullmatch(bare) if unit != 0 or not bare.startswith("-") else None
        )
        if between:
            of_both = between[4] or between[2]
            one = self._length(between[1], between[2] or of_both, unit, place)
            other = self._length(between[3], of_both, unit, place)
            return min(one, other), max(one, other)
        alone = ONE.fullmatch(bare)
        if alone is None:
            what = f"{name}: {cell!r} is no sieve"
            pans = ", ".join(PANS[:3])
            remedy = f"openings are above 0, with a unit; the pan is called {pans}"
            raise InputError(what, place, remedy)
        found = self._length(alone[2], alone[3], unit, place)
        if alone[1] in ("<", "≤"):
            return 0.0, found
        if alone[1] in (">", "≥"):
            return found, math.inf
        return found, found

    def _inches(
        self, bare: str, unit: float | None, cell: str, place: str
    ) -> tuple[float, float] | None:
        """The openings of a cell in inches, mm; None for another cell."""
        marked = OF_INCHES.fullmatch(bare)
        is_inch = unit == INCH / LENGTHS["mm"]
        word = marked[1].strip() if marked else bare
        if marked and POINT.fullmatch(word):
            found = self._length(word, "in", unit, place)
            return found, found
        is_fraction = (unit is None or is_inch) and FRACTION.fullmatch(word)
        if marked or is_fraction or (is_inch and word in INCHES):
            return self._astm(INCHES, word.replace("-", " "), cell, place)
        return None

    def _astm(
        self, table: Mapping[str, float], word: str, cell: str, place: str
    ) -> tuple[float, float]:
        """The opening of a sieve by its number or its inches."""
        if word not in table:
            what = f"{cell!r} is no sieve of ASTM E11"
            raise InputError(what, place, "write its opening in mm")
        return table[word], table[word]

    def _length(
        self, cell: str, unit: str | None, of_column: float | None, place: str
    ) -> float:
        """A length in mm: 0 of a pan that is written as 0."""
        name = self.table.names[self.size]
        try:
            value = self.marks.number(cell)
        except ValueError as error:
            raise InputError(f"{name}: {error}", place, REMEDY) from None
        if unit:
            return rounded(value * LENGTHS[unit] / LENGTHS["mm"])
        if of_column is None:
            what = f"{name}: {cell} of which unit"
            remedy = "write it into the first line: Sieve (mm), Sieve (um) or phi"
            raise InputError(what, place, remedy)
        if of_column == 0:
            return rounded(2.0**-value)
        if value < 0:
            what = f"{name}: {value:g} is no sieve"
            remedy = "openings are above 0; is the column phi? Then call it so"
            raise InputError(what, place, remedy)
        return rounded(value * of_column)

    def _classes(
        self,
        lines: Sequence[_Line],
        column: int,
    ) -> list[_Class]:
        """The classes by a column, the coarsest first; amounts in per cent.

        Lines without a number in that column are left out.
        """
        given = [
            (line, opening, of[column]) for line, opening, of in lines if column in of
        ]
        name = self.table.names[column]
        amounts = [amount for *_, amount in given]
        kind = self._direction(amounts, column)
        self.values[column] = kind
        if any(low != high for _, (low, high), _ in given) and kind != "retained":
            what = f"{name}: what passes a range of sizes"
            raise InputError(what, self.where, "name one sieve in each line")
        if kind == "retained":
            return self._of_retained(given, name)
        return self._of_sums(given, name, kind)

    def _direction(self, amounts: Sequence[float], column: int) -> str:
        """What a column has, by its name, or by how its numbers go on."""
        kind = self.values[column]
        if kind == "cumulative":
            return "coarser" if amounts[0] < amounts[-1] else "passing"
        in_percent = PERCENT.search(self.table.names[column].lower())
        is_rising = [*amounts] == sorted(amounts) and amounts[-1] <= 100
        # per cent of single sieves cannot be more than the whole
        if kind == "retained" and in_percent and is_rising:
            return "coarser" if sum(amounts) > 100 + OFF_TOTAL else kind
        return kind

    def _of_retained(
        self, given: list[tuple[int, tuple[float, float], float]], name: str
    ) -> list[_Class]:
        """The classes of what stays on each sieve, or lies in each range."""
        for line, _, amount in given:
            if not amount >= 0:
                raise self._no_part(amount, name, line, "amounts are from 0")
        total = sum(amount for *_, amount in given)
        if not total > 0:
            raise InputError(f"{name}: nothing stays anywhere", self.where, REMEDY)
        if PERCENT.search(name.lower()) and not abs(total - 100) <= OFF_TOTAL:
            what = f"{name}: its per cent add up to {total:.6g}, not to 100"
            remedy = "add the line of the pan, or name the column cumulative or passing"
            raise InputError(what, self.where, remedy)
        classes = []
        above = math.inf
        for _, (low, high), amount in given:
            upper = high if high > low else above
            classes.append(_Class(low, upper, 100 * amount / total))
            above = low
        return classes

    def _of_sums(
        self, given: list[tuple[int, tuple[float, float], float]], name: str, kind: str
    ) -> list[_Class]:
        """The classes of what passes each sieve, or is coarser than it."""
        whole = self._whole([amount for *_, amount in given], name, kind)
        parts = [100 * amount / whole for *_, amount in given]
        for (line, _, amount), part in zip(given, parts, strict=True):
            if not 0 <= part <= 100 + 1e-6:
                raise self._no_part(amount, name, line, f"it is from 0 to {whole:g}")
        finer = parts if kind == "passing" else [100 - part for part in parts]
        classes = []
        above, passed, of_larger = math.inf, 100.0, 0
        for (line, (size, _), _), part in zip(given, finer, strict=True):
            if size == 0.0:
                part = 0.0
            if part > passed + 1e-9:
                larger = f"{passed:g} % pass {above:g} mm"
                what = f"{larger}, and {part:g} % {size:g} mm"
                place = f"{self.where}: line {of_larger}"
                raise InputError(what, place, "a larger sieve lets more pass")
            classes.append(_Class(size, above, passed - part))
            above, passed, of_larger = size, part, line
        if passed > 0:
            classes.append(_Class(0.0, above, passed))
        return classes

    def _no_part(self, amount: float, name: str, line: int, remedy: str) -> InputError:
        """The refusal of an amount that is no part of the mass."""
        what = f"{name}: {amount:g} is no part of the mass"
        return InputError(what, f"{self.where}: line {line}", remedy)

    def _whole(self, amounts: Sequence[float], name: str, kind: str) -> float:
        """The number that is the whole mass in a column of sums."""
        if PERCENT.search(name.lower()):
            return 100.0
        largest = max(amounts)
        if _MASS.search(name.lower()):
            return largest
        for whole in (100.0, 1.0):
            if abs(largest / whole - 1) < 1e-9:
                return whole
        if 1 < largest < 100 and kind == "passing":
            remedy = f"name it {name} (%), or {name} (g)"
            raise InputError(f"{name}: of which whole", self.where, remedy)
        return largest

    def _check_alike(
        self, classes: Sequence[_Class], others: Sequence[_Class], one: int, two: int
    ) -> None:
        """Refuse two columns of one table that contradict each other."""
        of_other = {each.low: each.amount for each in others}
        for each in classes:
            amount = of_other.get(each.low)
            if amount is not None and abs(amount - each.amount) > OFF_COLUMNS:
                names = self.table.names
                what = (
                    f"from {each.low:g} mm on: {each.amount:.3g} % by {names[one]}, "
                    f"{amount:.3g} % by {names[two]}"
                )
                raise InputError(what, self.where, "mend it, or leave one of them")

    def _cut(self, classes: Sequence[_Class], column: int) -> SieveTable:
        """The classes with a size whose ratio is small enough, and what was cut."""
        found = [each for each in classes if each.amount > 1e-9]
        notes = []
        if found and math.isinf(found[0].high):
            found[0], note = self._top(found[0], classes)
            notes.append(note)
        bounded = [each for each in found if each.low > 0]
        bottom = [each for each in found if each.low == 0]
        if not bounded:
            what = "all grains pass the smallest sieve"
            raise InputError(what, self.where, "give sieves between which they lie")
        kept = _widest(bounded)
        finer = [*(each for each in bounded if each.high <= kept[-1].low), *bottom]
        coarser = [each for each in bounded if each.low >= kept[0].high]
        total = sum(each.amount for each in kept)
        cuts = []
        for part, low, high in (
            (finer, 0.0, 1e-3 * kept[-1].low),
            (coarser, 1e-3 * kept[0].high, math.inf),
        ):
            if part:
                amount = sum(each.amount for each in part)
                cuts.append(Cut(low, rounded(high), rounded(amount / 100)))
        if total < 100 * (1 - MOST_CUT):
            what = (
                f"its sizes within {LARGEST_RATIO:g} : 1 are {total:.3g} % of the mass"
            )
            remedy = "give the sand or the gravel alone as a table of its own"
            raise InputError(what, self.where, remedy)
        rows = tuple(
            (each.diameter, rounded(each.amount / total)) for each in reversed(kept)
        )
        return SieveTable(rows, self._said(rows, cuts, notes, column), tuple(cuts))

    def _top(self, top: _Class, classes: Sequence[_Class]) -> tuple[_Class, str]:
        """The class on the largest sieve, with an upper end as the sieves go on."""
        sieves = sorted({each.low for each in classes if each.low > 0}, reverse=True)
        if top.amount > OPEN_TOP or len(sieves) < 2:
            what = f"{100 - top.amount:.4g} % pass the largest sieve, not 100"
            remedy = f"{TOP_REMEDY}: nothing says how large the others are"
            raise InputError(what, self.where, remedy)
        high = rounded(top.low * sieves[0] / sieves[1])
        note = (
            f"{top.amount:.3g} % stay on the largest sieve, and were taken for grains "
            f"up to {high:g} mm, as the sieves go on"
        )
        return _Class(top.low, high, top.amount), note

    def _said_of_unit(self) -> str:
        """What is said of the unit of the openings, if it is no usual one."""
        unit = name_of(_without_phi(self.table.names[self.size])[0]).unit
        is_usual = not unit or LENGTHS[unit] in (LENGTHS["mm"], LENGTHS["um"])
        return "" if is_usual else f" in {shown_unit(unit, 'mm')}"

    def _said(
        self,
        rows: tuple[tuple[float, float], ...],
        cuts: Sequence[Cut],
        notes: Sequence[str],
        column: int,
    ) -> str:
        """What was understood, in words."""
        names = self.table.names
        kinds = {
            "passing": "the part that passes each sieve",
            "coarser": "the part that is coarser than each sieve",
            "cumulative": "sums over the sieves",
            "retained": "the part that stays on each sieve",
        }
        ends = f"{1e3 * rows[0][0]:.3g} to {1e3 * rows[-1][0]:.3g} mm"
        said = (
            f"openings from {names[self.size]!r}{self._said_of_unit()}, "
            f"{kinds[self.values[column]]} from "
            f"{names[column]!r}: {counted(len(rows), 'size')} of {ends}"
        )
        words = [_with_marks(said, self.marks), *notes, *(cut.said for cut in cuts)]
        return "; ".join(words)


def _widest(classes: Sequence[_Class]) -> list[_Class]:
    """Neighbouring classes within the largest ratio that have most of the mass."""
    sizes = np.array([each.diameter for each in classes])
    amounts = np.array([each.amount for each in classes])
    best: tuple[float, int, int] = (-1.0, 0, 0)
    for first in range(len(classes)):
        is_kept = (sizes <= sizes[first]) & (
            sizes * LARGEST_RATIO >= sizes[first] * (1 - 1e-9)
        )
        last = int(np.flatnonzero(is_kept)[-1])
        mass = float(amounts[first : last + 1].sum())
        if mass > best[0] + 1e-9:
            best = (mass, first, last)
    _, first, last = best
    return list(classes[first : last + 1])
