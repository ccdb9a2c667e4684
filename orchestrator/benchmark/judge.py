"""Judge the answers of solvers to the scenes of a pack: errors and verdicts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark.pack import COUNTS, Pack, number_of
from orchestrator.errors import one_line, printable
from orchestrator.runs import workspace
from orchestrator.runs.files import opened, read_json

ANSWER = "answer.csv"
"""The file of a scene with a solver's answer."""
USED = "used.json"
"""The file of a scene with the times and the memory that the answer took."""
OURS = "ours"
"""Name of our own solvers, and of the directory of their answers beside those of the
solver."""
STEPS = "steps"
"""Quantity that a solver may add to any answer: its number of time steps."""
TIMES = ("seconds", "cpu_s", "peak_mib")
"""Wall time, s, processor time, s, and memory, MiB, of an answer."""
MIB = 2**20
"""Bytes of a MiB."""
ANSWER_BYTES = 4 * MIB
"""Size of the largest answer."""
ROUND = 1e-8
"""Relative rounding of a pack's tables."""
LARGEST_ERROR = 1e300
"""Relative errors beyond it are cut to it: the error of 1e308 against 1e-9 is no
double, and neither are the percentage and the mean of two such errors."""
ALIKE = 2e-3
"""Relative spread of factors, or of shifts, up to which they are one."""
ALIKE_FROM = 3
"""Different expected values from which answers may be off alike."""
OTHER = 1e-2
"""Relative difference up to which an answer is the value of another quantity."""
DECLINED = 2
"""Exit code of a solver that does not know a kind of scene."""
EXIT_CODE = "exit_code"
"""Key of the exit code of a solver in `USED`."""
NOT_RUN = "it was not run"
"""Message of a solver that has no directory for a scene."""

Key = tuple[str, str, str]
"""Scene, quantity and `seven_digits` of a question."""


def solver_name(place: Path) -> str:
    """The name of the solver of a directory of results.

    Parameters
    ----------
    place
        The directory.

    Returns
    -------
    str
        What `run` noted there, or else the name of the directory.
    """
    noted = workspace.read_marker(place, workspace.RESULTS).get("solver")
    return printable(str(noted or place.absolute().name))


def seven_digits(at: str) -> str:
    """The number ``at`` of a question, to seven digits.

    Parameters
    ----------
    at
        Its text.

    Returns
    -------
    str
        The number; empty for a quantity that is one number.

    Raises
    ------
    ValueError
        If the text is no number.

    Examples
    --------
    >>> seven_digits("0.333333333"), seven_digits("")
    ('0.3333333', '')
    """
    if not at.strip():
        return ""
    return f"{number_of(at):.7g}"


@dataclass(frozen=True)
class Answers:
    """The answers of a solver to some scenes, and what each scene took.

    Attributes
    ----------
    numbers
        Each answer by scene, quantity and `seven_digits`.
    used
        A row for each scene, by its name: ``message``, the reason why its answer does
        not count, or empty; ``declined`` and ``not_run``, whether the solver does not
        know such scenes, and has no directory for it; `TIMES` in s, s and MiB, and
        `STEPS`, NaN where one is not known.
    """

    numbers: Mapping[Key, float]
    used: pd.DataFrame

    @classmethod
    def read(cls, place: Path, names: Sequence[str]) -> "Answers":
        """Read what a solver left in a directory of results.

        Parameters
        ----------
        place
            The directory.
        names
            Names of the scenes.

        Returns
        -------
        Answers
            Its answers.
        """
        numbers: dict[Key, float] = {}
        rows = []
        for name in names:
            about = read_json(place / name / USED)
            message = str(about.get("error") or "")
            is_declined = bool(message) and about.get(EXIT_CODE) == DECLINED
            is_left = not message and not (place / name).is_dir()
            given: dict[tuple[str, str], float] = {}
            if not message:
                try:
                    given = _answer(place / name / ANSWER)
                except FileNotFoundError:
                    message = NOT_RUN if is_left else f"it wrote no {ANSWER}"
                except (OSError, ValueError) as fault:
                    message = f"{ANSWER}: {fault}"
            for (quantity, at), number in given.items():
                numbers[name, quantity, at] = number
            # the message repeats the output of a program
            row: dict[str, Any] = {"message": one_line(message)}
            row |= {"declined": is_declined, "not_run": is_left}
            for column in TIMES:
                row[column] = _measured(about.get(column))
            row[STEPS] = _measured(given.get((STEPS, "")))
            rows.append(row)
        return cls(numbers, pd.DataFrame(rows, index=list(names)))


