"""Erosion of stockpiles: the rules of AP-42 by hand, a flat bed, and the preset as it is run."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.errors import InputError
from orchestrator.experiments import erosion
from orchestrator.study import study

WINDS = "erosion = { fastest_mile = [10.0, 20.0], threshold = 0.6 }"
PILE = 'bed.kind = "triangle"\nbed.slope_deg = 30.0\n'


def test_the_classes_of_ap42_and_its_potential_by_hand() -> None:
    assert erosion.AREAS.groupby("pile")["share"].sum().tolist() == [100] * 4
    parts = erosion.AREAS["sub_areas"].str.split(" + ", regex=False)
    assert [sum(map(int, filter(None, p))) for p in parts] == erosion.AREAS["share"].tolist()
    # u* in a wind of 20 m/s is 0.4, 1.2, 1.8 m/s; 36, 50 and 14 % of the area of pile B1
    by_epa = erosion.Surface("", "", pd.DataFrame(), 0.0, threshold=1.12).by_epa()
    hand = 0.5 * (58 * 0.08**2 + 25 * 0.08) + 0.14 * (58 * 0.68**2 + 25 * 0.68)
    assert by_epa[1].potential([20.0, 10.0]) == pytest.approx([hand, 0.0])
    assert by_epa[2].faces["ratio"].tolist() == pytest.approx([0.39, 1.17, 1.75, 2.14], abs=0.005)


def test_a_flat_bed_loses_what_the_log_law_takes(tmp_path: Path) -> None:
    text = 'flow.roughness = 0.005\nbed.kind = "flat"\ngrain.diameter = 1e-3\n' + WINDS
    erosion.experiment(study.parse(text, name="", where=""), tmp_path).run(tmp_path, workers=1)
    table = pd.read_csv(tmp_path / "tables/erosion.csv")
    assert (table["u*/u*₀"] == 1).all()
    ustar = np.array([0.41 * 20 / np.log(2001), 0.053 * 20])  # 10 m/s is below the threshold
    assert table["P, g/m²"].unique() == pytest.approx(58 * (ustar - 0.6) ** 2 + 25 * (ustar - 0.6))


def test_the_preset_is_run(tmp_path: Path) -> None:
    ended = erosion.experiment(study.load("stockpile"), tmp_path).run(tmp_path, workers=2)
    table = pd.read_csv(tmp_path / "tables/erosion.csv")
    flat_top, fenced, ridge, behind, *by_epa = table[table["part"] == "all"]["P, g/m²"]
    assert max(fenced / flat_top, behind / ridge) < 0.7
    assert min(by_epa) < flat_top < max(by_epa)
    assert f"{flat_top:.3g} g/m²" in ended.answer.split("\n")[0] in ended.page.read_text()


def test_what_is_wrong_is_said_in_one_message(tmp_path: Path) -> None:
    for asked, words in (
        ('erosion.threshold = "coal"', "one of: overburden"),
        ("erosion.threshold = 112.0", "m/s"),
        ("erosion.thresold = 1.0", "did you mean threshold"),
        ('bed.kind = "grain"', "there is no pile"),
    ):
        text = "grain.diameter = 1e-3\n" + PILE * ("erosion" in asked) + asked
        with pytest.raises(InputError, match=words):
            erosion.experiment(study.parse(text, name="a", where="a"), tmp_path)
