"""The picture of docs/result-page.md: the page of a study with numbered callouts.

python tools/annotated.py DIRECTORY

DIRECTORY holds the preset `first-look`, which was run. Chromium draws the picture.
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
COLOURS = 96
CALLOUTS = (
    "h1",
    ".number:nth-of-type(3) strong",
    ".number:nth-of-type(3) .measured",
    ".number:nth-of-type(3) p:last-child",
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
  const left = selector.includes('measured') ? box.right + 6 : box.left - 36;
  mark.style.left = Math.max(2, left) + 'px';
  mark.style.top = box.top + scrollY + 'px';
  document.body.append(mark);
}));
"""


def main(directory: Path) -> None:
    """Draw the picture."""
    text = (directory / "report.html").read_text(encoding="utf-8")
    # the page lets no script but its own run
    text = re.sub(r'(?s)<meta http-equiv="Content-Security-Policy".*?>', "", text)
    script = SCRIPT.replace("CALLOUTS", json.dumps(CALLOUTS)).replace("MARK", MARK)
    with tempfile.TemporaryDirectory() as scratch:
        page = Path(scratch) / "page.html"
        shot = Path(scratch) / "shot.png"
        page.write_text(f"{text}<script>{script}</script>", encoding="utf-8")
        wide, high = SIZE
        command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu"]
        command += ["--disable-background-networking", "--hide-scrollbars"]
        command += [
            f"--user-data-dir={scratch}/profile",
            f"--window-size={wide},{high}",
        ]
        command += [f"--screenshot={shot}", page.as_uri()]
        subprocess.run(command, check=True, capture_output=True)
        image = Image.open(shot).convert("RGB")
        image.quantize(COLOURS).save(PICTURE, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