def _answer(path: Path) -> dict[tuple[str, str], float]:
    """The answers of a file, by quantity and `seven_digits`.

    Raises OSError or ValueError with the reason why the file does not count.
    """
    with opened(path) as stream:
        content = stream.read(ANSWER_BYTES + 1)
    if len(content) > ANSWER_BYTES:
        raise ValueError(f"it has more than {ANSWER_BYTES // MIB} MiB")
    # some programs begin a text with a mark of its encoding
    lines = content.decode("utf-8-sig").split("\n")
    head, *rows = [[word.strip() for word in line.split(",")] for line in lines]
    if head != ["quantity", "at", "value"]:
        raise ValueError("it does not begin with quantity,at,value")
    if rows[-1:] != [[""]]:
        raise ValueError("it is cut short: its last line has no end")
    answers: dict[tuple[str, str], float] = {}
    for number, row in enumerate(rows, 2):
        if row == [""]:
            continue
        line = f"line {number}, {','.join(row)[:80]!r},"
        try:
            quantity, at, value = row
            key = (quantity, seven_digits(at))
            answer = number_of(value)
        except ValueError:
            what = "is not a quantity, its at and a finite number"
            raise ValueError(f"{line} {what}") from None
        if key in answers:
            raise ValueError(f"{line} is answered twice")
        answers[key] = answer
    return answers


def _measured(value: object) -> float:
    """A time, a memory or a count as it was noted; NaN if it is no positive number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        number = float(value)
    except OverflowError:
        return math.nan
    if not 0 < number < math.inf:
        return math.nan
    return number


def judge_solvers(
    chosen: Pack, names: Sequence[str], results: Sequence[Path]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare the answers of solvers with the expected ones.

    Parameters
    ----------
    chosen
        The pack.
    names
        The scenes of the pack that are judged.
    results
        For each solver the directory with its ``SCENE/answer.csv``, and with
        ``ours/SCENE/answer.csv`` if ours ran in turn with it.

    Returns
    -------
    numbers
        A row for each solver, `OURS` the last, and each expectation: the columns of the
        expectation, ``solver``, ``answer``, ``error`` (relative, at most
        `LARGEST_ERROR`; of a value of zero the answer) and ``within``.
    verdicts
        A row for each solver and scene: ``passed``, ``failed`` or, by a solver that
        answers another scene, ``declined``; ``message``, errors and times.
    """
    expected = chosen.expected[chosen.expected["scene"].isin(names)]
    kinds = {name: chosen.scenes[name]["kind"] for name in names}
    expected = expected.assign(kind=expected["scene"].map(kinds))
    numbers = []
    verdicts = []
    for place in results:
        theirs = Answers.read(place, names)
        ours = Answers.read(place / OURS, names)
        table = _compared(expected, solver_name(place), theirs, ours)
        numbers.append(table)
        verdict = _verdicts(chosen, names, table, theirs, ours.used)
        verdicts.append(verdict)
    again = Answers.read(results[0] / OURS, names)
    table = _compared(expected, OURS, None, again)
    numbers.append(table)
    of_ours = Answers({}, again.used.assign(message="", declined=False, not_run=False))
    verdicts.append(_verdicts(chosen, names, table, of_ours, again.used))
    return pd.concat(numbers, ignore_index=True), pd.concat(verdicts, ignore_index=True)


