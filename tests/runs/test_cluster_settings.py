"""What is said without a table of settings, or without the libraries that ask a queue."""

import os
import subprocess
from pathlib import Path

import pytest

from orchestrator.errors import InputError
from orchestrator.study import study
from tests.faults.bench import ORCHESTRATOR, ROOT

TEXT = """
bed = { slope_deg = 0.0 }
cluster = { cores = 2, memory = "1GB" }
axes = { "grain.diameter" = [1e-3] }
"""


def test_the_settings_are_kept_as_they_are_and_change_no_scene() -> None:
    lines = TEXT.splitlines()
    asked = study.parse(TEXT, name="x", where="x.toml")
    without = study.parse("\n".join([*lines[:2], lines[3]]), name="x", where="x.toml")
    assert (asked.cluster, without.cluster) == ({"cores": 2, "memory": "1GB"}, {})
    assert [scene.id for scene in without.scenes] == [scene.id for scene in asked.scenes]
    with pytest.raises(InputError, match=r"x.toml: cluster: 2 is not a table \(write \[cluster\]"):
        study.parse(TEXT.replace('{ cores = 2, memory = "1GB" }', "2"), name="x", where="x.toml")


def test_without_the_extra_one_line_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text(TEXT)
    # stands before any that is installed
    missing = "raise ModuleNotFoundError('none', name='dask_jobqueue')\n"
    (tmp_path / "dask_jobqueue.py").write_text(missing)
    ended = subprocess.run(
        [*ORCHESTRATOR, "study", "x.toml", "--cluster", "pbs"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT}"},
        capture_output=True,
        text=True,
    )
    assert ended.returncode == 2
    assert len(ended.stderr.splitlines()) == 1
    assert "pip install 'dask-jobqueue>=0.9'" in ended.stderr
