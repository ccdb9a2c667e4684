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
from orchestrator.physics.fluids import (
    FLUIDS,
    PAPER,
    STANDARD_DEG_C,
    TEMPERATURE,
    numbers_of,
)
from orchestrator.study.units import first, meant, number, questions

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


def add(commands: Any) -> None:
    """Add ``threshold`` to the parser of the program."""
    about = "when one grain starts to move, closed form, at once"
    command = commands.add_parser("threshold", help=about, epilog=RANGES)
    for name, each in PARAMETERS.items():
        default = (
            f"{each.default:g}" if isinstance(each.default, float) else each.default
        )
        of_paper = ", that of the paper's fluid" if name in OF_FLUID else ""
        text = f"default {default}{of_paper}" if default else ""
        text = "; ".join(filter(None, (each.label, each.note, text)))
        settings = {"required": name == "diameter", "metavar": "X"}
        command.add_argument(OPTIONS[name], dest=name, help=text, **settings)
    text = f"{', '.join(FLUIDS)}: its density and viscosity at --temperature; default the paper's"
    command.add_argument("--fluid", metavar="NAME", help=text)
    text = f"of that fluid, deg C, one number; default {STANDARD_DEG_C:g}"
    command.add_argument("--temperature", type=number, metavar="T", help=text)
    text = (
        "force law of the answer; default: bridged, or bridged-gravel where the drag law "
        "of bridged ends; paper: Eq. 2 or 4 where each holds"
    )
    command.add_argument("--law", default="auto", metavar="NAME", help=text)
    form = command.add_mutually_exclusive_group()
    form.add_argument(
        "--json", action="store_true", help="an object for each law by its name"
    )
    form.add_argument("--csv", action="store_true", help="a row for each point and law")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    axes: dict[str, list[Value]] = {}
    for name in PARAMETERS:
        text = getattr(options, name)
        if text is not None:
            axes[name] = values(name, text)
    count = math.prod(map(len, axes.values()))
    if count > MOST_POINTS:
        what = f"the ranges have {count} points together, more than {MOST_POINTS}"
        raise InputError(what, "threshold", "lower a COUNT")
    columns = zip(*itertools.product(*axes.values()), strict=True)
    points = dict(zip(axes, columns, strict=True))
    table, asked = answered(
        points, options.law, options.fluid, options.temperature, OPTIONS, "{} {:.4g}"
    )
    if asked:
        print(f"orchestrator: {'; '.join(asked)}", file=sys.stderr)
    rows_of_values = zip(*(column.tolist() for column in table.values()), strict=True)
    if options.csv:
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(table)
        for row in rows_of_values:
            writer.writerow([None if _is_nan(value) else value for value in row])
        return 0
    rows = [dict(zip(table, row, strict=True)) for row in rows_of_values]
    if options.json:
        print(as_json(rows))
        return 0
    varied = [name for name, axis in axes.items() if len(axis) > 1]
    print("\n".join(as_text(rows, options.law, varied, options.fluid)))
    return 0


def values(name: str, text: str) -> list[Value]:
    """The values that a text gives to a parameter.

    Parameters
    ----------
    name
        Of the parameter, a key of `PARAMETERS`.
    text
        A number, or a range ``FIRST:LAST:COUNT``, both ends included; of a roughness both
        may be parts of the diameter.

    Raises
    ------
    InputError
        For any other text.

    Examples
    --------
    >>> values("slope_deg", "0:30:4")
    [0.0, 10.0, 20.0, 30.0]
    >>> values("roughness", "d/30")
    ['d/30']
    """
    is_part = name == "roughness" and "/" in text
    ends = text.split(":")
    if is_part and len(ends) == 1:
        return [text]
    try:
        numbers = [_end(end, is_part) for end in ends[:2]]
        count = number(ends[2]) if len(ends) == 3 else 0.0
    except (ValueError, IndexError, ZeroDivisionError):
        hint = meant(text) or FORM
        what = f"{text!r} is neither a number nor a range"
        raise InputError(what, OPTIONS[name], hint) from None
    if len(ends) == 1:
        return [*numbers]
    first, last = numbers
    is_count = 2 <= count <= MOST_POINTS and count % 1 == 0
    if not (first < last < math.inf and is_count):
        what = f"{text!r} is not a range of values that rise"
        raise InputError(what, OPTIONS[name], FORM)
    import numpy as np

    if name in GEOMETRIC and first > 0:
        spaced = np.geomspace(first, last, int(count)).tolist()
    else:
        spaced = np.linspace(first, last, int(count)).tolist()
    if is_part:
        return [f"d/{1 / part:.12g}" for part in spaced]
    return [*spaced]


