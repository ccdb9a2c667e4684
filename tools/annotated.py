"""Pictures of a page: its upper part for README.md, and with numbered callouts.

The latter is that of docs/result-page.md.

python tools/annotated.py DIRECTORY

DIRECTORY holds the preset `first-look`, which was run. Chromium draws the pictures.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

PICTURE = Path(__file__).parents[1] / "docs" / "figures" / "result-page.png"
SIZE = (1280, 1860)  # pixels
UPPER_PART = PICTURE.with_name("first-look-page.png")
UPPER_SIZE = (1280, 800)
COLOURS = 96
CALLOUTS = (
    "h1",
    ".number strong",
    ".number strong.second",
    ".number .ends",
    ".worth",
    ".bed-box",
    ".slide",
    "#picture a[href$='share.svg']",
    "#thresholds table",
    "#limits",
    "nav",
)
"""What is numbered, from 1, by its selector in the page."""
MARK = (
    "position:absolute;width:30px;height:30px;border-radius:15px;background:#b3006b;"
    "color:white;font:bold 18px/30px sans-serif;text-align:center;z-index:9"
)
SCRIPT = """
addEventListener('load', () => CALLOUTS.forEach((selector, number) => {
  const box = document.querySelector(selector).getBoundingClientRect();
  const mark = document.createElement('div');
  mark.textContent = number + 1;
  mark.style.cssText = 'MARK';
  mark.style.left = Math.max(2, box.left - 36) + 'px';
  mark.style.top = box.top + scrollY + 'px';
  document.body.append(mark);
}));
"""


def main(directory: Path) -> None:
    """Draw both pictures."""
    text = (directory / "report.html").read_text(encoding="utf-8")
    # the page lets no script but its own run
    text = re.sub(r'(?s)<meta http-equiv="Content-Security-Policy".*?>', "", text)
    _draw(text, UPPER_PART, UPPER_SIZE)
    script = SCRIPT.replace("CALLOUTS", json.dumps(CALLOUTS)).replace("MARK", MARK)
    _draw(f"{text}<script>{script}</script>", PICTURE, SIZE)


def _draw(text: str, picture: Path, size: tuple[int, int]) -> None:
    """Draw the upper part of a page."""
    with tempfile.TemporaryDirectory() as scratch:
        page = Path(scratch) / "page.html"
        shot = Path(scratch) / "shot.png"
        page.write_text(text, encoding="utf-8")
        wide, high = size
        command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu"]
        command += ["--disable-background-networking", "--hide-scrollbars"]
        command += [
            f"--user-data-dir={scratch}/profile",
            f"--window-size={wide},{high}",
        ]
        command += [f"--screenshot={shot}", page.as_uri()]
        subprocess.run(command, check=True, capture_output=True)
        image = Image.open(shot).convert("RGB")
        image.quantize(COLOURS).save(picture, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
