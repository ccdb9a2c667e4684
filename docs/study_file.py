"""The reference of study files, written from the registry.

``python docs/study_file.py > docs/study-file.md`` writes it.
"""

from collections.abc import Mapping
from typing import get_args

from annotated_types import Ge, Gt, Le, Lt
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from orchestrator.fidelity import limits
from orchestrator.study import fields, profile, question, scene, sieve
from orchestrator.study.fidelities import AUTO, WRITTEN
from orchestrator.study.fields import Quantity
from orchestrator.study.reading import TIME_LIMIT_S
from orchestrator.study.study import BED
from orchestrator.surface import study as surface_study

HEAD = f"""# Study files

A study file is TOML. Six tables are the question: `[fluid]`, `[grain]`, `[bed]`, `[flow]` (the flow
above the bed), `[forces]` and `[threshold]` (what counts as motion). The tables `[method]`,
`[method.flow]` and `[method.grains]` say how the question is answered; each may be left out.
`[axes]` lists values of fields; every combination of them is a scene:

```toml
title = "Two grains on three slopes"

[bed]
roughness = "d/30"

[axes]
"grain.diameter" = [7e-4, 1e-3]
"bed.slope_deg" = [0.0, 15.0, 20.0]
```

Each `[[group]]` is an experiment with a `name`. Its tables override those at the top of the file, and
its `axes` are added to those at the top. The [glossary](glossary.md) explains the words.

| key of the top | default | meaning |
|---|---|---|
| `title` | the file's name | a line for the page |
| `time_limit` | {TIME_LIMIT_S:g} | wall time after which a run of a solver counts as hung, s |
| `units_confirmed` | false | true: unusual numbers are meant as they stand. Nothing is asked about them, and a profile or surface that is longer than 10 km or higher than 500 m is accepted |
| `seeds` | none | number of beds that differ in their seed alone; a group may have its own |
| `tolerance` | none | accepted relative error of θ_c: [ladder.md](ladder.md) |
| `cluster` | none | settings of a queue: [cluster.md](cluster.md) |
| `group` | one group | the experiments |

In the tables below, the *scope* names the scenes on which a field has an effect; on other scenes its
column in the results is empty. The *column* of a field has the name of the field unless another is
given. The table `scenes` of the results has the question, the table `methods` has how each scene was
answered. The method `auto` and a tolerance may change the fields of the method
([ladder.md](ladder.md#how-a-scene-is-answered)); `methods` has the values that were used. A default
that is written in the file has the same effect as one that is left out, except in `[fluid]`: any density
or viscosity there means a fluid by its numbers, in which motion must be sustained, and without one the fluid is the
paper's gas (`kind = "paper"`). Ranges are intervals; a parenthesis excludes the end. Within the ranges, a study refuses what the [limits](#limits) name. A key
of an earlier version is refused, and the message names the present key.
"""
DAMPED = ", ".join(
    f"{step:g} up to a damping of {most:g}" for most, step in limits.TIMESTEPS
)
LOW, HIGH = limits.PILE_SLOPES_DEG
LIMITS = {
    "grain.sizes": (
        f"the largest grain is more than {sieve.LARGEST_RATIO:g} times the smallest: the time of "
        "DEM rises with the square",
        "merge the finest or the coarsest classes; a file of what passes or stays on sieves is cut to it",
    ),
    "bed.profile": (
        f"more than {limits.MOST_GRAINS:g} d of bed, of any shape, to pack with grains, or "
        f"{profile.MOST_CORNERS} points, a slope above {profile.STEEPEST_DEG:g}°, points nearer "
        f"than {scene.NARROWEST_OVER_D:g} d or {scene.NARROWEST_OVER_CELL:g} of the first cell",
        "the method `local`, or a range of `bed.counted`; smooth it",
    ),
    "bed.slope_deg": (
        f"a pile below {LOW:g}° or above {HIGH:g}°; a counted place steeper than {limits.ANGLES}, "
        f"from which grains roll without a flow; poured beds beyond the friction angle or {HIGH:g}°",
        "lower the slope, or count another part with `bed.counted`",
    ),
    "bed.entrainment_angle_deg": (
        f"a pile below {limits.CLOSE_PACKED_DEG:g}°: a row of grains then pushes the row below it apart",
        "60; single grains may have less",
    ),
    "bed.roughness": (
        f"above {question.ROUGHEST:.2g} d, or above the first cell's height",
        "d/30 is usual",
    ),
    "bed.height": ("less than five grains high", "raise it, or take a level bed"),
    "bed.width": (f"below {question.LEAST_WIDTH:g} of the largest grains", "raise it"),
    "flow.depth, method.flow.lid": (
        f"less than {question.LEAST_DEPTH:g} heights of the forms or obstacles",
        "raise it",
    ),
    "method.flow.viscosity": (
        "a solved flow whose first cell is not turbulent",
        "lower it",
    ),
    "method.flow.model": (
        f"`waves` over a bed that rises by more than {HIGH:g}°",
        "`solve`",
    ),
    "method.grains.stiffness": (
        f"above {scene.MOST_POURED_STIFFNESS:g} in DEM on a poured bed",
        "lower it",
    ),
    "method.grains.damping": (f"below {limits.LEAST_DAMPING:g} in DEM", "0.1"),
    "method.grains.time_step": (f"above {DAMPED}", "lower it"),
    "flow.gusts": ("DEM of single grains", "the method `auto` or `pivot`"),
    "grain.cohesion": ("by DEM", "the method `auto`, `peeling` or `pivot`"),
}
"""What is refused within the ranges of the fields, and the remedy."""
SIGNS = {
    Gt: ("gt", "({:g},"),
    Ge: ("ge", "[{:g},"),
    Lt: ("lt", "{:g})"),
    Le: ("le", "{:g}]"),
}
SHORT = "| field | symbol, unit, range | default | meaning |"
COLUMNS = f"{SHORT} scope | column |"
SURFACES = f"""## Beds in three dimensions

With `bed.kind = "surface"` the tables are those below, and `study` and `erosion` answer
([surface.md](surface.md)). At the top such a file may have `title`, `time_limit`,
`units_confirmed`, `[axes]` and `[[group]]`, of up to {surface_study.MOST_FLOWS} combinations. The law `paper`, two answers in the transition, is
refused.
"""


