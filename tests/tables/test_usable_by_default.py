"""The table of answers that are usable by default is what its tool makes, on a part of it."""

import runpy
from pathlib import Path

import pandas as pd
import pytest

ROOT = Path(__file__).parents[2]
TOOL = runpy.run_path(str(ROOT / "tools" / "usable.py"))


def _check(made: pd.DataFrame) -> None:
    """See that rows are those of the stored table, which has four digits."""
    stored = pd.read_csv(TOOL["FILE"])
    assert list(made) == list(stored)
    keys = ["bed", "fluid", "d_m"]
    there = made[keys].merge(stored, on=keys, how="left")
    assert len(there) == len(made) > 0
    numbers = ["shields", "ustar0_m_s"]
    assert there[numbers].to_numpy() == pytest.approx(
        made[numbers].to_numpy(), rel=1e-3
    )
    for name in ("decides", "usable", "reason", "why_not"):
        stored_words, words = (
            table[name].astype(object).fillna("").tolist() for table in (there, made)
        )
        assert words == stored_words


def test_every_bed_fluid_and_size_has_a_row() -> None:
    stored = pd.read_csv(TOOL["FILE"])
    places = set(stored[["bed", "fluid", "d_m"]].itertuples(index=False, name=None))
    asked = {
        (bed, fluid, d)
        for bed in TOOL["BEDS"]
        for fluid in TOOL["FLUIDS"]
        for d in TOOL["SIZES"]
    }
    assert places == asked
    assert len(stored) == len(asked)
    assert (stored["reason"].isna() == stored["usable"]).all()


def test_level_beds_of_the_stored_table_are_made_anew(tmp_path: Path) -> None:
    _check(TOOL["main"](tmp_path, ["level"], [TOOL["SIZES"][4], TOOL["SIZES"][8]]))


@pytest.mark.long
def test_forms_of_the_stored_table_are_made_anew(tmp_path: Path) -> None:
    _check(TOOL["main"](tmp_path, ["pile", "dune"], [TOOL["SIZES"][7]]))
