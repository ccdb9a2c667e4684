"""The tables and numbers of docs/validation.md, how-sure.md and model.md: models beside measurements.

python tools/validation.py results/validate/tables

The tables of a run of `orchestrator validate` are copied to docs/measured, and written
into the pages, with the tested intervals that the program has. Without a folder the
pages are written from what is stored.
"""

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator.digits import percent
from orchestrator.lab import followed, validate
from orchestrator.lab.activity import activity_summary
from orchestrator.lab.validate import (
    DEFAULT,
    FOLDER,
    GRAVEL,
    GROUPS,
    GUST,
    IVERSEN_WHITE,
    MODELS,
    RIVERS,
    SITES,
    STEEP,
    measured_grains,
    median_factors,
    single,
)
from orchestrator.physics import rolling
from orchestrator.physics.beside import GRAINS, SUSTAINED
from orchestrator.physics.constants import GAS_BELOW, SAND_GRAIN
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import DEFAULT as LAW
from orchestrator.physics.measured import MEASURED_BEDS
from orchestrator.physics.onset import Criteria, of_grains
from orchestrator.types import FloatArray

sys.path.insert(0, str(Path(__file__).parent))
import curves  # a tool beside this one

ROOT = Path(__file__).parents[1]
STORED = ROOT / "docs" / "measured"
TABLES = ("scores", "rows", "parts", "activity")
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
    for row in followed.compare_strips(followed.stored_strips()).to_dict("records"):
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


def probes() -> str:
    """Spheres over fixed beds: how many move on by the solver and by LIGGGHTS."""
    rows = []
    for row in pd.read_csv(STORED / "probes.csv").to_dict("records"):
        shares = [
            f"{percent(row[f'{what}_{by}'] / row['spheres'])}"
            for what in ("started", "sustained")
            for by in ("solver", "liggghts")
        ]
        rows.append(
            [
                f"{row['galileo']:g}",
                f"{row['density_ratio']:g}",
                f"{row['slope_deg']:g}°",
                written(row["shields"], 4),
                *shares,
                percent(row["same"] / row["spheres"]),
            ]
        )
    heads = ("Ga", "s", "slope", "θ", "30 d in the gust, solver", "LIGGGHTS")
    return table([*heads, "20 d more, solver", "LIGGGHTS", "the same spheres"], rows)


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
                f"{row['reynolds_low']:.3g} to {row['reynolds_high']:.4g}",
                f"{row['density_ratio_low']:g} to {row['density_ratio_high']:g}",
                f"{row['low']:.2f}, {row['high']:.2f}",
                f"{row['rows']} in {row['sets']}",
                f"{row['widened']:.2f}",
                percent(row["held"]),
            ]
        )
    heads = ("fluid", "Re\\*", "ρ_s/ρ_f", "low, high", "rows, sets", "widened by")
    return table([*heads, "sets left out: contained"], rows)


def part_of(by: str, model: str = DEFAULT) -> pd.DataFrame:
    """The stored parts by a number, of a model."""
    found = stored("parts")
    return found[(found["by"] == by) & (found["model"] == model)]


def said(value: float) -> str:
    """A number with as many digits as it needs."""
    return f"{value:.3g}"


def span(row: Mapping[str, float]) -> str:
    """The range of a part."""
    low, high = row["low"], row["high"]
    if not np.isfinite(high):
        return f"above {low:g}"
    return f"{low:g} to {high:g}" if low > 0 else f"up to {high:g}"


def galileo() -> str:
    """The default beside the rows by eye, by the Galileo number."""
    rows = part_of("Galileo number").to_dict("records")
    heads = ["visual rows, Galileo number", *(span(row) for row in rows)]
    lines = [
        ["rows", *(str(row["rows"]) for row in rows)],
        ["model over measurement", *(written(row["ratio"]) for row in rows)],
        ["factor", *(written(row["factor"]) for row in rows)],
    ]
    return table(heads, lines)


