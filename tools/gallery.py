"""The page docs/gallery.md and its pictures, from runs of the presets.

python tools/gallery.py DIRECTORY

DIRECTORY holds the results of each preset below, in a directory of its name, as
`orchestrator study PRESET --out DIRECTORY/PRESET > DIRECTORY/PRESET.txt` writes them; those of
`COMMANDS` are run by another command. The pictures are drawn by chromium from the figures of the runs.
"""

import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from PIL import Image, ImageChops, ImageOps

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "figures"
SHOWN = {
    "first-look": "bed-alpha15.svg",
    "dune": "where.svg",
    "ripples": "bed-alpha12.svg",
    "fence": "where.svg",
    "stockpile": "loss.svg",
    "cone": "least.svg",
    "hills": "hills.svg",
    "poured": "bed-alpha0.svg",
    "mixture": "hiding.svg",
    "shields": "shields.svg",
    "paper": "fractions-alpha15-eq10.svg",
    "ladder": "share-within.svg",
}
"""The figure that is shown of each preset, or of what another command makes of one."""
COMMANDS = {
    "stockpile": "erosion stockpile",
    "ladder": "ladder first-look",
}
"""Commands of presets that `study PRESET` does not run."""
OF = {"ladder": "first-look"}
"""The preset of a section with another name."""
NOTES = {
    "paper": "The claims one by one: [paper.md](paper.md).",
    "ladder": "What a ladder is, and what its lines are for: [ladder.md](ladder.md).",
}
"""What is added to the section of a preset."""
WHOLE = ("ladder",)
"""Sections whose answer is shown whole: lines for a study file stand below the card."""
WIDE = 900  # pixels
SMALL = (360, 200)  # pixels
"""Size of the pictures of the cards at the head of the page."""
CARDS = 3
"""Cards of a row."""
CARD = re.compile(r"(?ms)^## ([^\n]+)\n.*?^!\[([\w-]+): ([^\]]+)\]")
"""The heading, the name and the question of a section."""
COLOURS = 256
HEAD = """\
# Gallery of results

Each section has a preset, the answer that its command prints, and a picture of its page. A preset is a
study file: copy it, change a value and run the copy. This page is made by `python tools/gallery.py DIRECTORY`
from runs of the presets in that directory.
"""
END = """\
## Where to go next

- [commands.md](commands.md): all presets.
- [study-file.md](study-file.md): the fields of a study file.
- [result-page.md](result-page.md): how to read the page of a study.
"""


def main(directory: Path) -> None:
    """Write the page and its pictures."""
    sections = [section(directory, preset) for preset in SHOWN]
    text = "\n".join([HEAD, grid(sections), *sections, END])
    (ROOT / "docs" / "gallery.md").write_text(text, encoding="utf-8")


def grid(sections: Sequence[str]) -> str:
    """The cards at the head of the page: a small picture and a question, which link."""
    cells = []
    for text in sections:
        (heading, name, question), *_ = CARD.findall(text)
        picture = f"figures/gallery-{name}-small.png"
        anchor = heading.lower().replace(" ", "-")
        small(PICTURES / f"gallery-{name}.png")
        link = f"[![{heading}]({picture})](#{anchor})"
        cells.append(f"{link}<br>**[{heading}](#{anchor})**<br>{question}")
    cells += [""] * (-len(cells) % CARDS)
    rows = [cells[at : at + CARDS] for at in range(0, len(cells), CARDS)]
    empty = [""] * CARDS
    lines = [empty, ["---"] * CARDS, *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def small(picture: Path) -> None:
    """Make the picture of a card, all of it, beside the large one."""
    with Image.open(picture) as image:
        card = ImageOps.pad(image.convert("RGB"), SMALL, color="white")
    few = card.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    few.save(picture.with_stem(f"{picture.stem}-small"), optimize=True)


def section(directory: Path, preset: str) -> str:
    """The section of a preset; its picture is drawn."""
    figure = directory / preset / "figures" / SHOWN[preset]
    draw(figure, PICTURES / f"gallery-{preset}.png")
    of = OF.get(preset, preset)
    (file,) = ROOT.glob(f"orchestrator/*/presets/{of}.toml")
    answer = (directory / f"{preset}.txt").read_text(encoding="utf-8")
    card = shortened(answer, is_whole=preset in WHOLE)
    question = " ".join(card.partition("?")[0].split()) + "?"
    command = COMMANDS.get(preset, f"study {preset}")
    lines = [
        f"## {preset}" if of == preset else f"## {preset} of {of}",
        "",
        f"`orchestrator {command}`, file [{file.name}](../{file.relative_to(ROOT)})",
        "",
        "```",
        card,
        "```",
        "",
        f"![{preset}: {question}](figures/gallery-{preset}.png)",
        "",
    ]
    if preset in NOTES:
        lines += [NOTES[preset], ""]
    return "\n".join(lines)


def shortened(answer: str, *, is_whole: bool = False) -> str:
    """The card of an answer, or all of it but the name of the page.

    A card is a first paragraph, and lines that are indented.
    """
    head, _, rest = answer.partition("\n\n")
    lines = []
    for line in rest.splitlines():
        is_of_card = not line.strip() or line.startswith("  ")
        if line.startswith("/") or not (is_of_card or is_whole):
            break
        lines.append(line.rstrip())
    return "\n".join([head, "", *lines]).strip()


def draw(figure: Path, picture: Path) -> None:
    """Make a small PNG of an SVG figure."""
    with tempfile.TemporaryDirectory() as scratch:
        shot = Path(scratch) / "shot.png"
        page = Path(scratch) / "page.html"
        style = f"body {{ margin: 0 }} img {{ width: {WIDE}px }}"
        page.write_text(
            f"<style>{style}</style><img src='{figure.absolute().as_uri()}'>"
        )
        subprocess.run(
            [
                *("chromium", "--headless", "--no-sandbox", "--disable-gpu"),
                *("--disable-background-networking", "--hide-scrollbars"),
                *(f"--user-data-dir={scratch}/profile", f"--window-size={WIDE},2400"),
                *(f"--screenshot={shot}", page.as_uri()),
            ],
            check=True,
            capture_output=True,
        )
        whole = Image.open(shot).convert("RGB")
        empty = Image.new("RGB", whole.size, "white")
        box = ImageChops.difference(whole, empty).getbbox()
        if box is None:
            raise SystemExit(f"{figure}: chromium drew nothing")
        shown = whole.crop((0, 0, WIDE, box[3]))
        few = shown.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
        few.save(picture, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