def _compared(
    expected: pd.DataFrame, solver: str, theirs: Answers | None, ours: Answers
) -> pd.DataFrame:
    """The expectations with the answers of a solver, by default of our own runs."""
    places = expected["at"].map(seven_digits)
    keys = list(zip(expected["scene"], expected["quantity"], places, strict=True))
    table = expected.assign(solver=solver)
    stated = zip(keys, expected["ours"], strict=True)
    table["ours"] = [ours.numbers.get(key, number) for key, number in stated]
    if theirs is None:
        table["answer"] = table["ours"]
    else:
        table["answer"] = [theirs.numbers.get(key, math.nan) for key in keys]
    value = table["value"]
    # the error of a value of zero is the answer
    unit = value.where(value != 0, 1.0)
    with np.errstate(over="ignore"):
        error = (table["answer"] - value) / unit
        margin = (table["tolerance"] + ROUND) * value.abs()
        low = table["low"] - margin
        high = table["high"] + margin
    table["error"] = error.clip(-LARGEST_ERROR, LARGEST_ERROR)
    table["within"] = table["answer"].between(low, high)
    return table


def _verdicts(
    chosen: Pack,
    names: Sequence[str],
    table: pd.DataFrame,
    theirs: Answers,
    ours: pd.DataFrame,
) -> pd.DataFrame:
    """The verdict of each scene from the `_compared` table of a solver and times."""
    unasked = _unasked(table, theirs.numbers)
    judged = table[table["tolerance"].notna()]
    of_scene = dict(iter(table.groupby("scene")))
    off_in = dict(iter(judged[~judged["within"]].groupby("scene")))
    messages = []
    answered = []
    for name in names:
        message = theirs.used["message"][name]
        if not message:
            message = _incomplete(of_scene[name], chosen.scenes[name].get("count"))
        message = message or unasked.get(name, "")
        answered.append(not message)
        if not message and name in off_in:
            message = _off(off_in[name])
        messages.append(message)
    verdict = pd.DataFrame(index=list(names))
    verdict["solver"] = table["solver"].iloc[0]
    verdict["scene"] = list(names)
    for key in ("level", "kind"):
        verdict[key] = [chosen.scenes[name][key] for name in names]
    verdict["message"] = messages
    verdict = verdict.join(theirs.used[[*TIMES, STEPS]])
    verdict = verdict.join(ours[["seconds", "cpu_s", STEPS]].add_prefix("ours_"))
    verdict["answered"] = answered
    verdict = verdict.join(_outcomes(verdict["message"], theirs.used, any(answered)))

    is_answered = judged["scene"].map(verdict["answered"])
    is_count = judged["quantity"].isin(COUNTS)
    errors = judged["error"].where(is_answered)[~is_count]
    sizes = errors.abs().groupby(judged["scene"])
    verdict["error"] = sizes.median()
    verdict["worst"] = sizes.max()
    verdict["bias"] = errors.groupby(judged["scene"]).median()
    for ratio, time in (("ratio", "seconds"), ("cpu_ratio", "cpu_s")):
        over = verdict[time] / verdict[f"ours_{time}"]
        # of times that were noted by another program the ratio may be no double
        verdict[ratio] = over.where(verdict["answered"] & np.isfinite(over))
    return verdict


def _outcomes(
    messages: "pd.Series[str]", used: pd.DataFrame, has_answered: bool
) -> pd.DataFrame:
    """Whether each scene passed, was declined or not run, or else failed."""
    is_known = used["declined"] & has_answered
    is_left = used["not_run"]
    if is_left.all():  # a solver that has no scene at all has failed
        is_left = is_left & False
    verdict = pd.DataFrame(
        {"passed": messages == "", "declined": is_known, "not_run": is_left}
    )
    verdict["failed"] = ~verdict.any(axis=1)
    return verdict


def _incomplete(rows: pd.DataFrame, count: float | None) -> str:
    """What makes the answer to a scene incomplete; empty if nothing does.

    It is an answer that is lacking, or counts that do not make `count`, N of the scene.
    """
    lacking = rows[rows["answer"].isna()].to_dict("records")
    if lacking:
        what = f"{ANSWER} lacks {_question(lacking[0])}"
        if len(lacking) > 1:
            what += f" and {len(lacking) - 1} more"
        return what
    last: Any = rows.groupby("quantity")["answer"].last()
    moved = last.get("moved")
    rest = last.get("not_moved")
    total = last.get("count", count)
    if moved is None or rest is None or total is None:
        return ""
    if moved + rest != total:
        counted = f"{moved:g} moved and {rest:g} not, of {total:g}"
        return f"the counts do not make N: {counted}"
    return ""


