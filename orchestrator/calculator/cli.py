"""The command `threshold`: ranges and questions of the command line, and what it prints."""

import argparse
import csv
import itertools
import json
import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from orchestrator.calculator import GEOMETRIC, MOST_POINTS, PARAMETERS, QUANTITIES
from orchestrator.errors import InputError
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.fluids import FLUIDS, PAPER, STANDARD_DEG_C, TEMPERATURE, numbers_of

if TYPE_CHECKING:  # these load numpy
    from orchestrator.calculator.table import Table
    from orchestrator.types import Row

Value = float | str  # a number, or a part of the diameter such as ``d/30``
OF_FLUID = {"fluid_density": "density", "viscosity": "viscosity"}
"""Parameters that a fluid has by its name, as a table ``[fluid]`` calls them."""
OPTIONS = {
    name: f"--{name.removesuffix('_deg').replace('_', '-')}"
    for name in (*PARAMETERS, "fluid", "temperature", "law")
}
FORM = "write a number in SI units, or FIRST:LAST:COUNT such as 1e-4:2e-3:20; a z0 may be d/30"
RANGES = (
    "Any number may be a range FIRST:LAST:COUNT, such as --diameter 1e-4:2e-3:20, for a table; "
    "several ranges give every combination. Diameter, viscosity, roughness and depth are spaced "
    "geometrically, all others evenly. A fluid below 100 kg/m3 is a gas."
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


def add(commands: Any) -> None:
    """Add ``threshold`` to the parser of the program."""
    about = "when one grain starts to move, closed form, at once"
    command = commands.add_parser("threshold", help=about, epilog=RANGES)
    for name, each in PARAMETERS.items():
        default = f"{each.default:g}" if isinstance(each.default, float) else each.default
        of_paper = ", that of the paper's fluid" if name in OF_FLUID else ""
        text = f"default {default}{of_paper}" if default else ""
        text = "; ".join(filter(None, (each.label, each.note, text)))
        settings = {"required": name == "diameter", "metavar": "X"}
        command.add_argument(OPTIONS[name], dest=name, help=text, **settings)
    text = f"{', '.join(FLUIDS)}: its density and viscosity at --temperature; default the paper's"
    command.add_argument("--fluid", metavar="NAME", help=text)
    text = f"of that fluid, deg C, one number; default {STANDARD_DEG_C:g}"
    command.add_argument("--temperature", type=float, metavar="T", help=text)
    text = "force law of the answer; default %(default)s; paper: Eq. 2 or 4 where each holds"
    command.add_argument("--law", default="bridged", metavar="NAME", help=text)
    form = command.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="an object for each law by its name")
    form.add_argument("--csv", action="store_true", help="a row for each point and law")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    texts = {name: text for name in PARAMETERS if (text := getattr(options, name)) is not None}
    axes = {name: values(name, text) for name, text in texts.items()}
    if (count := math.prod(map(len, axes.values()))) > MOST_POINTS:
        what = f"the ranges have {count} points together, more than {MOST_POINTS}"
        raise InputError(what, "threshold", "lower a COUNT")
    points = dict(zip(axes, zip(*itertools.product(*axes.values()), strict=True), strict=True))
    table, asked = answered(points, options.law, options.fluid, options.temperature, OPTIONS)
    if asked:
        print(f"orchestrator: {'; '.join(asked)}", file=sys.stderr)
    columns = [column.tolist() for column in table.values()]
    if options.csv:
        cells = ([x if x == x else None for x in column] for column in columns)  # NaN: no text
        csv.writer(sys.stdout, lineterminator="\n").writerows([table, *zip(*cells, strict=True)])
        return 0
    rows = [dict(zip(table, row, strict=True)) for row in zip(*columns, strict=True)]
    if options.json:
        print(as_json(rows))
    else:
        varied = [name for name, axis in axes.items() if len(axis) > 1]
        print("\n".join(as_text(rows, options.law, varied, options.fluid)))
    return 0


