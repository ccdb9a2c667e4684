"""Names of directions: the letters of a compass in several languages.

O is the east in German and the west in French; which is meant follows from the others.
"""

from collections.abc import Sequence

POINTS = "N NNE NE ENE E ESE SE SSE S SSW SW WSW W WNW NW NNW"
ENGLISH = tuple(POINTS.split(" "))
"""Points of the compass, from north over east."""
LETTERS = {
    "English": {"n": "n", "e": "e", "s": "s", "w": "w"},
    "German": {"n": "n", "o": "e", "s": "s", "w": "w"},
    "Dutch": {"n": "n", "o": "e", "z": "s", "w": "w"},
    "French": {"n": "n", "e": "e", "s": "s", "o": "w"},
    "Nordic": {"n": "n", "ø": "e", "s": "s", "v": "w"},
    "Swedish": {"n": "n", "ö": "e", "s": "s", "v": "w"},
}
"""What the letters mean, by the languages that write them so."""
WORDS = {
    "north": "n",
    "nord": "n",
    "noord": "n",
    "norte": "n",
    "east": "e",
    "ost": "e",
    "oost": "e",
    "est": "e",
    "este": "e",
    "south": "s",
    "süd": "s",
    "sued": "s",
    "zuid": "s",
    "sud": "s",
    "sur": "s",
    "west": "w",
    "ouest": "w",
    "oeste": "w",
}
"""Whole words for the four winds."""
CALMS = (
    "calm",
    "calms",
    "calme",
    "c",
    "kalm",
    "stille",
    "windstille",
    "windstil",
    "cal",
)
"""Words for no wind."""
VARIABLE = ("vrb", "var", "variable", "umlaufend", "veranderlijk")
"""Words for a wind of no direction."""


def degrees_of(cells: Sequence[str]) -> list[float] | None:
    """Find the degrees that names of directions stand for.

    Parameters
    ----------
    cells
        The names, or degrees, all of one table.

    Returns
    -------
    list of float or None
        Degrees from north over east; None if one is no direction, or they may mean two.

    Examples
    --------
    >>> degrees_of(["N", "O", "S", "W"]), degrees_of(["N", "E", "S", "O"])
    ([0.0, 90.0, 180.0, 270.0], [0.0, 90.0, 180.0, 270.0])
    >>> print(degrees_of(["N", "O"]))
    None
    """
    bare = [_bare(cell) for cell in cells]
    read = [_by(bare, of) for of in LETTERS.values()]
    found = {tuple(made) for made in read if made}
    return list(*found) if len(found) == 1 else None


def unknown(cells: Sequence[str]) -> str:
    """Find the first name that is no direction in any language.

    Parameters
    ----------
    cells
        The names.

    Returns
    -------
    str
        The name; where all are known, the first one that may mean two.
    """
    for cell in cells:
        if not any(_by([_bare(cell)], of) for of in LETTERS.values()):
            return cell
    return next((cell for cell in cells if "o" in cell.lower()), cells[0])


def _bare(cell: str) -> str:
    """A name in small letters, whole words as letters of English."""
    name = cell.strip().lower()
    for mark in ("-", " ", "_", "."):
        name = name.replace(mark, "")
    for word in sorted(WORDS, key=len, reverse=True):
        name = name.replace(word, WORDS[word].upper())
    return name


def _by(names: Sequence[str], letters: dict[str, str]) -> list[float] | None:
    """The degrees of names by what their letters mean; None if one has none."""
    found = []
    for name in names:
        meant = "".join(
            letter.lower() if letter.isupper() else letters.get(letter, "?")
            for letter in name
        ).upper()
        if meant in ENGLISH:
            found.append(360 * ENGLISH.index(meant) / len(ENGLISH))
            continue
        try:
            found.append(float(name))
        except ValueError:
            return None
    return found