def _end(text: str, is_part: bool) -> float:
    """A number, or the part of the diameter that a text such as ``d/30`` is."""
    return 1 / number(text.split("d/")[1]) if is_part else number(text)


def answered(
    points: Mapping[str, Sequence[Value]],
    law: str,
    fluid: str | None,
    degrees: float | None,
    names: Mapping[str, str],
    form: str,
) -> tuple["Table", list[str]]:
    """The thresholds of some points, and questions on their numbers.

    Parameters
    ----------
    points
        Columns of one length, by keys of `PARAMETERS`.
    law
        The force law of the answer, ``auto`` or ``paper``.
    fluid, degrees
        Name of the fluid and its temperature, deg C, in place of density and viscosity.
    names
        What refusals and questions call the parameters, ``fluid``, ``temperature`` and
        ``law``.
    form
        How a parameter is given a value: a format of its name and the value.

    Returns
    -------
    The table of `table.thresholds`, and the questions of `units.questions`.

    Raises
    ------
    InputError
        What is asked first, then what is wrong.
    """
    from orchestrator.calculator.table import thresholds

    fields = {each.field: names[name] for name, each in PARAMETERS.items()}
    fields |= {
        "fluid.kind": names["fluid"],
        f"fluid.{TEMPERATURE}": names["temperature"],
    }
    fields["law"] = names["law"]
    asked: list[str] = []
    try:
        given: dict[str, Any] = {"kind": fluid, TEMPERATURE: degrees}
        given |= {field: points.get(name) for name, field in OF_FLUID.items()}
        given = {field: value for field, value in given.items() if value is not None}
        table = numbers_of(given)
        if fluid is not None:
            count = len(points["diameter"])
            of_fluid = {
                name: [table[field]] * count for name, field in OF_FLUID.items()
            }
            points = {**points, **of_fluid}
        asked = questions(_numbers(points), fields, form)
        return thresholds(points, law), asked
    except InputError as error:
        named = InputError(
            _named(error.what, fields),
            _named(error.where, fields),
            _named(error.remedy, fields),
        )
        raise first(asked, named, "threshold", fields.values()) from None


def _numbers(points: Mapping[str, Sequence[Value]]) -> dict[str, list[float]]:
    """The numbers of some points, by the fields of a study file; what is open is default."""
    count = len(points["diameter"])
    found = {}
    for name, parameter in PARAMETERS.items():
        column = points.get(name, [parameter.default] * count)
        numbers = [value for value in column if isinstance(value, int | float)]
        found[parameter.field] = numbers
    return found


def _named(text: str, fields: Mapping[str, str]) -> str:
    """A message about fields of a study file with the names that these have here."""
    written = r"\b([a-z]+\.[a-z_]+|(?<=threshold: )(depth|law))\b"
    return re.sub(written, lambda at: fields.get(at[0], at[0]), text)


def _is_nan(value: object) -> bool:
    return isinstance(value, float) and math.isnan(value)


def as_json(rows: Sequence["Row"]) -> str:
    """A record for one point, or a list of records, as JSON.

    A record has the parameters, the laws of the rules, and an object for each law.
    """
    from orchestrator.physics.beside import MEASURED, TESTED
    from orchestrator.physics.threshold import LAWS_OF

    names = {column: name for column, (name, _) in QUANTITIES.items()}
    names |= {name: name for name in ("valid", "why_not", *MEASURED, *TESTED)}
    count = len({row["law"] for row in rows})
    records = []
    for start in range(0, len(rows), count):
        of_laws = rows[start : start + count]
        regime = of_laws[0]["regime"]
        record: Row = {}
        record["input"] = {n: of_laws[0][each.column] for n, each in PARAMETERS.items()}
        record["regime"] = regime
        record["paper"] = [*LAWS_OF[regime]]
        record["answer"] = [row["law"] for row in of_laws if row["answer"]]
        for row in of_laws:
            record[row["law"]] = {name: row[column] for column, name in names.items()}
        records.append(record)
    answer = json.dumps(records if len(records) > 1 else records[0])
    # JSON has neither NaN nor Infinity
    return json.dumps(json.loads(answer, parse_constant=lambda _: None), indent=2)


