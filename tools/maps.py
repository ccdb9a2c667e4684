"""The counts of docs/stability.md: what a study says of answers that are wrong.

python tools/maps.py

They are made from the stored verdicts, orchestrator/fidelity/calibration/maps.csv, and
from the checks of the present program. No case is run.
"""

from pathlib import Path

import pandas as pd

from orchestrator.fidelity import measured
from orchestrator.lab import map_file, told

PAGE = Path(__file__).parents[1] / "docs" / "stability.md"
BEGIN, END = "<!-- by tools/maps.py -->\n", "<!-- end -->\n"
"""Lines of the page between which its counts stand."""


def table() -> str:
    """Write the counts: all verdicts, and by map what a study says of what is wrong.

    Returns
    -------
    str
        A sentence, a table, and for each map without a check why it has none.
    """
    paths = sorted(map_file.FOLDER.glob("*.toml"))
    maps = [map_file.read_map(path) for path in paths]
    stored = pd.read_csv(measured.FOLDER / "maps.csv")
    verdicts = stored["verdict"].value_counts()
    noticed = int(stored["caught"].sum())
    counts = told.counted(maps, stored)
    lines = [
        f"{verdicts['good']} cells are good, {verdicts['wrong']} are wrong, and {noticed} "
        "were noticed by the checks that every run makes",
        "([protocol.md](protocol.md#runs-that-fail), [flow.md](flow.md#checks-of-a-run)). "
        "Of those that are wrong, a study says:",
        "",
        f"| map | wrong | {' | '.join(told.HOW)} | fields |",
        "|---|---|" + "---|" * len(told.HOW) + "---|",
    ]
    for row in counts.to_dict("records"):
        numbers = " | ".join(str(row[how] or "") for how in told.HOW)
        names = row["fields"].split(", ") if row["fields"] else []
        fields = ", ".join(f"`{name}`" for name in names)
        lines.append(f"| {row['map']} | {row['wrong']} | {numbers} | {fields} |")
    numbers = " | ".join(str(counts[how].sum()) for how in told.HOW)
    lines.append(f"| all | {counts['wrong'].sum()} | {numbers} | |")
    for one in maps:
        if "no_check" in one.data:
            lines += ["", f"{one.data['title']}: {one.data['no_check']}"]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the counts into the page."""
    page = PAGE.read_text(encoding="utf-8")
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    PAGE.write_text(f"{before}{BEGIN}{table()}{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
