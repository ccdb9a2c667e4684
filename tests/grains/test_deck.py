"""What the decks are given: forces of the grains, files that LIGGGHTS reads."""

import contextlib
import os
import subprocess
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.grains.cells import GrainCase
from orchestrator.grains.peeling import ForceTable, Loading
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS, ForceLaw
from tests.grains.test_motion import copied
from tests.waiting import until

WHERE = Grain(diameter=1e-3, roughness=1e-4, fluid_density=1.0, viscosity=1e-5)
TABLE = np.geomspace(5e-5, 5e3, 4001)
ALONG = np.tile([np.cos(0.3), np.sin(0.3)], (2, 1))
OUTWARD = np.tile([-np.sin(0.3), np.cos(0.3)], (2, 1))


@settings(deadline=None)
@given(
    law=st.sampled_from(list(LAWS.values())),
    ratio=st.floats(-2, 2).filter(lambda r: abs(r) > 1e-3),
    ustar0=st.floats(0.05, 2),
    goal=st.floats(0.01, 10),
    arms=st.tuples(st.floats(0.1, 1), st.floats(0, 1)),
)
def test_a_grain_feels_the_closed_forms_force_at_its_own_stress(
    law: ForceLaw, ratio: float, ustar0: float, goal: float, arms: tuple[float, float]
) -> None:
    drag, lift = (partial(f, at=WHERE) for f in (law.drag, law.lift))
    loading = Loading(drag, lift, np.array([ratio, 0.0]), ALONG, OUTWARD)
    local = abs(ratio) * ustar0
    exact = (
        np.sign(ratio) * float(drag(local)) * ALONG[0] + float(lift(local)) * OUTWARD[0]
    )
    np.testing.assert_allclose(loading.at(ustar0), [exact, [0, 0]], rtol=1e-12, atol=0)
    # and the table of forces finds the flow at which a moment is reached
    ustar = ForceTable.of(drag, lift, 1e-5 * np.ones(1), TABLE)[0].reaching(*arms, goal)
    moment = arms[0] * float(drag(ustar)) + arms[1] * float(lift(ustar))
    assert moment / 1e-5 == pytest.approx(goal, rel=1e-10)


def _solve(copy: Path) -> "tuple[list[str], list[bytes]]":
    """Grains that lie at the end of each load step; the results."""
    subprocess.run(["./Allrun"], cwd=copy, check=True)
    results = [
        (copy / name).read_bytes()
        for name in ("samples.csv", "passage.dump", "bed.dump")
    ]
    rows = [row.split(",") for row in results[0].decode().splitlines()[1:]]
    return list({row[0]: row[3] for row in rows}.values()), results


def test_processes_that_share_the_grains_find_the_same(tmp_path: Path) -> None:
    for name, ranks in (("one", 1), ("two", 2), ("again", 2)):
        copied(tmp_path / name, ranks=ranks)
    before = set(os.listdir(tmp_path / "one"))
    untouched = os.stat(tmp_path).st_mtime_ns
    # MPI's directory would be made here, and removed while another run starts
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", str(tmp_path))
        alone, _ = _solve(tmp_path / "one")
    assert os.stat(tmp_path).st_mtime_ns == untouched
    made = set(os.listdir(tmp_path / "one")) - before
    assert made == {*GrainCase.results, "log.liggghts", "load_steps.csv"}
    assert alone[-1] == "0"
    shared, results = _solve(tmp_path / "two")
    assert (
        "2 by 1 by 1 MPI processor grid"
        in (tmp_path / "two" / "log.liggghts").read_text()
    )
    assert shared == alone
    assert _solve(tmp_path / "again")[1] == results


def _at_work_in(folder: Path) -> int:
    """How many processes work in a folder."""
    count = 0
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            count += (process / "cwd").resolve() == folder.resolve()
    return count


def test_processes_that_share_the_grains_die_with_their_shell(tmp_path: Path) -> None:
    # it has no end: nothing comes to rest, and nothing has waited long enough
    bed = copied(tmp_path / "bed", ranks=2, waiting_time=1e9, rest_energy=0.0)
    shell = subprocess.Popen(["./Allrun"], cwd=bed)

    def goes_on() -> None:
        assert shell.poll() is None

    until(lambda: _at_work_in(bed) >= 4, goes_on)
    shell.kill()
    shell.wait()
    until(lambda: _at_work_in(bed) == 0)