def balanced() -> str:
    """How near balanced forces with gusts are to flumes, and in air."""
    below, here, _ = part_of("Re*", "balanced, gusts").to_dict("records")
    scores = stored("scores").set_index(["set", "model"])
    sites = scores.loc[(SITES, "balanced, gusts")]
    own = scores.loc[(SITES, DEFAULT)]
    return (
        f"- **In water, balanced forces with gusts differ from the visual flumes by a "
        f"factor of {written(here['factor'])} in the median** ({here['rows']} rows "
        f"from Re\\* {here['low']:g} to {here['high']:g}; {percent(here['within_2'])} "
        f"of them are within 2, the worst differs by {written(here['worst'], 1)}). Below "
        f"Re\\* {below['high']:g} they have {written(below['ratio'])} of the measured "
        "stress.\n"
        f"- **In air balanced forces with gusts have {written(sites['ratio'], 1)} times the "
        f"measured stress**, and the default {written(own['ratio'])} of it, in the median "
        "of the three sites.\n"
    )


def steep() -> str:
    """The default on steep flumes, by slope."""
    low, high = part_of("slope").to_dict("records")
    scores = stored("scores").set_index(["set", "model"])
    at_slope = steep_rows()
    grains = measured_grains(at_slope).changed(fall=0.0)
    deep = rolling.sustained(grains).initiation(GUST) / at_slope["measured"]
    large = scores.loc[("steep flumes, large elements", DEFAULT)]
    return (
        f"In a deep flow the model has {written(float(deep.median()))} of the measured "
        "stress of these flumes, since the grain's weight pulls it down the slope. In the "
        "shallow flow that runs there ([model.md](model.md#rolling-and-hopping-as-one-"
        f"motion)) it differs by a factor of {written(low['factor'])} on the "
        f"{low['rows']} slopes up to {low['high']:g}, where it has "
        f"{written(low['ratio'])} of the measured stress, and by {written(high['factor'])} "
        f"on the {high['rows']} steeper ones, where it has {written(high['ratio'])}. In "
        f"flumes with large elements the factor is {written(large['factor'])}.\n"
    )


def steep_rows() -> pd.DataFrame:
    """The measured rows of the steep flumes."""
    beds = pd.read_csv(MEASURED_BEDS).rename(columns={"shields": "measured"})
    return beds[beds["set"] == STEEP[0]]


RATIOS = (2.65, 10.0, 40.0, 150.0, 600.0, 2208.0, 1e4, 1e5)
OF_RATIOS = 40.0
"""Ratios of densities at which the model is told, at that Galileo number."""


def density() -> str:
    """The model over the ratio of densities."""
    grains = Grain.of_numbers(np.full(len(RATIOS), OF_RATIOS), RATIOS)
    criteria = Criteria(np.zeros(len(RATIOS)), grains)
    names = ["2.65", "10", "40", "150", "600", "2208", "10⁴", "10⁵"]
    sustained = criteria.sustained
    lines = [
        ["θ, sustained", *map(said, sustained)],
        ["u\\*/√((s−1)gd)", *(written(at) for at in np.sqrt(sustained))],
        ["θ at which motion ceases", *map(said, criteria.cessation)],
    ]
    return table(["s", *names], lines)


def ceases() -> str:
    """How far the model's impact thresholds are off."""
    ends = pd.read_csv(FOLDER / "cessation.csv")
    own = Criteria(np.zeros(len(ends)), measured_grains(ends), GUST).cessation
    ratio = own / ends["shields"]
    scores = stored("scores").set_index(["set", "model"])
    tunnel = scores.loc[("wind tunnel, cessation", DEFAULT)]
    is_site = (ends["set"] == "wind, cessation in the field").to_numpy()
    sites = ", ".join(map(written, ratio[is_site]))
    measured = ", ".join(f"{at:.4f}" for at in ends["shields"][is_site])
    return (
        f"At the three sites in the field the model's motion ceases at {sites} of the "
        f"measured θ ({measured}). In wind tunnels the factor is "
        f"{written(tunnel['factor'])} in the median of {tunnel['rows']:.0f} rows; the worst "
        f"row is off by {written(tunnel['worst'], 1)}.\n"
    )


