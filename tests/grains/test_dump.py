"""What the deck leaves out of its dump of the counted grains is known all the same."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.errors import SolverError
from orchestrator.grains import deck, dump, motion, protocol
from orchestrator.runs.case import templates

SLOPE = np.radians(20.0)


@pytest.fixture(scope="module")
def grains() -> deck.GrainTable:
    """The grains of the template's own pile, under a flow that takes them one after the other."""
    lines = (templates() / "liggghts" / "bed" / "grains.data").read_text().splitlines()
    rows = np.array([line.split() for line in lines[lines.index("Atoms") + 2 :]], float)
    return deck.GrainTable(
        position=rows[:, 4:],
        kind=rows[:, 1].astype(np.int64),
        along=np.tile([np.cos(SLOPE), np.sin(SLOPE)], (len(rows), 1)),
        sizes=np.ones(len(rows)),
        diameter=1e-3,
        density=2500.0,
    )


def _finer_steps(copy: Path, flows: deck.FloatArray) -> None:
    """Flows that take one grain after the other, with forces from the template's last set."""
    last = float((copy / "load_steps.txt").read_text().split()[-1])
    (copy / "load_steps.txt").write_text("".join(f"{flow!r}\n" for flow in flows.tolist()))
    for path in (copy / "force.x.txt", copy / "force.z.txt"):
        lines = path.read_text().splitlines()
        rows = [line.split() for line in lines[-int(lines[0]) :]]
        with path.open("w") as stream:
            for flow in flows.tolist():
                stream.write(lines[0] + "\n")
                factor = (flow / last) ** 1.9
                stream.writelines(
                    f"{n} {float(f) * factor * (1 + 0.01 * int(n))}\n" for n, f in rows
                )


def _run(folder: Path, stir: float) -> Path:
    copy = folder / f"stir-{stir}"
    shutil.copytree(templates() / "liggghts" / "bed", copy)
    text = (copy / "parameters.liggghts").read_text()
    (copy / "parameters.liggghts").write_text(re.sub(r"( stir equal) \S+", rf"\1 {stir}", text))
    _finer_steps(copy, protocol.flows(0.98, 1.5, 0.01))
    subprocess.run(["./Allrun"], cwd=copy, check=True)
    return copy


def test_grains_at_their_places_need_no_line(tmp_path: Path, grains: deck.GrainTable) -> None:
    short, whole = (_run(tmp_path, stir) for stir in (0.02, 0.0))
    sizes = [(folder / dump.PASSAGE).stat().st_size for folder in (short, whole)]
    assert sizes[0] < sizes[1] / 2
    samples = pd.read_csv(short / motion.SAMPLES)
    pd.testing.assert_frame_equal(samples, pd.read_csv(whole / motion.SAMPLES))
    few, all_of_them = (dump.read_track(folder, grains, samples) for folder in (short, whole))
    gone = np.isnan(few.travel)
    np.testing.assert_array_equal(gone, np.isnan(all_of_them.travel))
    assert gone[-1].any()
    assert not gone[-1].all()
    np.testing.assert_allclose(few.travel, all_of_them.travel, rtol=0, atol=0.02)
    found, expected = (
        motion.read(folder, grains, 0.3, falls_out=False) for folder in (short, whole)
    )
    for name in ("flow", "level", "fallen", "carried", "mode"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_a_hold_without_its_grains_at_the_end(tmp_path: Path, grains: deck.GrainTable) -> None:
    folder = _run(tmp_path, 0.02)
    frames = (folder / dump.BED).read_text().split("ITEM: TIMESTEP")
    (folder / dump.BED).write_text("ITEM: TIMESTEP".join(frames[:-1]))
    with pytest.raises(SolverError, match=r"bed.dump: its frames are not the ends"):
        dump.read_track(folder, grains, pd.read_csv(folder / motion.SAMPLES))
