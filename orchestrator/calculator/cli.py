"""The command `threshold`: ranges and questions of the command line, and what it prints."""

import argparse
import itertools
import json
import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from orchestrator.calculator import GAS_BELOW, GEOMETRIC, MOST_POINTS, PARAMETERS, QUANTITIES
from orchestrator.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

Value = float | str  # a number, or a part of the diameter such as ``d/30``
OPTIONS = {name: f"--{name.removesuffix('_deg').replace('_', '-')}" for name in PARAMETERS}
FORM = "write a number in SI units, or FIRST:LAST:COUNT such as 1e-4:2e-3:20; a z0 may be d/30"
RANGES = (
    "Any number may be a range FIRST:LAST:COUNT, such as --diameter 1e-4:2e-3:20, for a table; "
    "several ranges give every combination. Values of diameter, viscosity, roughness and depth "
    "are spaced geometrically, all others evenly. Winds are those of the logarithmic law over z0; "
    "a fluid below 100 kg/m3 is a gas. A law that does not hold is marked, with the reason."
)
UNITS = (
    ("diameter", 0.05, 20.0, "{0:g} m: did you mean {0:g} mm", 1e-3),
    ("diameter", 20.0, math.inf, "{0:g} m: did you mean {0:g} um", 1e-6),
    ("density", 1e-300, 30.0, "{0:g} kg/m3: did you mean {0:g} g/cm3", 1e3),
    ("slope_deg", 0.05, 0.55, "{0:g} deg: did you mean {0:g} rad", 180 / math.pi),
    ("entrainment_angle_deg", 1e-300, 1.571, "{0:g} deg: did you mean {0:g} rad", 180 / math.pi),
    ("lift_coefficient", 6.0, 7.0, "{0:g}: did you mean Saffman's for the radius", 0.25),
    ("gravity", 50.0, math.inf, "{0:g} m/s2: did you mean {0:g} cm/s2", 0.01),
)
"""Ranges in which a number is likelier in another unit, the question, and the factor to SI."""
COHESIVE_BELOW = (6e-5, 1e-4)
"""Diameter below which cohesion is no longer small against the weight, in liquids and gases, m."""
USUAL_PA_S = ((1e-4, 0.1), (3e-6, 1e-4))  # usual dynamic viscosities of liquids and gases, Pa s
RULE = {
    "low": "Eq. 2 (low), since Re* is below 3",
    "high": "Eq. 4 (high), since Re* is not below 30",
    "transition": "both Eq. 2 (low) and Eq. 4 (high), since neither holds",
}
"""Laws that the paper's rule picks in each regime."""


def add(commands: Any) -> None:
    """Add ``threshold`` to the parser of the program."""
    command = commands.add_parser(
        "threshold", help="when one grain starts to move, closed form, at once", epilog=RANGES
    )
    for name, each in PARAMETERS.items():
        default = f"{each.default:g}" if isinstance(each.default, float) else each.default
        text = "; ".join(filter(None, (each.label, each.note, default and f"default {default}")))
        settings = {"default": default, "required": name == "diameter", "metavar": "X"}
        command.add_argument(OPTIONS[name], dest=name, help=text, **settings)
    text = "force law of the answer; default %(default)s; paper: Eq. 2 or 4 where each holds"
    command.add_argument("--law", default="bridged", metavar="NAME", help=text)
    form = command.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="an object for each law by its name")
    form.add_argument("--csv", action="store_true", help="a row for each point and law")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    import pandas as pd

    from orchestrator.calculator import table

    table.check_law(options.law, "--law")
    texts = {name: getattr(options, name) for name in PARAMETERS}
    axes = {name: values(name, text) for name, text in texts.items() if text is not None}
    if (count := math.prod(map(len, axes.values()))) > MOST_POINTS:
        what = f"the ranges have {count} points together, more than {MOST_POINTS}"
        raise InputError(what, "threshold", "lower a COUNT")
    asked = questions(axes)
    points = pd.DataFrame(itertools.product(*axes.values()), columns=list(axes))
    try:
        thresholds = table.thresholds(points, options.law)
    except InputError as error:
        raise _renamed(error, asked) from None
    if asked:
        print(f"orchestrator: {'; '.join(asked.values())}", file=sys.stderr)
    if options.csv:
        print(thresholds.to_csv(index=False), end="")
    elif options.json:
        print(as_json(thresholds))
    else:
        varied = [name for name, axis in axes.items() if len(axis) > 1]
        print("\n".join(as_text(thresholds, options.law, varied)))
    return 0