def values(name: str, text: str) -> list[Value]:
    """The values that a text gives to a parameter.

    The text is a number, or a range ``FIRST:LAST:COUNT``, both ends included; of a roughness both
    may be parts of the diameter. An `InputError` refuses all else.
    """
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
        raise InputError(f"{text!r} is not a range of values that rise", OPTIONS[name], FORM)
    import numpy as np

    space = np.geomspace if name in GEOMETRIC and first > 0 else np.linspace
    spaced = space(first, last, int(count)).tolist()
    return [f"d/{1 / part:.12g}" for part in spaced] if of_diameter else spaced


def answered(
    points: Mapping[str, Sequence[Value]],
    law: str,
    fluid: str | None,
    degrees: float | None,
    names: Mapping[str, str],
) -> tuple["Table", list[str]]:
    """`table.thresholds` of points, in a fluid by its name (at deg C), and questions on them.

    `names` are those that refusals and questions have for the parameters.
    """
    from orchestrator.calculator.table import thresholds

    asked: list[str] = []
    try:
        asks: dict[str, Any] = {"kind": fluid, TEMPERATURE: degrees}
        asks |= {field: points.get(name) for name, field in OF_FLUID.items()}
        table = numbers_of({field: value for field, value in asks.items() if value is not None})
        if fluid is not None:
            count = len(points["diameter"])
            points = {**points, **{n: [table[k]] * count for n, k in OF_FLUID.items()}}
        asked = questions(points, names)
        return thresholds(points, law), asked
    except InputError as error:
        fields = {each.field: names[name] for name, each in PARAMETERS.items()}
        fields |= {"fluid.kind": names["fluid"], f"fluid.{TEMPERATURE}": names["temperature"]}
        fields["law"] = names["law"]
        texts = error.what, error.where, "; ".join(filter(None, [error.remedy, *asked]))
        written = r"\b([a-z]+\.[a-z_]+|(?<=threshold: )(depth|law))\b"
        named = [re.sub(written, lambda at: fields.get(at[0], at[0]), text) for text in texts]
        raise InputError(*named) from None


def questions(points: Mapping[str, Sequence[Value]], names: Mapping[str, str]) -> list[str]:
    """Questions on parameters whose largest value, or smallest diameter, looks wrong."""
    given = {name: points.get(name, (each.default,)) for name, each in PARAMETERS.items()}
    numbers = {n: [x for x in xs if isinstance(x, int | float)] for n, xs in given.items()}
    top = {name: max(values, default=0.0) for name, values in numbers.items()}
    asked = [
        f"{question.format(top[name])}, {names[name]} {top[name] * factor:.4g}?"
        for name, low, high, question, factor in UNITS
        if low <= top[name] < high
    ]
    smallest, rho, nu = min(numbers["diameter"]), top["fluid_density"], top["viscosity"]
    low, high = USUAL_PA_S[rho < GAS_BELOW]
    if 0 < smallest < COHESIVE_BELOW[rho < GAS_BELOW]:
        cohesion = "cohesion, which the force laws leave out, holds grains this small"
        asked.append(f"{smallest:g} m: {cohesion}; they need a stronger flow")
    is_of_air = rho >= GAS_BELOW and nu == PARAMETERS["viscosity"].default
    if rho > 0 and nu > 0 and (is_of_air or not low <= rho * nu <= high):
        unusual = f"{nu:g} m2/s, or {rho * nu:.3g} Pa s, is unusual for {rho:g} kg/m3"
        asked.append(f"{unusual}: is it right? {names['fluid']} names water, seawater, air")
    return asked


def _is_nan(value: object) -> bool:
    return isinstance(value, float) and math.isnan(value)