def _unasked(table: pd.DataFrame, numbers: Mapping[Key, float]) -> dict[str, str]:
    """By scene, an answer to no question of it, or steps that are no number of them."""
    places = table["at"].map(seven_digits)
    asked = set(zip(table["scene"], table["quantity"], places, strict=True))
    found = {}
    for key, number in numbers.items():
        scene, quantity, at = key
        if (quantity, at) == (STEPS, ""):
            if number < 0 or number != math.floor(number):
                found[scene] = f"{STEPS} is {number:.6g}, no number of time steps"
        elif key not in asked:
            row = {"quantity": quantity, "at": at}
            found[scene] = f"{ANSWER} has {_question(row)}, which was not asked"
    return found


def _off(rows: pd.DataFrame) -> str:
    """The worst of the answers of a scene that are off, all of which are there.

    A count is named only if nothing else is off.
    """
    is_count = rows["quantity"].isin(COUNTS)
    named = rows if is_count.all() else rows[~is_count]
    worst = int(named["error"].abs().argmax())
    row = named.iloc[worst].to_dict()
    message = f"{_question(row)} is {row['answer']:.6g}, not {row['value']:.6g}"
    if row["low"] < row["high"]:
        message += f" ({row['low']:.6g} ... {row['high']:.6g})"
    if len(rows) > 1:
        message += f", and {len(rows) - 1} more are off"
    return message


def _question(row: Mapping[Any, Any]) -> str:
    """A question in words, from its row of the table."""
    return f"{row['quantity']} at {row['at']}" if row["at"] else str(row["quantity"])


def failures(verdicts: pd.DataFrame) -> pd.DataFrame:
    """List the failures of solvers, one for each cause.

    Parameters
    ----------
    verdicts
        The verdicts of `judge_solvers`.

    Returns
    -------
    DataFrame
        Columns ``solver``, ``scenes``, ``kind``, ``why``.
    """
    failed = verdicts[verdicts["failed"]]
    # messages of one cause differ in their numbers
    number = r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?"
    cause = failed["message"].str.replace(number, "#", regex=True)
    rows = []
    groups = failed.groupby(["solver", "kind", cause], sort=False)
    for (solver, kind, _), group in groups:
        first = group.iloc[0]
        scenes = first["scene"]
        if len(group) > 1:
            scenes += f" and {len(group) - 1} more of kind {kind}"
        rows.append((solver, scenes, kind, first["message"]))
    return pd.DataFrame(rows, columns=["solver", "scenes", "kind", "why"])


def by_quantity(numbers: pd.DataFrame) -> pd.DataFrame:
    """Sum up the answers of solvers to each quantity, and name what is off in all.

    Parameters
    ----------
    numbers
        The numbers of `judge_solvers`.

    Returns
    -------
    DataFrame
        A row for each solver but ours, level, kind and quantity that was answered: how
        many answers, how many are outside, the median of their signed errors, that of
        answer over expected value, and ``looks like``: a constant factor, a shift, or
        another quantity; empty where nothing is off or the answers have no such form.
    """
    theirs = numbers[numbers["answer"].notna() & (numbers["solver"] != OURS)]
    level = theirs["scene"].map(lambda name: str(name).partition("-")[0])
    kind = theirs["kind"]
    groups = theirs.groupby(["solver", level, kind, "quantity"], sort=False)
    rows = []
    for (solver, of_level, of_kind, quantity), group in groups:
        is_off = ~group["within"] & group["tolerance"].notna()
        same = theirs[(theirs["solver"] == solver) & (kind == of_kind)]
        with np.errstate(over="ignore"):
            ratio = group["answer"] / group["value"].where(group["value"] != 0)
        ratio = ratio.clip(-LARGEST_ERROR, LARGEST_ERROR)
        rows.append(
            {
                "solver": solver,
                "level": of_level,
                "kind": of_kind,
                "quantity": quantity,
                "answers": len(group),
                "outside": int(is_off.sum()),
                "error, %": 100 * float(group["error"].median()),
                "over expected": float(ratio.median()),
                "looks like": _pattern(group, same) if is_off.any() else "",
            }
        )
    columns = ["solver", "level", "kind", "quantity", "answers", "outside"]
    columns += ["error, %", "over expected", "looks like"]
    return pd.DataFrame(rows, columns=columns)


