"""What the smoothing of a noisy profile is worth: said, computed, and planned for."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator import plan
from orchestrator.report import words
from orchestrator.study import study
from tests import small_study
from tests.study.test_noise import X, dune

NOISE = 0.015 * np.random.default_rng(4).standard_normal(len(X))
STUDY = """
grain = {{ diameter = 2.5e-4, density = 2650.0 }}
fluid = {{ kind = "air" }}
method.flow.model = "{model}"
bed = {{ kind = "pile", profile = "scan.csv", smoothing = {smoothing} }}
[profiles]
"scan.csv" = '''x_m,z_m
{rows}'''
"""


def text(smoothing: float = 0.0, *, model: str = "waves", noise: float = 1.0) -> str:
    pairs = zip(X.tolist(), (dune(X) + noise * NOISE).tolist(), strict=True)
    rows = "\n".join(f"{x:.3f},{z:.5f}" for x, z in pairs)
    return STUDY.format(model=model, smoothing=smoothing, rows=rows)


def test_half_and_twice_the_smoothing_are_those_of_their_own_studies(
    tmp_path: Path,
) -> None:
    """Of the smoothing that is needed where less is used, else of the one that is used."""
    columns = {
        0.5: "first_half_smoothing_m_s",
        1.0: "first_smoothing_m_s",
        2.0: "first_twice_smoothing_m_s",
    }
    for used, compared in ((0.0, 0.8), (0.4, 0.8), (2.0, 2.0)):
        results = small_study.run(tmp_path / f"{used}", text(used))
        row = results.tables["pile_threshold"].iloc[0]
        said = words.answer_text(results)
        said = " ".join(said.split())
        assert row["smoothing_needed_m"] == pytest.approx(0.8, abs=0.02)
        assert row["smoothing_compared_m"] == pytest.approx(compared, abs=0.02)
        is_noisy = used < row["smoothing_needed_m"]
        assert ("the profile is noise" in row["why_not"]) == is_noisy
        assert ("are noisy at the scale of the mesh" in said) == is_noisy
        for factor, column in columns.items():
            length = factor * row["smoothing_compared_m"]
            other = small_study.run(tmp_path / f"{length}", text(length))
            expected = other.tables["pile_threshold"].iloc[0]["first_ustar0_m_s"]
            assert row[column] == pytest.approx(expected, rel=1e-6)
            if factor != 1 or is_noisy:
                assert f"{expected:#.3g} m/s" in said


def test_a_profile_without_noise_is_compared_with_nothing(tmp_path: Path) -> None:
    results = small_study.run(tmp_path, text(noise=0.0))
    assert "smoothing_needed_m" not in results.tables["pile_threshold"]
    assert "smooth" not in words.answer_text(results)


def test_the_flows_of_other_smoothing_are_planned(tmp_path: Path) -> None:
    for smoothing, flows in ((0.0, 4), (2.0, 3)):
        asked = study.parse(text(smoothing, model="solve"), name="scan", where="scan")
        assert len(plan.make(asked).cases) == flows
        lines = "\n".join(plan.forecast(asked, tmp_path, 2))
        assert "1 noisy profile: also with half and twice the smoothing" in lines
    quiet = study.parse(text(model="solve", noise=0.0), name="scan", where="scan")
    assert len(plan.make(quiet).cases) == 1