def values(name: str, text: str) -> list[Value]:
    """The values that a text gives to a parameter.

    The text is a number, or a range ``FIRST:LAST:COUNT``, both ends included; of a roughness both
    may be parts of the diameter. An `InputError` refuses all else.
    """
    import numpy as np

    ends, of_diameter = text.split(":"), name == "roughness" and "/" in text
    if of_diameter and len(ends) == 1:
        return [text]
    try:
        numbers = [1 / float(end.split("d/")[1]) if of_diameter else float(end) for end in ends[:2]]
        count = float(ends[2]) if len(ends) == 3 else 0.0
    except (ValueError, IndexError, ZeroDivisionError):
        raise InputError(f"{text!r} is neither a number nor a range", OPTIONS[name], FORM) from None
    if len(ends) == 1:
        return [*numbers]
    first, last = numbers
    if not (first < last < math.inf and 2 <= count <= MOST_POINTS and count % 1 == 0):
        what = f"{text!r} is not a range of 2 to {MOST_POINTS} values that rise"
        raise InputError(what, OPTIONS[name], FORM)
    space = np.geomspace if name in GEOMETRIC and first > 0 else np.linspace
    with np.errstate(all="ignore"):  # the scene refuses values of a range wider than all floats
        spaced = space(first, last, int(count)).tolist()
    return [f"d/{1 / part:.12g}" for part in spaced] if of_diameter else spaced


def questions(axes: Mapping[str, Sequence[Value]]) -> dict[str, str]:
    """Questions on parameters whose largest value, or smallest diameter, looks wrong, by name."""
    numbers = {
        name: [value for value in axis if not isinstance(value, str) and math.isfinite(value)]
        for name, axis in axes.items()
    }
    top = {name: max(values, default=0.0) for name, values in numbers.items()}
    asked = {
        name: f"{question.format(top[name])}, {OPTIONS[name]} {top[name] * factor:.4g}?"
        for name, low, high, question, factor in UNITS
        if low <= top[name] < high
    }
    smallest, rho, nu = min(numbers["diameter"], default=0), top["fluid_density"], top["viscosity"]
    if "diameter" not in asked and 0 < smallest < COHESIVE_BELOW[rho < GAS_BELOW]:
        asked["diameter"] = (
            f"{smallest:g} m: cohesion, which the force laws leave out, holds grains this small;"
            " they need a stronger flow"
        )
    low, high = USUAL_PA_S[rho < GAS_BELOW]
    of_air = rho >= GAS_BELOW and nu == PARAMETERS["viscosity"].default
    if rho > 0 and nu > 0 and (of_air or not low <= rho * nu <= high):
        asked["viscosity"] = (
            f"{nu:g} m2/s, or {rho * nu:.3g} Pa s, is unusual for {rho:g} kg/m3: air has"
            " --fluid-density 1.2 and --viscosity 1.5e-05, water 1000 and 1e-06; is it right?"
        )
    return asked


def _renamed(error: InputError, asked: Mapping[str, str]) -> InputError:
    """A refusal with options for the fields of a study file; questions are its remedy."""
    options = {each.field: OPTIONS[name] for name, each in PARAMETERS.items()}
    named = partial(re.sub, r"\b[a-z]+\.[a-z_]+\b", lambda field: options.get(field[0], field[0]))
    place, _, field = error.where.rpartition(": ")
    where = f"{place}: {options.get(field, field)}" if place else field
    about = [text for name, text in asked.items() if not place or where.endswith(OPTIONS[name])]
    advice = about if about and not place else [named(error.remedy), *about]
    return InputError(named(error.what), where, "; ".join(filter(None, advice)))


