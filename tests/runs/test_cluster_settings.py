"""What is said where there is no queue, nor what is needed to ask one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from orchestrator.errors import InputError
from orchestrator.study import study

TEXT = """
bed = { slope_deg = 0.0 }
cluster = { cores = 2, memory = "1GB" }
axes = { "grain.diameter" = [1e-3] }
"""


def test_the_settings_are_kept_as_they_are_and_change_no_scene() -> None:
    found = study.parse(TEXT, name="x", where="x.toml")
    assert found.cluster == {"cores": 2, "memory": "1GB"}
    without = study.parse(
        TEXT.replace("cluster", "grain", 1).replace(
            'cores = 2, memory = "1GB"', "density = 2500.0"
        ),
        name="x",
        where="x.toml",
    )
    assert without.cluster == {}
    assert [scene.id for scene in without.scenes] == [scene.id for scene in found.scenes]


def test_settings_that_are_no_table() -> None:
    text = TEXT.replace('{ cores = 2, memory = "1GB" }', "2")
    with pytest.raises(InputError, match=r"x.toml: cluster: 2 is not a table \(write \[cluster\]"):
        study.parse(text, name="x", where="x.toml")


def test_without_the_extra_one_line_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text(TEXT)
    # stands before any that is installed
    (tmp_path / "dask_jobqueue.py").write_text(
        "raise ModuleNotFoundError('none', name='dask_jobqueue')\n"
    )
    root = Path(__file__).parents[2]
    ended = subprocess.run(
        [sys.executable, "-m", "orchestrator", "study", "x.toml", "--cluster", "pbs"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{root}"},
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert ended.returncode == 2
    assert len(ended.stderr.splitlines()) == 1
    assert "dask_jobqueue" in ended.stderr
    assert "pip install 'dask-jobqueue>=0.9'" in ended.stderr