FIDELITIES = f"""## Fidelities

`method.fidelity` names a fidelity, a set of numbers for flow and grains: `fidelity = "paper"` is
the same as writing its numbers. A number that the file writes itself stands before that of the
fidelity. With `"{AUTO}"`, the default, the program chooses one by numerical errors
([ladder.md](ladder.md)). A single grain takes the numbers of the grains alone, and over a level bed
no flow is solved.

| fidelity | meaning | fields |
|---|---|---|
"""


def fidelities() -> str:
    """The section of the fidelities, in Markdown."""
    rows = []
    for name, written in WRITTEN.items():
        numbers = [
            f"`{key}` {value}"
            for key, value in {**written.flow, **written.grains}.items()
        ]
        cell = ", ".join(numbers)
        for packing, fields_on in written.on.items():
            others = ", ".join(f"`{key}` {value}" for key, value in fields_on.items())
            cell += f"; {packing}: {others}"
        rows.append(f"| `{name}` | {written.meaning} | {cell} |")
    return FIDELITIES + "\n".join(rows) + "\n"


def text() -> str:
    """The reference, in Markdown."""
    lines = [HEAD]
    for part, model in fields.PARTS.items():
        about = " ".join((model.__doc__ or "").split())
        if part == "bed":
            about = "One grain on two others, or a pile of grains."
        lines.append(f"## `[{part}]`\n\n{about}\n\n{COLUMNS}\n{'|---' * 6}|")
        rows = (
            _row(
                each,
                model.model_fields[each.name.rpartition(".")[2]],
                BED if part == "bed" else {},
            )
            for each in fields.FIELDS
            if fields.table_of(each.name) == part
        )
        lines += [*(f"| {' | '.join(row)} |" for row in rows), ""]
    lines.append(SURFACES)
    defaults = {"roughness": BED["roughness"]}
    for table, model in surface_study.TABLES.items():
        if table == "method":
            continue  # it holds no more than the table within it
        about = " ".join((model.__doc__ or "").split())
        lines.append(f"### `[{table}]`\n\n{about}\n\n{SHORT}\n{'|---' * 4}|")
        for name, field in model.model_fields.items():
            quantity = fields.quantity(table, name, field)
            cells = _row(quantity, field, defaults if table == "bed" else {})[
                : SHORT.count("|") - 1
            ]
            lines.append(f"| {' | '.join(cells)} |")
        lines.append("")
    lines.append(fidelities())
    lines.append("## Limits\n\n| field | refused | remedy |\n|---|---|---|")
    lines += [f"| `{name}` | {' | '.join(words)} |" for name, words in LIMITS.items()]
    return "\n".join(lines) + "\n"


def _row(
    quantity: Quantity, field: FieldInfo, defaults: Mapping[str, str]
) -> list[str]:
    name = quantity.name.rpartition(".")[2]
    info = quantity.info
    words = info.choices or {
        w: w for w in get_args(field.annotation) if isinstance(w, str)
    }
    listed = [
        f'`"{w}"`' + (f": {m}" if m.lower() != w.lower() else "")
        for w, m in words.items()
    ]
    value = defaults.get(name, field.default)
    default = f"`{list(value) if isinstance(value, tuple) else value!r}`".replace(
        "'", '"'
    )
    if value is PydanticUndefined:
        default = "required"
    elif value is None:
        default = ""
    scope = "" if info.scope == "every scene" else info.scope
    return [
        f"`{name}`",
        ", ".join(
            filter(None, (info.symbol, info.unit, " ".join(bounds(field))))
        ).replace("*", r"\*"),
        default,
        "<br>".join([quantity.meaning, *listed]).replace("*", r"\*"),
        scope,
        ""
        if quantity.column == name
        else f"`{quantity.column}`".replace("`-`", "none"),
    ]


def bounds(field: FieldInfo) -> list[str]:
    """The ends of a field's range; of an optional field or a list, those of each of its values."""
    rules = list(field.metadata)
    for inner in get_args(field.annotation):
        for rule in getattr(inner, "__metadata__", ()):
            rules += getattr(rule, "metadata", [rule])
    signs = [(SIGNS[type(rule)], rule) for rule in rules if type(rule) in SIGNS]
    return [sign.format(getattr(rule, name)) for (name, sign), rule in signs]


if __name__ == "__main__":
    print(text(), end="")