def as_json(rows: Sequence["Row"]) -> str:
    """A record for one point, or a list of records: parameters, rules, an object for each law."""
    from orchestrator.physics.beside import MEASURED, TESTED
    from orchestrator.physics.threshold import LAWS_OF

    names = {column: name for column, (name, _) in QUANTITIES.items()}
    names |= {name: name for name in ("valid", "why_not", *MEASURED, *TESTED)}
    count = len({row["law"] for row in rows})
    records = []
    for start in range(0, len(rows), count):
        of_laws, first = rows[start : start + count], rows[start]
        record: Row = {"input": {name: first[each.column] for name, each in PARAMETERS.items()}}
        record |= {"regime": first["regime"], "paper": [*LAWS_OF[first["regime"]]]}
        record |= {"answer": [row["law"] for row in of_laws if row["answer"]]}
        for row in of_laws:
            record[row["law"]] = {name: row[column] for column, name in names.items()}
        records.append(record)
    answer = json.dumps(records if len(records) > 1 else records[0])
    # JSON has neither NaN nor Infinity
    return json.dumps(json.loads(answer, parse_constant=lambda _: None), indent=2)


def as_text(
    rows: Sequence["Row"], answer: str, varied: Sequence[str], fluid: str | None
) -> Iterator[str]:
    """Lines for people: of one point the answer and every law, of many points the answer's rows."""
    from orchestrator.physics.beside import sentences
    from orchestrator.physics.threshold import LAWS_OF

    chosen = [row for row in rows if row["answer"]]
    name = "The paper's rule" if answer == "paper" else f"Force law {answer}"
    quantities = {column: label for column, (_, label) in QUANTITIES.items()}
    shown = {c: text for c, text in quantities.items() if not all(_is_nan(row[c]) for row in rows)}
    if "mean_velocity_m_s" in shown:
        shown.pop("current_1m_m_s", None)
    first = {PARAMETERS[key].column: PARAMETERS[key].label for key in varied}
    if varied:
        yield name
        rows = chosen
    else:
        yield f"{name}: a grain of {rows[0]['d_m'] * 1000:.4g} mm starts to move at"
        width = max(map(len, shown.values()))
        for column, label in (shown if len(chosen) == 1 else {"law": "", **shown}).items():
            numbers = (f"{_text(row[column]):10}" for row in chosen)
            yield f"  {'  '.join([label.ljust(width), *numbers])}".rstrip()
        yield ""
        for row in chosen:
            of_law = f"{row['law']}: " if len(chosen) > 1 else ""
            yield from (of_law + said for said in sentences(row))
        yield ""
        rows = sorted(rows, key=lambda row: not row["answer"])
        shown.pop("wind_1m_m_s", None)
    if not varied or answer == "paper":
        first["law"] = "force law"
    first |= {c: label for c, label in shown.items() if c not in ("drag_n", "lift_n")}
    if varied:
        first |= {"measured_median": "measured", "measured_curve": "curve"}
    holds = ["holds", *(f"no: {row['why_not']}" if row["why_not"] else "yes" for row in rows)]
    columns = [[label, *(_text(row[c]) for row in rows)] for c, label in first.items()]
    widths = [max(map(len, column)) for column in columns]
    for *cells, last in zip(*columns, holds, strict=True):
        yield "  ".join([*(f"{c:<{w}}" for c, w in zip(cells, widths, strict=True)), last])
    if not varied:
        yield f"\nlaws of the paper's rule: {' and '.join(LAWS_OF[rows[0]['regime']])}"
    fluids = {(row["rho_f_kg_m3"], row["nu_m2_s"]) for row in rows}
    if fluid or fluids == {PAPER}:
        ((rho, nu),) = fluids
        name = fluid or "the paper's fluid (real air: --fluid air)"
        yield f"{name}: {rho:g} kg/m3, {nu:.5g} m2/s"
    liquid = [row for row in rows if row["rho_f_kg_m3"] >= GAS_BELOW]
    if any(_is_nan(row["depth_m"]) for row in liquid):
        yield "for the mean velocity of the liquid give its depth, --depth in m"
    elif any(_is_nan(row["mean_velocity_m_s"]) and row["valid"] for row in liquid):
        yield "no mean velocity: U D/nu is below 2000, where the flow may be laminar"


def _text(value: Value) -> str:
    return value if isinstance(value, str) else "-" if _is_nan(value) else f"{value:.4g}"
