"""Words and numbers of the page beside its figures."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import metadata
from platform import python_version

import numpy as np
import pandas as pd

from orchestrator import __version__
from orchestrator.fidelity import levels as fidelity
from orchestrator.physics.force_law import ForceLaw
from orchestrator.physics.laws import LAWS
from orchestrator.report import labels, laws
from orchestrator.report.apart import varying
from orchestrator.report.results import Results, by_dem, held, split, valid
from orchestrator.runs.case import IDENTITY
from orchestrator.runs.files import read_json
from orchestrator.study import fields

PACKAGES = (
    "gmsh",
    "jinja2",
    "matplotlib",
    "meshio",
    "numpy",
    "pandas",
    "pydantic",
    "pyvista",
    "vtk",
)
SHOWN = ("alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "force_law")
"""Columns that each row of the table of piles tells."""
MANY = 12
"""Values of a parameter beyond which only their range is listed."""


@dataclass(frozen=True)
class Sheet:
    """A table of the page: its columns' heads, and its rows."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def piles(results: Results) -> Sheet | None:
    """The thresholds of the piles, a row for each, with the name of its case last."""
    found = results.joined("pile_threshold")
    if found.empty:
        return None
    extra = varying(found, *SHOWN, "fraction")
    fractions = sorted(set(found["fraction"]))
    heads = (f"τ_c at n/N = {fraction:.0%}" for fraction in fractions)
    choices = ("other choices",) if extra else ()
    head = ("pile: α, d, z₀", "forces, ν in m²/s", *choices, "N", *heads, "case")
    rows = []
    for _, own in split(found, "alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "scene_id"):
        first = own.iloc[0]
        cells = {row["fraction"]: _threshold(row) for _, row in own.iterrows()}
        reached = (cells.get(fraction, "—") for fraction in fractions)
        rows.append((*_pile(first, extra), str(first["count"]), *reached, _case(first["case"])))
    return Sheet(head, tuple(rows))


def _pile(row: pd.Series, extra: list[str]) -> tuple[str, ...]:
    forces = labels.value("force_law", row["force_law"])
    cells = (
        f"{labels.amount(row['alpha_deg'], '°')}, {labels.millimetres(row['d_m'])},\n"
        f"{labels.ratio_of(row['z0_over_d'], 'd')}",
        f"{forces}, {row['nu_m2_s']:g}",
    )
    return (*cells, "\n".join(labels.told(row, extra))) if extra else cells


def _threshold(row: pd.Series) -> str:
    if pd.isna(row["shields"]):
        return str(row["why_not"])
    low, high = sorted((row["shields_low"], row["shields_high"]))
    return f"{row['shields']:.4f}\n({low:.4f} … {high:.4f})\nu*₀ {row['ustar0_m_s']:.3f} m/s"


def _case(name: object) -> str:
    """The case's name; nothing for an answer without a run of its own."""
    return name if isinstance(name, str) else ""


def single_grains(results: Results) -> Sheet | None:
    """How far DEM is from the closed form, by force law, whether it holds, and protocol."""
    found = by_dem(results.joined("single_grain"))
    if found.empty:
        return None
    ratio = found["ustar_m_s"] / found["ustar_closed_form_m_s"]
    width = (found["ustar_high_m_s"] - found["ustar_low_m_s"]) / found["ustar_closed_form_m_s"] / 2
    table = found.assign(holds=valid(found), held=held(found), ratio=ratio, width=width)
    rows = []
    for (law_name, holds, waits), own in split(table, "force_law", "holds", "held"):
        equation = labels.value("force_law", law_name)
        far = (own["ratio"] - 1).abs()
        rows.append(
            (
                equation,
                "yes" if holds else "no",
                "holds" if waits else "ramps",
                str(len(own)),
                str(int(own["ratio"].isna().sum())),
                f"{own['ratio'].mean() - 1:+.3%}",
                f"{far.max():.3%}",
                f"±{own['width'].median():.3%}",
            )
        )
    head = (
        "forces",
        "law holds",
        "protocol",
        "grains",
        "never moved",
        "mean of u*/u*(closed form) − 1",
        "largest |u*/u*(closed form) − 1|",
        "median half width of the interval",
    )
    return Sheet(head, tuple(sorted(rows, key=lambda row: row[:3], reverse=True)))


def force_laws(results: Results) -> Sheet:
    """The force laws of the scenes: where each holds, and where it was taken from."""
    used = [LAWS[name] for name in LAWS if (results.scenes["force_law"] == name).any()]
    rows = tuple((one.label, _range(one), one.reference) for one in used)
    return Sheet(("force law", "holds for", "source"), rows)


def _range(law: ForceLaw) -> str:
    low, high = law.reynolds
    parts = [f"Re* ≥ {low:g}"] if low > 0 else []
    parts += [f"Re* < {high:g}"] if np.isfinite(high) else []
    if np.isfinite(law.drag_end):
        parts.append(f"V d/ν < {law.drag_end:g} (drag: {law.drag_law})")
    return ", ".join(parts) or "every Re*"


def parameters(results: Results) -> Sheet:
    """The values that each parameter of the scenes takes."""
    rows = []
    for column, one in fields.COLUMNS.items():
        asked = _values(results.scenes[column])
        run = fields.ANSWERED + column
        answered = _values(results.scenes[run]) if run in fields.ANSWERS else asked
        if asked or answered:
            words = ", ".join(t for t in (one.info.label, labels.text_of(one.info.symbol)) if t)
            other = "" if answered == asked else answered
            rows.append((words, one.info.unit, one.name or column, asked or "default", other))
    head = ("parameter", "unit", "in a study file", "asked for", "answered with, if otherwise")
    return Sheet(head, tuple(rows))


def _values(column: pd.Series) -> str:
    values = list(column.dropna().unique())
    if all(isinstance(value, str) for value in values):
        return ", ".join(sorted(map(str, values)))
    numbers = list(dict.fromkeys(f"{number:.6g}" for number in sorted(map(float, values))))
    if len(numbers) > MANY:
        return f"{len(numbers)} from {numbers[0]} to {numbers[-1]}"
    return ", ".join(numbers)


def programs(results: Results) -> Sheet:
    """The solvers by what the cases say of them, and the libraries."""
    used: dict[str, set[str]] = {}
    for name in results.plan.cases:
        identity = read_json(results.cases / name / IDENTITY)
        found = identity.get("programs", {}) if isinstance(identity, dict) else {}
        for program, version in found.items():
            used.setdefault(str(program), set()).add(str(version))
    return versions({program: ", ".join(sorted(found)) for program, found in used.items()})


def versions(solvers: Mapping[str, str]) -> Sheet:
    """Solvers with their versions, this package, and the libraries that are not among them."""
    rows = [*sorted(solvers.items()), ("orchestrator", __version__), ("Python", python_version())]
    others = (name for name in PACKAGES if name not in solvers)
    return Sheet(("program", "version"), (*rows, *_installed(others)))


def _installed(packages: Iterable[str]) -> Iterable[tuple[str, str]]:
    for package in packages:
        try:
            yield package, metadata.version(package)
        except metadata.PackageNotFoundError:
            yield package, "not installed"


def times(timings: pd.DataFrame) -> Sheet | None:
    """Wall time of the finished cases by their kind: in the solver, and outside it."""
    if timings.empty:
        return None
    rows = []
    for (kind,), own in split(timings, "kind"):
        rows.append(_spent(str(kind), own))
    head = ("kind of case", "cases", "in the solver, s", "outside it, s", "longest case, s")
    return Sheet(head, (*rows, _spent("all", timings)))


def _spent(name: str, rows: pd.DataFrame) -> tuple[str, ...]:
    wall = rows["solver_s"] + rows["outside_s"]
    seconds = (rows["solver_s"].sum(), rows["outside_s"].sum(), wall.max())
    return (name, str(len(rows)), *(f"{value:.1f}" for value in seconds))


def remarks(results: Results, failures: Mapping[str, str]) -> list[str]:
    """Remarks that a reader must know before using this study's results."""
    found = []
    if failures:
        found.append(f"Cases that failed: {len(failures)}. The figures lack them; see below.")
    outside = ~valid(results.scenes)
    if outside.any():
        found.append(
            f"Scenes whose force law does not hold at their single-grain threshold: "
            f"{int(outside.sum())} of {len(outside)}; their markers are hollow. "
            f"{_of_transition(results.scenes[outside])}"
        )
    thresholds = results.joined("pile_threshold")
    if len(thresholds) and thresholds["shields"].isna().any():
        missing = int(thresholds["shields"].isna().sum())
        found.append(f"Thresholds of piles that were not reached: {missing} of {len(thresholds)}.")
    return [*found, *_upstream(results.joined("pile_curve")), *_stray_grains(results)]


def _of_transition(scenes: pd.DataFrame) -> str:
    """A sentence on the paper's rule between its two laws."""
    both = scenes["force_law"].isin(laws.PAIR) & (scenes["regime"] == "transition")
    said = f"{int(both.sum())} of them by Eq. 2 or Eq. 4 where neither holds. "
    return said if both.any() else ""


def _upstream(curve: pd.DataFrame) -> Iterator[str]:
    """Motions of grains of piles other than downstream over the bed."""
    if curve.empty:
        return
    most = curve.groupby("scene_id")[["carried_off", "fallen_upstream"]].max()
    piles, grains = (most > 0).sum(), most.max()
    if piles["carried_off"]:
        yield (
            f"Piles in which lift carried grains off before they moved downstream: "
            f"{piles['carried_off']}, at most {grains['carried_off']} in one. They count as "
            "moved; there the threshold is that of lift-off (share_carried_off)."
        )
    if piles["fallen_upstream"]:
        yield (
            f"Piles in which grains fell upstream: {piles['fallen_upstream']}, at most "
            f"{grains['fallen_upstream']} in one. Such a grain has moved only if it also "
            "passed the marker or was carried off."
        )


def _stray_grains(results: Results) -> list[str]:
    grains = by_dem(results.joined("single_grain"))
    if grains.empty:
        return []
    ratio = grains["ustar_m_s"] / grains["ustar_closed_form_m_s"]
    far = ((ratio - 1).abs() > 0.01) & held(grains)
    silent = grains["ustar_m_s"].isna()
    found = []
    if far.any():
        found.append(
            f"Single grains held more than 1 % from the closed form: {int(far.sum())}, of which "
            f"{int((far & valid(grains)).sum())} where their law holds."
        )
    if silent.any():
        found.append(f"Single grains that did not move in any load step: {int(silent.sum())}.")
    return found


def levels(results: Results) -> Sheet | None:
    """On which fidelity levels the piles were answered, why, and what is known of them."""
    table = results.joined("pile_threshold")
    if table.empty:
        return None
    rows = []
    for (flow, grains, why), own in split(table, "flow_level", "grain_level", "why"):
        known = own["error_estimate"].max()
        rows.append(
            (
                f"{flow} | {grains}",
                fidelity.meaning([str(flow), str(grains)]),
                str(why),
                str(own["scene_id"].nunique()),
                "not known" if pd.isna(known) else f"{100 * known:.1f} %",
            )
        )
    head = ("flow | grains", "description", "reason", "piles", "known error of τ_c, up to")
    return Sheet(head, tuple(rows))


def checks(results: Results) -> Sheet | None:
    """The piles that DEM answered as well: how far the cheap answers are from it."""
    table = results.tables.get("check", pd.DataFrame())
    if table.empty:
        return None
    rows = [
        (
            f"{labels.amount(one['alpha_deg'], '°')}, {one['packing']}, "
            f"{labels.value('force_law', one['force_law'])}",
            f"{1e3 * one['d_m']:g} mm",
            f"{one['fraction']:.0%}",
            f"{one['shields']:.4g}",
            f"{one['shields_dem']:.4g} "
            f"({one['shields_dem_low']:.4g} … {one['shields_dem_high']:.4g})",
            f"{100 * one['difference']:+.1f} %",
            "yes" if one["agree"] else "no",
            str(one["case"]),
        )
        for one in table.to_dict("records")
    ]
    head = ("piles", "d", "n/N", "τ_c", "by DEM", "difference", "agree", "case")
    return Sheet(head, tuple(rows))