def own_interval() -> str:
    """How many measured rows the model's own interval contains."""
    beds = pd.read_csv(MEASURED_BEDS)
    beds = beds[beds["set"] != RIVERS]
    grains = measured_grains(beds)
    criteria = Criteria(single(beds, GRAVEL).shields, grains, GUST)
    inside = (criteria.at_least <= beds["shields"]) & (
        beds["shields"] <= criteria.at_most
    )
    in_air = beds["rho_f_kg_m3"] < GAS_BELOW
    return (
        "**The model's own interval**, from a quarter of the grains over half of the way "
        f"to three quarters over twice the way, contains {percent(inside.mean())} of the "
        f"rows of flumes, field sites and the formula, and {inside[in_air].sum()} of the "
        f"{in_air.sum()} in air, where the pocket decides, which has no such ends. It says "
        "what the words of the criterion are worth, and is never the interval of an "
        "answer. How far the model is off say the tested intervals.\n"
    )


def asked() -> str:
    """What was asked before the present table was made, and what came of it."""
    scores = stored("scores")
    own = scores[scores["model"] == DEFAULT].set_index("set")["factor"]
    six = own[[*GROUPS["flumes and field sites"]]]
    every = own[[*six.index, IVERSEN_WHITE, RIVERS]]
    rows = stored("rows").set_index(["group", "model"])
    row = rows.loc[("flumes and field sites", DEFAULT)]
    low, high = part_of("slope").to_dict("records")
    return (
        f"It has {written(six.median())} in the six sets ({written(every.median())} with "
        "the formula and the rivers, which were added after the choices), "
        f"{written(row['factor'])} in the {row['answered']:.0f} rows, "
        f"{100 * row['within_2']:.1f} % of them within 2, {written(low['factor'])} on "
        f"slopes up to {low['high']:g} and {written(high['factor'])} above. On slopes it "
        f"has {angles()}.\n"
    )


GRAINS_ON_SLOPES = (
    ("water", 3e-4),
    ("water", 1e-3),
    ("water", 5e-3),
    ("air", 2.5e-4),
    ("air", 5e-4),
)
SLOPES = (-20.0, -10.0, 10.0, 20.0, 28.0)
"""Grains and slopes of which the change of the threshold is told, m and degrees."""


def on_slopes() -> Iterator[tuple[str, float, FloatArray, FloatArray, FloatArray]]:
    """Thresholds on the slopes over those of level beds: all, and of sustained motion alone.

    Each with the fluid, the diameter, and the friction angles of the first.
    """
    at = np.array([0.0, *SLOPES])
    for fluid, diameter in GRAINS_ON_SLOPES:
        grains = curves.sized(fluid, np.full(len(at), diameter))
        found = of_grains(grains.changed(slope_deg=at), GRAVEL, SUSTAINED).criteria
        assert found is not None
        over = found.shields[1:] / found.shields[0]
        alone = found.sustained[1:] / found.sustained[0]
        yield fluid, diameter, over, alone, friction_angles(over)


def friction_angles(over: FloatArray) -> FloatArray:
    """Friction angles of the slope law that has such a change of the threshold, deg."""
    slope = np.radians(SLOPES)
    return np.asarray(np.degrees(np.arctan(np.sin(slope) / (over - np.cos(slope)))))


def slopes() -> str:
    """The threshold over the slope, and its friction angles."""
    rows = []
    for fluid, diameter, over, alone, phi in on_slopes():
        of_alone = friction_angles(alone)
        rows.append(
            [
                f"{fluid} {1e3 * diameter:g} mm",
                *map(written, over),
                f"{phi.min():.0f} to {phi.max():.0f}°",
                f"{of_alone.min():.0f} to {of_alone.max():.0f}°",
            ]
        )
    heads = [f"{at:g}".replace("-", "−") for at in SLOPES]
    return table(["", *heads, "φ", "φ of sustained motion alone"], rows)


def angles() -> str:
    """The friction angles in air and in water, in words."""
    told = []
    for fluid in ("water", "air"):
        every = np.concatenate([phi for name, *_, phi in on_slopes() if name == fluid])
        told.append(f"{every.min():.0f} to {every.max():.0f}° in {fluid}")
    return f"friction angles of {' and of '.join(told)}"


