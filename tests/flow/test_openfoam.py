"""What OpenFOAM's programs say of themselves, and how a run's end is read from the logs."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator.errors import SolverError
from orchestrator.solvers import openfoam

HEADER = (
    "trapFpe: Floating point exception trapping enabled (FOAM_SIGFPE).\nCreate time\n"
)
STEP = """
Time = {time}

smoothSolver:  Solving for Ux, Initial residual = {residual}, Final residual = 1e-9, No Iterations 4
ExecutionTime = 0.1 s  ClockTime = 0 s
"""
FATAL = """
--> FOAM FATAL IO ERROR:
Unknown patchField type nosuch for patch type wall

file: /proc/self/cwd/0/U.boundaryField.bed from line 27 to line 28.
"""


def steps(*residuals: float) -> str:
    return "".join(STEP.format(time=i + 1, residual=r) for i, r in enumerate(residuals))


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("", "was stopped before its end; its log breaks off after its header"),
        (
            steps(1.0, 0.5),
            "was stopped before its end; its log breaks off after iteration 2",
        ),
        (
            FATAL,
            "simpleFoam stopped: Unknown patchField type nosuch for patch type wall",
        ),
        (
            steps(1.0) + "#1  Foam::sigFpe::sigHandler",
            "floating point exception after iteration 1",
        ),
        (
            steps(1.0, float("nan")) + FATAL,
            "diverged: the residuals are not numbers: .*nan",
        ),
        (
            steps(1.0) + "#1  Foam::sigSegv::sigHandler(int) at ??:?",
            "segmentation fault",
        ),
        (
            steps(*0.9 ** np.arange(100)) + "\nEnd\n",
            r"residual of Ux is \S+ after iteration 100",
        ),
        ("\nEnd\n", "did not converge"),
    ],
)
def test_a_run_that_did_not_end_well(tmp_path: Path, text: str, cause: str) -> None:
    with pytest.raises(SolverError, match="simpleFoam has not run"):
        openfoam.check_log(tmp_path)
    (tmp_path / "log.simpleFoam").write_text(HEADER + text)
    with pytest.raises(SolverError, match=cause) as raised:
        openfoam.check_log(tmp_path)
    assert raised.value.where == str(tmp_path)
    assert raised.value.remedy


@pytest.mark.parametrize(
    ("stated", "cause"),
    [
        (
            "Using: OpenFOAM-v1812 (see www.OpenFOAM.com)",
            "OpenFOAM 1812 is older than 1912",
        ),
        (
            "Using: OpenFOAM-10 (see https://openfoam.org)",
            "is not a known OpenFOAM: .*-10",
        ),
        ("foo", "is not a known OpenFOAM: it ended with 0 and printed “foo”"),
        ("Using: OpenFOAM-v2312 (2312) - visit www.openfoam.com", None),
    ],
)
def test_versions_that_are_refused_or_not_known_to_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stated: str, cause: str | None
) -> None:
    (tmp_path / openfoam.PROGRAM).write_text(f"#!/bin/sh\necho '{stated}'\n")
    (tmp_path / openfoam.PROGRAM).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    if cause is None:
        with pytest.warns(UserWarning, match="2312 has not been tried, 1912 has"):
            assert openfoam.version.__wrapped__() == "2312"
        return
    with pytest.raises(SolverError, match=cause) as raised:
        openfoam.version.__wrapped__()
    assert "`openfoam`" in raised.value.remedy