def as_text(
    rows: Sequence["Row"], answer: str, varied: Sequence[str], fluid: str | None
) -> Iterator[str]:
    """Lines for people.

    Parameters
    ----------
    rows
        A row for each point and law, as `table.thresholds` has them.
    answer
        The force law of the answer, ``auto`` or ``paper``.
    varied
        The parameters that are ranges, keys of `PARAMETERS`.
    fluid
        Name of the fluid, if one was given.

    Yields
    ------
    Of one point the answer and every law, of many points the rows of the answer.
    """
    if varied:
        yield from _of_many(rows, answer, varied)
    else:
        yield from _of_one(rows, answer)
    fluids = {(row["rho_f_kg_m3"], row["nu_m2_s"]) for row in rows}
    if fluid or fluids == {PAPER}:
        ((density, viscosity),) = fluids
        name = fluid or "the paper's fluid (real air: --fluid air)"
        yield f"{name}: {density:g} kg/m3, {viscosity:.5g} m2/s"
    liquid = [row for row in rows if row["rho_f_kg_m3"] >= GAS_BELOW]
    if any(_is_nan(row["depth_m"]) for row in liquid):
        yield "for the mean velocity of the liquid give its depth, --depth in m"
    elif any(_is_nan(row["mean_velocity_m_s"]) and row["valid"] for row in liquid):
        yield "no mean velocity: U D/nu is below 2000, where the flow may be laminar"


def _of_one(rows: Sequence["Row"], answer: str) -> Iterator[str]:
    """The answer for one point, what was measured beside it, and a table of every law."""
    from orchestrator.physics.beside import sentences
    from orchestrator.physics.threshold import LAWS_OF

    shown = _shown(rows)
    chosen = [row for row in rows if row["answer"]]
    name = f"Force law {chosen[0]['law']}: a grain"
    if answer == "paper":  # which gives both of its laws where neither holds
        name = "The paper's rule: a grain"
    elif not chosen[0]["valid"]:
        holding = ", ".join(f"--law {row['law']}" for row in rows if row["valid"])
        name = (
            f"Force law {chosen[0]['law']} does not hold here: {chosen[0]['why_not']}"
        )
        name = f"{name} (choose {holding}). By it a grain"
    yield f"{name} of {rows[0]['d_m'] * 1000:.4g} mm starts to move at"
    width = max(map(len, shown.values()))
    listed = shown if len(chosen) == 1 else {"law": "", **shown}
    for column, label in listed.items():
        numbers = [f"{_text(row[column]):10}" for row in chosen]
        yield f"  {'  '.join([label.ljust(width), *numbers])}".rstrip()
    yield ""
    for row in chosen:
        of_law = f"{row['law']}: " if len(chosen) > 1 else ""
        for said in sentences(row):
            yield of_law + said
    yield ""
    shown.pop("wind_1m_m_s", None)
    ordered = sorted(rows, key=lambda row: not row["answer"])
    yield from _as_table(ordered, {"law": "force law", **shown})
    yield f"\nlaws of the paper's rule: {' and '.join(LAWS_OF[rows[0]['regime']])}"


def _of_many(
    rows: Sequence["Row"], answer: str, varied: Sequence[str]
) -> Iterator[str]:
    """The rows of the answer for many points."""
    chosen = [row for row in rows if row["answer"]]
    laws = [*dict.fromkeys(row["law"] for row in chosen)]
    name = f"Force law {' and '.join(sorted(laws, key=len))}"
    if answer == "paper":
        name = "The paper's rule"
    yield name
    heads = {PARAMETERS[key].column: PARAMETERS[key].label for key in varied}
    if answer == "paper" or len(laws) > 1:
        heads["law"] = "force law"
    measured = {"measured_median": "measured", "measured_curve": "curve"}
    yield from _as_table(chosen, heads | _shown(rows) | measured)


def _shown(rows: Sequence["Row"]) -> dict[str, str]:
    """The quantities that some row has, by column, with their labels."""
    shown = {}
    for column, (_, label) in QUANTITIES.items():
        if not all(_is_nan(row[column]) for row in rows):
            shown[column] = label
    if "mean_velocity_m_s" in shown:
        shown.pop("current_1m_m_s", None)
    return shown


def _as_table(rows: Sequence["Row"], heads: Mapping[str, str]) -> Iterator[str]:
    """Lines of a table, with a last column that says whether the law holds."""
    holds = ["holds"]
    for row in rows:
        holds.append(f"no: {row['why_not']}" if row["why_not"] else "yes")
    columns = []
    for column, head in heads.items():
        if column in ("drag_n", "lift_n"):
            continue
        cells = [head, *(_text(row[column]) for row in rows)]
        width = max(map(len, cells))
        columns.append([cell.ljust(width) for cell in cells])
    for *cells, last in zip(*columns, holds, strict=True):
        yield "  ".join([*cells, last])


def _text(value: Value) -> str:
    if isinstance(value, str):
        return value
    return "-" if _is_nan(value) else f"{value:.4g}"
