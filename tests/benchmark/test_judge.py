"""Any answer is judged: a verdict that follows from the numbers, tables and a page."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from orchestrator.benchmark import compare, judge, pack
from orchestrator.benchmark.compare import Options
from orchestrator.benchmark.pack import Pack

NAMES = ("1-grain", "2-grain", "2-incline-20", "3-flow", "4-pile", "5-pile")
"""One scene of each level, and of two forms."""
LARGEST = float(np.finfo(float).max)
EXTREMES = (1e308, -1e308, LARGEST, -LARGEST, 5e-324, -5e-324, 0.0, -0.0)


def _results(
    chosen: Pack, place: Path, answers: Mapping[str, str], used: Any = None
) -> Path:
    """A directory of answers, as another program leaves them."""
    for name, text in answers.items():
        folder = place / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "answer.csv").write_text(text)
        if used is not None:
            (folder / "used.json").write_text(json.dumps(used))
    return place


def test_a_scene_is_declined_by_an_exit_code_and_not_by_words(
    all_levels: Path, tmp_path: Path
) -> None:
    """A solver may print what it likes; a message alone declines nothing."""
    chosen = pack.read_pack(all_levels)
    right, first, second = NAMES[:3]
    place = _results(chosen, tmp_path, {right: _text(chosen, right, {})})
    for name, code in ((first, 2), (second, 1)):
        (place / name).mkdir()
        used = {"error": "it ended with 2: unknown kind", "exit_code": code}
        (place / name / "used.json").write_text(json.dumps(used))
    _, verdicts = judge.judge_solvers(chosen, NAMES[:3], [place])
    theirs = verdicts[verdicts["solver"] != judge.OURS].set_index("scene")
    assert theirs["declined"].to_dict() == {right: False, first: True, second: False}
    assert theirs["failed"].to_dict() == {right: False, first: False, second: True}


def _text(chosen: Pack, name: str, changed: Mapping[int, str]) -> str:
    """The expected answer to a scene as a file, with other texts for some of its values."""
    expected = chosen.expected[chosen.expected["scene"] == name]
    lines = ["quantity,at,value"]
    rows = zip(expected["quantity"], expected["at"], expected["value"], strict=True)
    for number, (quantity, at, value) in enumerate(rows):
        lines.append(f"{quantity},{at},{changed.get(number, repr(value))}")
    return "\n".join([*lines, ""])


def _is_right(chosen: Pack, name: str, text: str) -> bool:
    """Whether a file answers a scene within the tolerances, by the rule of the contract."""
    given = dict(line.rsplit(",", 1) for line in text.splitlines()[1:])
    counts: dict[str, float] = {}
    expected = chosen.expected[chosen.expected["scene"] == name]
    for row in expected.to_dict("records"):
        value = float(given[f"{row['quantity']},{row['at']}"])
        counts[row["quantity"]] = value
        if pd.isna(row["tolerance"]):
            continue
        margin = (row["tolerance"] + 1e-8) * abs(row["value"])
        if not row["low"] - margin <= value <= row["high"] + margin:
            return False
    if "not_moved" in counts:
        total = counts.get("count", chosen.scenes[name].get("count"))
        return counts["moved"] + counts["not_moved"] == total
    return True


def _check(chosen: Pack, numbers: pd.DataFrame, verdicts: pd.DataFrame) -> None:
    """See that verdicts, errors and summary say the same."""
    theirs = verdicts[verdicts["solver"] != judge.OURS]
    states = theirs[["passed", "failed", "declined"]].sum(axis=1)
    assert states.eq(1).all()
    assert theirs["message"].eq("").equals(theirs["passed"])
    errors = numbers.loc[numbers["answer"].notna(), "error"]
    assert np.isfinite(errors).all()
    answered = theirs[theirs["answered"]]
    scores = answered[["error", "worst", "bias"]].dropna(how="all")
    assert np.isfinite(scores).all(axis=None)
    assert (scores["worst"] >= scores["error"]).all()
    assert (scores["bias"].abs() <= scores["worst"]).all()
    table = judge.summary(theirs)
    for state in ("passed", "failed", "declined"):
        assert table[state].sum() == theirs[state].sum()
    for column in ("error, %", "bias, %", "largest, %"):
        assert np.isfinite(table[column].dropna()).all()
    assert len(judge.failures(theirs)) <= theirs["failed"].sum()
    (line,) = judge.in_words(theirs)
    assert line.startswith("FAILED") == bool(theirs["failed"].any())


@pytest.mark.parametrize("value", [1e308, LARGEST, 5e-324, 0.0])
def test_any_double_is_judged_and_drawn(
    all_levels: Path, tmp_path: Path, value: float
) -> None:
    """Answers far beyond the numbers of the model fail; tables, charts and page are written."""
    chosen = pack.read_pack(all_levels)
    texts = {}
    for name in NAMES:
        quantities = chosen.expected.loc[
            chosen.expected["scene"] == name, "quantity"
        ].tolist()
        changed = {}
        sign = 1.0
        for number, quantity in enumerate(quantities):
            # the last counts make N: else the answer is called incomplete, and is not drawn
            is_last = quantity not in quantities[number + 1 :]
            if not (is_last and quantity in ("moved", "not_moved", "count")):
                changed[number] = repr(sign * value)
                # signs in turn: errors of both signs have a median, too
                sign = -sign
        texts[name] = _text(chosen, name, changed)
    used = {"seconds": abs(value), "cpu_s": abs(value), "peak_mib": value}
    results = _results(chosen, tmp_path / "extreme", texts, used)
    outcome = compare.compare(
        all_levels, [results], tmp_path / "page", Options((), NAMES)
    )
    assert (
        "FAILED extreme: of 6 scenes 0 passed, 6 failed, 0 declined" in outcome.summary
    )
    numbers = pd.read_csv(tmp_path / "page" / "comparison.csv", dtype={"at": str})
    assert len(numbers) == chosen.expected["scene"].isin(NAMES).sum()
    assert numbers["answer"].abs().eq(float(f"{abs(value):.9g}")).sum() > 0.8 * len(
        numbers
    )
    assert np.isfinite(numbers["error"]).all()
    assert {path.name for path in (tmp_path / "page" / "figures").glob("*.png")} >= {
        *("moved.png", "moved-line.png", "shields.png", "stress.png"),
    }
    # what was written is read again: the same page from the same results
    again = compare.compare(
        all_levels, [results], tmp_path / "page", Options((), NAMES)
    )
    assert again.failures == outcome.failures


VALUES = st.one_of(
    st.sampled_from([repr(value) for value in EXTREMES]),
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.floats(0.9, 1.1).map(repr),
    st.integers(-5, 60).map(str),
)
"""Texts of finite numbers."""
TEXTS = st.one_of(
    st.text(max_size=60),
    st.sampled_from(
        ["nan", "1_0", "\u0661", "1e999", "-inf", "0x10", "1,2", "", " 1 "]
    ),
)
"""Texts of any kind in the place of a number."""
JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=8) | st.integers(),
    lambda inner: (
        st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=3), inner)
    ),
    max_leaves=4,
)
USED = st.fixed_dictionaries(
    {}, optional={"seconds": JSON, "cpu_s": JSON, "peak_mib": JSON | st.just(10**400)}
)
FAST = settings(
    deadline=None,
    max_examples=100,
    suppress_health_check=[
        HealthCheck.function_scoped_fixture,
        HealthCheck.too_slow,
    ],
)


@FAST
@given(data=st.data())
def test_a_verdict_is_that_of_the_numbers(
    all_levels: Path, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Finite numbers in place of the right ones: passed if and only if all lie within."""
    chosen = pack.read_pack(all_levels)
    texts = {}
    for name in NAMES:
        places = st.integers(0, int((chosen.expected["scene"] == name).sum()) - 1)
        changed = data.draw(st.dictionaries(places, VALUES, max_size=3))
        texts[name] = _text(chosen, name, changed)
    place = tmp_path_factory.mktemp("answers") / "any"
    results = _results(chosen, place, texts, data.draw(USED))
    numbers, verdicts = judge.judge_solvers(chosen, NAMES, [results])
    _check(chosen, numbers, verdicts)
    passed = verdicts[verdicts["solver"] == "any"].set_index("scene")["passed"]
    for name, text in texts.items():
        assert passed[name] == _is_right(chosen, name, text), name