def steps() -> str:
    """The largest steps of the threshold, from size to size and over density and slope."""
    sizes = np.exp(np.arange(np.log(5e-5), np.log(2e-2), 0.01))
    largest = []
    for fluid in curves.FLUIDS:
        grains = curves.sized(fluid, sizes)
        found = np.log(of_grains(grains, GRAVEL, SUSTAINED).shields)
        step = np.expm1(np.abs(np.diff(found)).max())
        place = "on" if fluid in curves.DENSITY or fluid == "Mars" else "in"
        largest.append(f"{100 * step:.1f} % {place} {fluid}")
    ratios = np.exp(np.arange(np.log(1.2), np.log(2200), 0.01))
    of_density = 0.0
    for number in (1.0, 10.0, 100.0, 1e3, 1e4):
        grains = Grain.of_numbers(np.full(len(ratios), number), ratios)
        at = rolling.sustained(grains).initiation(GUST)
        of_density = max(of_density, np.expm1(np.abs(np.diff(np.log(at))).max()))
    *others, last = largest
    return (
        "**No step.** Between grains 1 % apart in size, from 0.05 to 20 mm, the threshold "
        f"changes by at most {', '.join(others)} and {last}, and between density ratios "
        f"1 % apart by at most {100 * of_density:.1f} % (1.2 to 2200, five Galileo numbers "
        "from 1 to 10⁴).\n"
    )


def usable() -> str:
    """How many answers are usable by default, and what is against the others."""
    found = pd.read_csv(STORED / "usable.csv")
    rows = []
    for (bed, fluid), part in found.groupby(["bed", "fluid"]):
        others = part[~part["usable"]]
        told = []
        for why, of_why in others.groupby("reason", sort=False):
            sizes = "all" if len(of_why) == len(part) else _sizes(of_why["d_m"])
            told.append(f"{sizes}: {str(why).replace('; ', ' and ')}")
        count = f"{part['usable'].sum()} of {len(part)}"
        rows.append([str(bed), str(fluid), count, "; ".join(told) or "–"])
    total = f"{found['usable'].sum()} of {len(found)}"
    rows.append(["**all**", "", f"**{total}**", ""])
    return table(["bed", "fluid", "usable", "others, and what is against them"], rows)


def _sizes(diameters: "pd.Series[float]") -> str:
    """Some diameters in millimetres."""
    return f"{', '.join(f'{1e3 * d:g}' for d in diameters)} mm"


OF_HIDING = (("air", 2.5e-4), ("water", 1e-3), ("water", 5e-3))
"""Grains of the beds on which hiding is told, m."""


def sizes() -> str:
    """The exponent of hiding of grains in sustained motion over beds of another size."""
    over = np.geomspace(0.5, 2.0, 9)
    told = []
    for fluid, bed in OF_HIDING:
        grains = curves.sized(fluid, bed * over)
        grains = grains.changed(relative_size=over, roughness=bed / SAND_GRAIN)
        at = rolling.sustained(grains).initiation(GUST)
        exponent = np.polyfit(np.log(over), np.log(at), 1)[0]
        told.append(
            f"{exponent:.2f}".replace("-", "−") + f" at {1e3 * bed:g} mm in {fluid}"
        )
    return (
        "With z₀ d₅₀/30, from 0.5 to 2 d₅₀, θᵢ ~ (Dᵢ/d₅₀)ᵖ has p = "
        f"{', '.join(told[:-1])} and {told[-1]}.\n"
    )


def in_words() -> str:
    """How far single answers may be off."""
    below, *_ = part_of("Re*").to_dict("records")
    scores = stored("scores")
    beds = [name for sets_ in GROUPS.values() for name in sets_]
    own = scores[(scores["model"] == DEFAULT) & scores["set"].isin(beds)]
    worst = own.loc[own["worst"].idxmax()]
    return (
        "Single answers may be farther off than the median. In water below Re\\* = "
        f"{below['high']:g} the default has {written(below['ratio'])} times the measured "
        f"stress of {below['rows']} rows in the median; the worst single row, of the set "
        f"“{worst['set']}”, is off by a factor of {written(worst['worst'], 1)}.\n"
    )


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
        "balanced": balanced,
        "galileo": galileo,
        "steep": steep,
        "density": density,
        "ceases": ceases,
        "asked": asked,
        "own interval": own_interval,
        "usable": usable,
        "sizes": sizes,
    },
    "how-sure": {"short": short, "factors": factors, "single": in_words},
    "model": {"probes": probes, "slopes": slopes, "steps": steps},
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
