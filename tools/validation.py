"""The tables of docs/validation.md and docs/how-sure.md: models beside measurements.

python tools/validation.py results/validate/tables

The tables of a run of `orchestrator validate` are copied to docs/measured, and written
into the pages, with the tested intervals that the program has. Without a folder the
pages are written from what is stored.
"""

import re
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path

import pandas as pd

from orchestrator.digits import percent
from orchestrator.lab import followed, validate
from orchestrator.lab.activity import activity_summary
from orchestrator.lab.validate import (
    DEFAULT,
    GROUPS,
    IVERSEN_WHITE,
    MODELS,
    median_factors,
)
from orchestrator.physics.beside import GRAINS, SUSTAINED
from orchestrator.physics.laws import DEFAULT as LAW

ROOT = Path(__file__).parents[1]
STORED = ROOT / "docs" / "measured"
TABLES = ("scores", "rows", "activity")
"""Tables of a run that are stored, each as ``validation-NAME.csv``."""
BASELINES = (DEFAULT, "formulas", "constants", "entrained, steady", "balanced, gusts")
"""Models of the tables of factors."""
PLAIN = {
    DEFAULT: "`threshold`'s default",
    "formulas": "formulas: Soulsby and Whitehouse, Shao and Lu",
    "constants": "constants: 0.05 in liquids, 0.0123 in gases",
    "entrained, steady": "one grain that is entrained by a steady flow",
    "balanced, gusts": "poured strips, balanced forces with gusts",
}
"""What the models of these tables are called."""