@FAST
@given(lines=st.lists(st.tuples(TEXTS, TEXTS, VALUES | TEXTS), max_size=4), used=USED)
def test_any_file_has_a_verdict(
    all_levels: Path, tmp_path_factory: pytest.TempPathFactory, lines: Any, used: Any
) -> None:
    """Files of any text fail by a message on one line."""
    chosen = pack.read_pack(all_levels)
    rows = [",".join(line) for line in lines]
    text = (
        "\n".join(["quantity,at,value", *rows, ""]).encode("utf-8", "replace").decode()
    )
    place = tmp_path_factory.mktemp("answers") / "any"
    results = _results(chosen, place, {"2-incline-20": text}, used)
    numbers, verdicts = judge.judge_solvers(chosen, ["2-incline-20"], [results])
    _check(chosen, numbers, verdicts)
    (message,) = verdicts.loc[verdicts["solver"] == "any", "message"]
    assert message
    assert message.isprintable()


@pytest.mark.parametrize(
    "number", ["1_0", "\u0661", "nan", "inf", "1e999", "0x10", "1d5", "", "1 2", "--1"]
)
def test_what_is_no_number_is_said(
    all_levels: Path, tmp_path: Path, number: str
) -> None:
    """Texts that Python reads as numbers, though no table of a program has them, count no more."""
    chosen = pack.read_pack(all_levels)
    text = f"quantity,at,value\nacceleration_over_g,,{number}\n"
    results = _results(chosen, tmp_path / "any", {"2-incline-20": text})
    _, verdicts = judge.judge_solvers(chosen, ["2-incline-20"], [results])
    assert "line 2, " in verdicts["message"].iloc[0]
    assert (
        "is not a quantity, its at and a finite number" in verdicts["message"].iloc[0]
    )
