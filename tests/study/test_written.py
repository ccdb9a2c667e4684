"""Studies of dictionaries are those of the files that say the same."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import orchestrator
from orchestrator.errors import InputError
from orchestrator.study.study import load, of_dictionary
from orchestrator.study.written import toml_of

TABLES: dict[str, Any] = {
    "title": 'A "sand" \\ of 1 mm ü',
    "tolerance": 0.1,
    "fluid": {"kind": "water", "temperature_deg_c": 12.5},
    "grain": {"density": 2650.0},
    "axes": {"grain.diameter": [1e-3, 2e-3], "bed.slope_deg": [0.0, 10.0]},
}


def test_the_text_of_a_dictionary_says_what_it_says() -> None:
    more = {
        **TABLES,
        "units_confirmed": True,
        "group": [{"name": "a", "bed": {"obstacles": [{"kind": "fence", "x": 1}]}}, {}],
    }
    assert tomllib.loads(toml_of(more, "d")) == more


def test_numbers_of_numpy_and_pandas_are_those_of_python() -> None:
    given = {
        "grain": {"diameter": np.float64(1e-3), "density": np.int64(2650)},
        "axes": {"a": np.array([0.1, 1e-7]), "b": pd.Series([1, 2], index=[5, 6])},
        "bed": {"profile": Path("a/b.csv"), "slope_deg": None},
    }
    assert tomllib.loads(toml_of(given, "d")) == {
        "grain": {"diameter": 1e-3, "density": 2650},
        "axes": {"a": [0.1, 1e-7], "b": [1, 2]},
        "bed": {"profile": "a/b.csv"},
    }


def test_a_dictionary_is_the_study_of_its_file(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text(toml_of(TABLES, "d"), encoding="utf-8")
    of_file = load(file)
    of_tables = of_dictionary(TABLES, "study")
    assert [one.id for one in of_tables.scenes] == [one.id for one in of_file.scenes]
    assert of_tables.title == of_file.title
    assert of_dictionary(TABLES, "study", 0.3).tolerance == 0.3


def test_a_study_of_a_dictionary_runs_and_opens_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    study = orchestrator.run(TABLES)
    assert study.directory == tmp_path / "results" / "study"
    rows = study.thresholds
    assert sorted(zip(rows["d_m"], rows["alpha_deg"], strict=True)) == [
        (1e-3, 0.0),
        (1e-3, 10.0),
        (2e-3, 0.0),
        (2e-3, 10.0),
    ]
    again = orchestrator.open(study.directory)
    pd.testing.assert_frame_equal(again.thresholds, rows)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"grain": {"diametre": 1e-3}}, "grain.diametre"),
        ({"grain": 3.0}, "grain"),
        ({"grain": {"diameter": 1j}}, "the dictionary: grain.diameter: 1j is no value"),
        ({1: {}}, "the dictionary: 1 is no key"),
        ({"group": [3]}, "the dictionary: group[0]: 3 is no dictionary"),
        ({"grain": {"diameter": float("nan")}}, "grain.diameter"),
    ],
)
def test_what_is_no_study_is_refused_with_its_field(given: Any, said: str) -> None:
    with pytest.raises(InputError) as refused:
        of_dictionary(given, "study")
    assert said in str(refused.value)