def as_json(table: "pd.DataFrame") -> str:
    """A record for one point, or a list of records: parameters, rules, an object for each law."""
    import numpy as np

    from orchestrator.physics.threshold import LAWS_OF

    names = {column: name for column, (name, _) in QUANTITIES.items()}
    names |= {"valid": "valid", "why_not": "why_not"}
    table = table.replace([np.inf, -np.inf], np.nan)  # JSON has neither
    rows = table.astype(object).where(table.notna(), None).to_dict("records")
    laws = table["law"].nunique()
    records = [
        {
            "input": {name: point[0][each.column] for name, each in PARAMETERS.items()},
            "regime": point[0]["regime"],
            "paper": list(LAWS_OF[point[0]["regime"]]),
            "answer": [row["law"] for row in point if row["answer"]],
            **{row["law"]: {name: row[c] for c, name in names.items()} for row in point},
        }
        for point in (rows[start : start + laws] for start in range(0, len(rows), laws))
    ]
    if len(records) == 1:
        return json.dumps(records[0], indent=2, allow_nan=False)
    lines = ",\n".join(json.dumps(record, allow_nan=False) for record in records)
    return f"[\n{lines}\n]"


def as_text(table: "pd.DataFrame", answer: str, varied: Sequence[str]) -> Iterator[str]:
    """Lines for people: of one point the answer and every law, of many points the answer's rows."""
    chosen = table[table["answer"]]
    name = "The paper's rule" if answer == "paper" else f"Force law {answer}"
    shown = {c: label for c, (_, label) in QUANTITIES.items() if table[c].notna().any()}
    if varied:
        yield name
        first = {PARAMETERS[key].column: PARAMETERS[key].label for key in varied}
        first |= {"law": "force law"} if answer == "paper" else {}
        rows = chosen
    else:
        yield f"{name}: a grain of {table['d_m'].iloc[0] * 1000:.4g} mm starts to move at"
        columns = [["", *shown.values()]]
        columns += [[row["law"], *map(_text, row[[*shown]])] for _, row in chosen.iterrows()]
        yield from (f"  {line}" for line in _aligned(columns)[len(chosen) == 1 :])
        for law, why in zip(chosen["law"], chosen["why_not"], strict=True):
            if why:
                yield f"  outside the range of {law}: {why}"
        yield ""
        first = {"law": "force law"}
        rows = table.sort_values("answer", ascending=False, kind="stable")
        shown.pop("wind_1m_m_s", None)
    first |= {c: label for c, label in shown.items() if c not in ("drag_n", "lift_n")}
    holds = ["holds", *(f"no: {why}" if why else "yes" for why in rows["why_not"])]
    yield from _aligned([*([label, *map(_text, rows[c])] for c, label in first.items()), holds])
    if not varied:
        yield f"\npaper's rule: {RULE[table['regime'].iloc[0]]}"
    liquid = table[(table["rho_f_kg_m3"] >= GAS_BELOW) & table["mean_velocity_m_s"].isna()]
    if liquid["depth_m"].isna().any():
        yield "for the mean velocity of the liquid give its depth, --depth in m"
    if (liquid["depth_m"].notna() & liquid["valid"]).any():
        yield "no mean velocity: U D/nu is below 2000, where the flow may be laminar"


def _text(value: Value) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


def _aligned(columns: Sequence[Sequence[str]]) -> list[str]:
    """Lines of columns of cells, each as wide as its widest cell."""
    widths = [max(map(len, column)) for column in columns]
    return [
        "  ".join(f"{c:<{w}}" for c, w in zip(cells, widths, strict=True)).rstrip()
        for cells in zip(*columns, strict=True)
    ]