def patterns(numbers: pd.DataFrame) -> list[str]:
    """Say of which quantities all answers are off alike.

    Parameters
    ----------
    numbers
        The numbers of `judge_solvers`.

    Returns
    -------
    list of str
        A line for each solver, kind of scene and quantity.
    """
    table = by_quantity(numbers)
    return [
        f"{row['solver']}: {row['quantity']} of {row['kind']}: {row['looks like']}"
        for row in table.to_dict("records")
        if row["looks like"]
    ]


def _pattern(rows: pd.DataFrame, same: pd.DataFrame) -> str:
    """How all answers to a quantity are off alike; empty if they are not.

    `same` has all answers of the solver to scenes of the kind.
    """
    value = rows["value"].to_numpy(float)
    answer = rows["answer"].to_numpy(float)
    if len(np.unique(value)) < ALIKE_FROM:
        return ""
    other = _exchanged(rows, same)
    if other:
        return f"the expected {other}: exchanged columns?"
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = answer / value
        factor = float(np.median(ratio))
        is_factor = np.isfinite(factor) and np.ptp(ratio) <= ALIKE * abs(factor)
        apart = answer - value
        shift = float(np.median(apart))
        is_shift = np.isfinite(shift) and np.ptp(apart) <= ALIKE * abs(shift)
    if is_factor:
        power = math.log10(factor) if factor > 0 else math.nan
        is_unit = abs(power - round(power)) < ALIKE if power == power else False
        return f"a constant factor, {factor:.4g}{': unit?' if is_unit else ''}"
    if is_shift:
        return f"a shift, {shift:+.4g}"
    return ""


def _exchanged(rows: pd.DataFrame, same: pd.DataFrame) -> str:
    """The other quantity whose expected values the answers are; empty if none is."""
    asked = rows.set_index(["scene", "at"])["answer"]
    for quantity, others in same.groupby("quantity", sort=False):
        if quantity == rows["quantity"].iloc[0]:
            continue
        value = others.set_index(["scene", "at"])["value"]
        both = asked.index.intersection(value.index)
        if len(both) < len(asked):
            continue
        is_it = np.isclose(asked[both], value[both], rtol=OTHER, atol=0)
        if is_it.all():
            return str(quantity)
    return ""


def summary(verdicts: pd.DataFrame) -> pd.DataFrame:
    """Sum up the verdicts.

    Parameters
    ----------
    verdicts
        The verdicts of `judge_solvers`.

    Returns
    -------
    DataFrame
        A row for each level and kind that was asked, and each solver; errors in per
        cent.
    """
    groups = verdicts.groupby(["level", "kind", "solver"], sort=False)
    columns = {
        "scenes": groups["scene"].size(),
        "passed": groups["passed"].sum(),
        "failed": groups["failed"].sum(),
        "declined": groups["declined"].sum(),
        "not run": groups["not_run"].sum(),
        "error, %": 100 * groups["error"].median(),
        "bias, %": 100 * groups["bias"].median(),
        "largest, %": 100 * groups["worst"].max(),
        "time over ours": groups["ratio"].median(),
        "CPU over ours": groups["cpu_ratio"].median(),
        "peak, MiB": groups["peak_mib"].max(),
    }
    return pd.DataFrame(columns).reset_index()


def in_words(verdicts: pd.DataFrame) -> list[str]:
    """Sum up the verdicts in words.

    Parameters
    ----------
    verdicts
        The verdicts of `judge_solvers`.

    Returns
    -------
    list of str
        A line for each solver: PASSED or FAILED, its name, and the numbers of its
        scenes.
    """
    lines = []
    for solver, scenes in verdicts.groupby("solver", sort=False):
        passed, failed, declined = scenes[["passed", "failed", "declined"]].sum()
        word = "FAILED" if failed else "PASSED"
        counts = f"{passed} passed, {failed} failed, {declined} declined"
        if scenes["not_run"].any():
            counts += f", {scenes['not_run'].sum()} not run"
        lines.append(f"{word} {solver}: of {len(scenes)} scenes {counts}")
    return lines
