"""The reference of study files, written from the registry.

``python -m orchestrator.study.reference > docs/study-file.md`` writes it.
"""

from collections.abc import Iterator
from typing import Any, get_args

from annotated_types import Ge, Gt, Le, Lt
from pydantic.fields import FieldInfo

from orchestrator.study import fields
from orchestrator.study.fields import Quantity
from orchestrator.study.study import BED, TIME_LIMIT_S

HEAD = f"""# Study files

A study file is TOML. It has a table for each part of a scene: `[fluid]`, `[grain]`, `[bed]`,
`[flow]` and `[protocol]`. `[axes]` lists values of fields; every combination of them is a scene:

```toml
title = "Two grains on three slopes"

[bed]
roughness = "d/30"

[axes]
"grain.diameter" = [7e-4, 1e-3]
"bed.slope_deg" = [0.0, 15.0, 20.0]
```

Each `[[group]]` is an experiment of its own, with a `name`: its tables override those of the top,
and its `axes` add to them. A wrong key, type or range is refused in one line that names the file,
the field and the remedy. The [glossary](glossary.md) explains the words.

| key of the top | default | meaning |
|---|---|---|
| `title` | the file's name | a line for the page |
| `time_limit` | {TIME_LIMIT_S:g} | wall time after which a run of a solver counts as hung, s |
| `seeds` | none | number of beds that differ in their seed alone; also of a group |
| `tolerance` | none | relative error that τ_c may have: [ladder.md](ladder.md#the-default) |
| `cluster` | none | settings of a queue: [cluster.md](cluster.md) |
| `group` | one group | the experiments |

The *scope* of a field says for which scenes it has an effect; for all others its column in the
tables is empty. A field *about* the answer says how a scene is answered, not what is asked: with a
tolerance it may be changed. The column `answered_…` of the table of scenes has the value that was
run, also of what a study file leaves open.
"""
BEDS = "One grain on two others, or a pile of grains."
RANGES = ((Gt, "gt", "> {:g}"), (Ge, "ge", "≥ {:g}"), (Lt, "lt", "< {:g}"), (Le, "le", "≤ {:g}"))


def text() -> str:
    """The reference, in Markdown."""
    return "\n".join([HEAD, *(line for part in fields.PARTS for line in _part(part))])


def _part(part: str) -> Iterator[str]:
    about = BEDS if part == "bed" else (fields.PARTS[part].__doc__ or "").partition("\n")[0]
    yield f"## `[{part}]`\n\n{about}\n"
    yield "| field | symbol | unit | range | default | meaning | scope | about | column |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for one in fields.FIELDS:
        if one.name.startswith(f"{part}."):
            yield f"| {' | '.join(_row(one))} |".replace("*", r"\*")
    yield ""


def _row(one: Quantity) -> Iterator[str]:
    declared = fields.declared(one)
    info = one.info
    yield f"`{one.name.partition('.')[2]}`"
    yield info.symbol
    yield info.unit
    yield _range(declared)
    yield _default(one.name, declared)
    yield "<br>".join([one.meaning, *_words(one)])
    yield "" if info.scope == "every scene" else info.scope
    yield "" if info.about == "question" else info.about
    yield f"`{one.column}`" if one.column in fields.COLUMNS else ""


def _words(one: Quantity) -> Iterator[str]:
    """The words that a field may be, with what they stand for."""
    listed = one.info.choices or get_args(fields.declared(one).annotation)
    for word in (word for word in listed if isinstance(word, str)):
        said = one.info.choices.get(word, word)
        yield f'`"{word}"`' + (f": {said}" if said.lower() != word else "")


def _range(declared: FieldInfo) -> str:
    bounds = [
        written.format(getattr(rule, name))
        for rule in _rules(declared)
        for kind, name, written in RANGES
        if isinstance(rule, kind)
    ]
    return ", ".join(bounds)


def _rules(declared: FieldInfo) -> Iterator[Any]:
    """Conditions on the values; for an optional field or a list, those on each of them."""
    yield from declared.metadata
    for inner in get_args(declared.annotation):
        for found in getattr(inner, "__metadata__", ()):
            yield from getattr(found, "metadata", [found])


def _default(name: str, declared: FieldInfo) -> str:
    part, _, field = name.partition(".")
    value = BED[field] if part == "bed" and field in BED else declared.default
    if declared.is_required() and value is declared.default:
        return "none: required"
    if value is None:
        return "worked out"
    return f"`{list(value) if isinstance(value, tuple) else value!r}`".replace("'", '"')


if __name__ == "__main__":
    print(text(), end="")
