"""The example of a bed that feeds itself."""

import shutil
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples" / "flux"


@pytest.mark.skipif(shutil.which("liggghts") is None, reason="liggghts is not installed")
def test_a_bed_feeds_itself_above_its_threshold_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(FOLDER))
    import measure  # type: ignore[import-not-found]

    rest, swept = measure.flux(tmp_path, 1, (0.003, 0.1), hold=10.0, length=20)
    assert abs(rest) < measure.CRITERION
    assert swept > 100 * measure.CRITERION