@cache
def stored(name: str) -> pd.DataFrame:
    """Read a table of the stored run."""
    return pd.read_csv(STORED / f"validation-{name}.csv")


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Write a table in Markdown."""
    first, *others = (f"| {' | '.join(line)} |\n" for line in (heads, *rows))
    return "".join([first, "|---" * (first.count("|") - 1) + "|\n", *others])


def written(value: float, digits: int = 2) -> str:
    """A number, or a dash where there is none."""
    return "–" if pd.isna(value) else f"{value:.{digits}f}"


def sets() -> str:
    """Median of model over measurement, by set and model."""
    scores = stored("scores")
    names = [model.name for model in MODELS]
    ratios = scores.pivot(index="set", columns="model", values="ratio")
    counts = scores.groupby("set")["rows"].first()
    rows = []
    for name in scores["set"].unique():
        cells = [written(ratios.loc[name, model]) for model in names]
        rows.append([f"{name} ({counts[name]})", *cells])
    medians = median_factors(scores)
    last = [f"**{written(medians[model])}**" for model in names]
    rows.append(["**factor, median of the sets of measured beds**", *last])
    return table(["set (rows)", *names], rows)


def factors() -> str:
    """Factor in the median of each set of beds, of the default and of what is without."""
    scores = stored("scores")
    wide = scores.pivot(index="set", columns="model", values="factor")
    counts = scores.groupby("set")["rows"].first()
    beds = [name for sets_ in GROUPS.values() for name in sets_]
    rows = []
    for name in dict.fromkeys([*beds, IVERSEN_WHITE]):
        cells = [written(wide.loc[name, model]) for model in BASELINES]
        rows.append([f"{name} ({counts[name]})", *cells])
    return table(["set (rows)", *(PLAIN[model] for model in BASELINES)], rows)


def by_row() -> str:
    """Factors over the rows themselves, of the default and of what is without it."""
    found = stored("rows")
    rows = []
    for (group, model), part in found.groupby(["group", "model"], sort=False):
        if model not in BASELINES:
            continue
        (row,) = part.to_dict("records")
        rows.append(
            [
                f"{group} ({row['answered']})",
                PLAIN[model],
                written(row["ratio"]),
                written(row["factor"]),
                written(row["factor_90"]),
                percent(row["within_1.5"]),
                percent(row["within_2"]),
            ]
        )
    heads = ("rows", "by", "model over measurement, median", "factor, median")
    return table([*heads, "factor, 90 %", "within 1.5", "within 2"], rows)


def short() -> str:
    """The sentences that the pages begin with."""
    found = stored("rows").set_index(["group", "model"])
    own, *others = BASELINES[:3]
    first, *groups = GROUPS
    row = found.loc[(first, own)]
    lines = [
        f"In short: {row['rows']:.0f} measured thresholds in flumes and at field sites "
        f"differ from the default of `threshold` by a factor of {row['factor']:.2f} in "
        f"the median, and 90 % of them by at most {row['factor_90']:.2f}; "
        f"{percent(row['within_1.5'])} are within a factor of 1.5. What one would take "
        "without it:\n",
        "\n",
    ]
    rows = []
    for group in (first, *groups):
        pairs = (found.loc[(group, model)] for model in (own, *others))
        cells = [f"{at['factor']:.2f}, {at['factor_90']:.2f}" for at in pairs]
        count = found.loc[(group, own), "answered"]
        rows.append([f"{group} ({count:.0f})", *cells])
    heads = ["factor in the median of the rows, and at 90 %"]
    heads += [PLAIN[model] for model in (own, *others)]
    return "".join(lines) + table(heads, rows)


def in_motion() -> str:
    """Mean stress at which sand moves half of the time, by site and thresholds."""
    rows = []
    for row in activity_summary(stored("activity")).to_dict("records"):
        rows.append(
            [
                row["site"],
                row["thresholds"],
                written(row["stops_pa"], 3),
                written(row["starts_pa"], 3),
                written(row["half_active_pa"], 3),
                written(row["half_active_measured_pa"], 3),
                f"{row['mean_difference']:+.2f}".replace("-", "−"),
                f"{row['bins']}",
            ]
        )
    heads = ("site", "thresholds", "stops, Pa", "starts, Pa", "half active, Pa")
    return table(
        [*heads, "measured, Pa", "mean difference of the activity", "bins"], rows
    )


def by_dem() -> str:
    """Both thresholds of the strips that DEM follows, beside the closed form."""
    rows = []
    for row in followed.compare(followed.stored()).to_dict("records"):
        numbers = (row[name] for name in ("entrained", "sustained", "cessation"))
        rows.append(
            [
                row["set"],
                row["threshold"],
                f"{row['stiffness']:g}",
                f"{row['strips']}",
                written(row["shields"], 4),
                f"{written(row['least'], 4)} to {written(row['largest'], 4)}",
                *(written(number, 4) for number in numbers),
                written(row["over_closed_form"]),
            ]
        )
    heads = ("set", "threshold", "K d/W", "strips", "θ, median", "θ of the strips")
    last = ("entrained", "sustained", "ceases", "over the closed form")
    return table([*heads, *last], rows)


def hiding() -> str:
    """Exponents of hiding by model and by the ends of the bracket."""
    found = validate.stored_hiding()
    rows = []
    for model, part in found.groupby("model", sort=False):
        cells = [
            f"{row['exponent']:+.2f} ± {row['sd']:.2f}".replace("-", "−")
            for row in part.to_dict("records")
        ]
        rows.append([str(model), *cells])
    return table(["forces", "m = 1", "m = 2"], rows)


def intervals() -> str:
    """The tested intervals of the default, with the coverage of sets left out."""
    found = pd.read_csv(GRAINS)
    found = found[
        (found["criterion"] == SUSTAINED)
        & (found["force_law"] == LAW)
        & (found["beta_deg_high"] == 60)
        & (found["d_over_z0_high"] == 33)
    ]
    rows = []
    for row in found.sort_values(["medium", "reynolds_low"]).to_dict("records"):
        rows.append(
            [
                row["medium"],
                f"{row['reynolds_low']:g} to {row['reynolds_high']:g}",
                f"{row['density_ratio_low']:g} to {row['density_ratio_high']:g}",
                f"{row['low']:.2f}, {row['high']:.2f}",
                f"{row['rows']} in {row['sets']}",
                f"{row['widened']:.2f}",
                percent(row["held"]),
            ]
        )
    heads = ("fluid", "Re\\*", "ρ_s/ρ_f", "low, high", "rows, sets", "widened by")
    return table([*heads, "sets left out: contained"], rows)


BLOCKS: Mapping[str, Mapping[str, Callable[[], str]]] = {
    "validation": {
        "short": short,
        "sets": sets,
        "factors": factors,
        "rows": by_row,
        "activity": in_motion,
        "by DEM": by_dem,
        "hiding": hiding,
        "intervals": intervals,
    },
    "how-sure": {"short": short, "factors": factors},
}
"""What stands in each page, by the name of its place."""


def begin(name: str) -> str:
    """The line before a block of a page."""
    return f"<!-- by tools/validation.py: {name} -->\n"


END = "<!-- end -->\n"
"""The line behind a block."""


def main(folder: Path | None) -> None:
    """Store the tables of a run, if there is one, and write the pages."""
    if folder is not None:
        for name in TABLES:
            text = (folder / f"{name}.csv").read_text(encoding="utf-8")
            (STORED / f"validation-{name}.csv").write_text(text, encoding="utf-8")
    for page, blocks in BLOCKS.items():
        path = ROOT / "docs" / f"{page}.md"
        text = path.read_text(encoding="utf-8")
        for name, make in blocks.items():
            pattern = re.escape(begin(name)) + ".*?" + re.escape(END)
            block = begin(name) + make() + END
            text = re.sub(pattern, lambda _, to=block: to, text, flags=re.DOTALL)
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
