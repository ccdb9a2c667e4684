"""A study by the errors that a ladder of the user measured, and what is refused."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import __version__, cli, pipeline, plan
from orchestrator.errors import InputError
from orchestrator.fidelity import measured
from orchestrator.fidelity.domain import unmeasured
from orchestrator.runs.workspace import Workspace
from orchestrator.study import study
from orchestrator.study.own_errors import own_errors
from orchestrator.study.study import Study

TEXT = """
bed = { kind = "pile", height = 0.02, roughness = "d/30" }
grain = { diameter = 1e-3 }
axes = { "bed.slope_deg" = [15.0, 20.0] }
"""


@pytest.fixture(autouse=True)
def _package() -> Iterator[None]:
    """The errors of the package are those of all other tests."""
    yield
    measured.use(measured.FOLDER)


@pytest.fixture
def ladder(tmp_path: Path) -> Path:
    """A ladder whose errors are those of the package, on three scenes each."""
    root = tmp_path / "mine"
    shutil.copytree(measured.FOLDER, root / "tables")
    marker = {"kind": "experiment", "name": "ladder", "orchestrator": __version__}
    (root / "study.json").write_text(json.dumps(marker))
    path = root / "tables" / "errors.csv"
    table = pd.read_csv(path)
    few = table.assign(scenes=3, uncertainty_scenes=3, confidence=0.75)
    few.assign(error=0.011, uncertainty=0.0).to_csv(path, index=False)
    return root


def _study(text: str = TEXT) -> Study:
    return study.parse(text, name="one", where="one.toml")


def test_errors_of_few_own_scenes_are_taken_and_noted(ladder: Path) -> None:
    own = own_errors(ladder)
    asked = _study().with_errors(own)
    (first, _) = plan.make(asked).decisions.values()
    assert first.error_estimate == pytest.approx(0.011 * 2**0.5)
    assert first.why.endswith(f"numerical errors of mine (sha256 {own.sha256[:12]})")
    # without them those of the package hold again
    (package, _) = plan.make(_study()).decisions.values()
    assert package.error_estimate != first.error_estimate
    assert "sha256" not in package.why


def test_a_scene_outside_of_the_own_domain_is_refused(ladder: Path) -> None:
    text = TEXT.replace("15.0", "5.0")
    with pytest.raises(InputError, match=r"no error for bed\.slope_deg") as caught:
        plan.make(_study(text).with_errors(own_errors(ladder)))
    assert caught.value.where == "one.toml"
    # the package's leave such a scene without an error
    decision, _ = plan.make(_study(text)).decisions.values()
    assert unmeasured(decision.scene)
    assert decision.error_estimate is None


@pytest.mark.parametrize(
    ("marker", "lost", "what"),
    [
        ({"kind": "study"}, "", "holds no ladder"),
        ({"name": "budget"}, "", "holds no ladder"),
        ({"orchestrator": "0.0.1"}, "", "version 0.0.1, this is"),
        ({}, "domain.csv", "not finished: there is no tables/domain.csv"),
        ({}, "study.json", "holds no ladder"),
    ],
)
def test_a_directory_of_anything_else_is_refused(
    marker: dict[str, str],
    lost: str,
    what: str,
    ladder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = ladder / "study.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **marker}))
    for found in ladder.rglob(lost or "nothing"):
        found.unlink()
    (tmp_path / "one.toml").write_text(TEXT)
    asked = ["study", str(tmp_path / "one.toml"), "--errors", str(ladder)]
    assert cli.main([*asked, "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert what in line
    assert f"--errors {ladder}" in line
    assert not (tmp_path / "out").exists()


def test_beds_in_three_dimensions_have_no_such_errors(
    ladder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["study", "cone", "--plan", "--errors", str(ladder)]) == 2
    assert "beds in a plane" in capsys.readouterr().err


def test_a_finished_study_is_one_of_the_same_errors(
    ladder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "one.toml"
    asked = ["study", str(file), "--out", str(tmp_path / "out"), "--workers", "1"]
    by_own = [*asked, "--errors", str(ladder)]
    text = TEXT.replace('kind = "pile", height = 0.02', 'kind = "grain"')
    file.write_text(text + 'method.kind = "pivot"\n')
    assert cli.main(by_own) == 0
    capsys.readouterr()
    assert cli.main(by_own) == 0
    assert "it was answered already" in capsys.readouterr().err
    assert cli.main(asked) == 0
    assert "it was answered already" not in capsys.readouterr().err
    assert cli.main(by_own) == 0
    # what was drawn by some errors is drawn by no others
    path = ladder / "tables" / "errors.csv"
    path.write_text(path.read_text() + "\n")
    with pytest.raises(InputError, match="not those by which the study was answered"):
        pipeline.reopen(Workspace(tmp_path / "out"))
