"""A study with a tolerance on the real solvers: cheap answers, and what DEM says against them."""

from pathlib import Path

import pandas as pd
import pytest

from orchestrator import cli, pipeline
from orchestrator.fidelity import measured
from orchestrator.fidelity.fidelities import FIDELITIES, named
from orchestrator.fidelity.measured import Error, Measured
from orchestrator.study import study

PILES = """
tolerance = 0.2
grain = {{ diameter = 1e-3 }}
method.grains = {{ load_increment = 0.03, waiting_time = 6.0, final_fraction = 0.75 }}
forces = {{ law = "high" }}
bed = {{ kind = "pile", height = 0.014, slope_deg = 20.0, roughness = "d/30", packing = "{}" }}
[[group]]
name = "small"
[[group]]
name = "larger"
bed = {{ height = 0.016 }}
"""
BY_HAND = """
[[group]]
name = "asked for by the pivot"
bed = { height = 0.015 }
method.kind = "pivot"
"""


def _run(packing: str, out: Path, more: str = "") -> dict[str, pd.DataFrame]:
    asked = study.parse(PILES.format(packing) + more, name="piles", where="test")
    finished = pipeline.run(asked, out, workers=2)
    assert not finished.failures
    return {path.stem: pd.read_csv(path) for path in (out / "tables").glob("*.csv")}


def test_cheap_answers_are_checked_by_one_pile_by_dem(tmp_path: Path) -> None:
    tables = _run("aligned", tmp_path)
    answers, check = tables["pile_threshold"], tables["check"]
    methods = tables["methods"]
    assert set(methods["method"]) <= {"pivot", "peeling"}
    assert (methods["error_estimate"] <= 0.2).all()
    (why,) = set(methods["why"])
    assert "the cheapest fidelity that is within" in why
    # the smaller of the two piles stands for both
    assert check["scene_id"].nunique() == 1
    assert len(list((tmp_path / "cases").glob("pile-*"))) == 1
    assert check["agree"].all()
    # the intervals contain the numerical error, as a factor both ways
    value, factor = answers["shields"], 1 + answers["numerical_error"] - 1e-8
    assert (answers["shields_numerical_high"] >= value * factor).all()
    assert (answers["shields_numerical_low"] <= value / factor).all()


def test_an_answer_that_its_check_contradicts_is_not_usable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # quick by pivots, and data that call them good for level rows, which they are not
    monkeypatch.setitem(named("quick").grains.on, "horizontal", {})
    wrong = {
        (part, one.name, like): Measured((0.1, 0.7), 2 * (Error(0.01, 0.0),))
        for part, like in (("flow", "wall"), ("grains", "horizontal"))
        for one in FIDELITIES
    }
    monkeypatch.setattr(measured, "errors", lambda: wrong)
    tables = _run("horizontal", tmp_path, BY_HAND)
    groups = tables["scenes"][["scene_id", "group"]]
    answers = tables["pile_threshold"].merge(groups)
    check = tables["check"]
    small = answers[answers["group"] == "small"]
    # the smaller of the two piles is checked, and every pile keeps its answer
    assert set(check["scene_id"]) == set(small["scene_id"])
    assert set(tables["methods"]["method"]) == {"pivot"}
    beyond = check["shields_numerical_high"] < check["shields_dem_low"]
    assert beyond.any()
    assert (check["agree"] != beyond).all()
    contradicted = small["why_not"].str.contains("DEM of this bed contradicts it")
    assert contradicted.tolist() == beyond.tolist()
    assert not small["usable"][contradicted].any()
    worst = check[beyond].iloc[0]
    (said,) = small[small["fraction"] == worst["fraction"]]["why_not"]
    for name in ("shields", "shields_dem"):
        assert f"{worst[name]:.3g} (" in said
    others = answers[answers["group"] != "small"]
    assert not others["why_not"].fillna("").str.contains("contradicts").any()


def test_a_run_on_chosen_levels_that_fails_names_the_next_step(tmp_path: Path) -> None:
    """No solver ends within a hundredth of a second; nothing else is run in its place."""
    text = """
        time_limit = 0.01
        grain = { diameter = 1e-3 }
        bed = { kind = "pile", slope_deg = 15.0, height = 0.01 }
    """
    for method, is_advised in (("auto", True), ("dem", False)):
        asked = study.parse(
            f'{text}method.kind = "{method}"', name="slow", where="slow"
        )
        finished = pipeline.run(asked, tmp_path / method, workers=1)
        (flow,) = (name for name in finished.failures if name.startswith("flow-"))
        said = str(finished.failures[flow])
        assert ("did not end within 0.01 s" in said, "time_limit" in said) == (
            True,
            True,
        )
        assert ('method.kind = "dem"' in said) == is_advised
        assert len(list((tmp_path / method / "cases").glob("flow-*"))) == 1


def test_gusts_have_no_known_numerical_error(tmp_path: Path) -> None:
    text = """
        grain = { diameter = 1e-3 }
        flow.gusts = { intensity = 0.4, events = 100 }
        [[group]]
        [[group]]
        bed = { kind = "pile", slope_deg = 15.0, height = 0.01 }
        flow = { gusts = { intensity = 0.4, events = 100 } }
        method.flow.model = "waves"
        method.kind = "pivot"
    """
    asked = study.parse(text, name="gusts", where="gusts")
    pipeline.run(asked, tmp_path, workers=1)
    for name in ("single_grain", "pile_threshold"):
        rows = pd.read_csv(tmp_path / "tables" / f"{name}.csv")
        assert not rows["usable"].any()
        assert (
            rows["why_not"]
            .str.contains("error .* (?:is not known|was not measured)")
            .all()
        )
        if name == "pile_threshold":
            assert (
                rows[["shields_numerical_low", "shields_numerical_high"]]
                .isna()
                .all(axis=None)
            )


def test_a_tolerance_of_the_command_line_is_kept_for_the_next_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = 'grain = { diameter = 1e-3 }\nbed = { kind = "grain", slope_deg = 10.0 }\n'
    (tmp_path / "one.toml").write_text(text)
    out = tmp_path / "out"
    command = [
        "study",
        str(tmp_path / "one.toml"),
        "--out",
        str(out),
        "--tolerance",
        "0.1",
    ]
    assert cli.main(command) == 0
    assert not list((out / "cases").glob("cells-*"))
    assert cli.main(["report", str(out)]) == 0
    table = pd.read_csv(out / "tables" / "methods.csv")
    assert set(table["method"]) == {"pivot"}


def test_a_tolerance_out_of_range_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for value in ("1", "-0.1", "nan"):
        assert cli.main(["study", "first-look", "--tolerance", value]) == 2
        assert "tolerance: " in capsys.readouterr().err


def test_a_tolerance_of_zero_is_refused_with_what_to_write(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It once meant the opposite of none: every scene by DEM."""
    file = tmp_path / "one.toml"
    file.write_text("tolerance = 0\ngrain = { diameter = 1e-3 }\n")
    for command in (["study", str(file)], ["study", "first-look", "--tolerance", "0"]):
        assert cli.main(command) == 2
        said = capsys.readouterr().err
        assert "tolerance: " in said
        assert 'method.kind = "dem"' in said
