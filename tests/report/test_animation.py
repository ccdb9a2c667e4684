"""The animation of the crest: which looks it shows, what each frame holds, its size."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from PIL import Image

from orchestrator.report import drawing
from orchestrator.report.pictures import animation, marks, snapshot
from orchestrator.report.pictures.snapshot import Passage
from orchestrator.report.results import Results
from orchestrator.runs.folder import Folder
from tests.report.conftest import only


@pytest.fixture(scope="module")
def passage(results: Results) -> Passage:
    (pile,) = results.plan.piles.values()
    return snapshot.read(pile, results.cases)


def test_study_with_a_pile_has_one_animation(results: Results, tmp_path: Path) -> None:
    (figure,) = animation.draw(results)
    assert drawing.saved(figure, Folder(tmp_path)) == figure
    assert (tmp_path / "figures" / "crest.gif").read_bytes() == figure.image
    assert len(figure.image) <= 1.5e6
    image = Image.open(BytesIO(figure.image))
    assert image.format == "GIF"
    assert 10 < getattr(image, "n_frames", 1) <= animation.MOST
    assert "d = 1 mm" in figure.title
    assert list(animation.draw(only(results, "grain"))) == []


def test_quiet_looks_are_left_out(passage: Passage) -> None:
    window = marks.windows(passage.pile)[-1]
    samples = animation.choose(passage, window)
    assert samples[0] == 0
    assert (np.diff(samples) > 0).all()
    assert len(samples) < len(passage.samples) / 2
    assert passage.at(int(samples[-1])).moved > 0.5 * passage.pile.packing.count
    still = np.broadcast_to(passage.exposed[:1], passage.exposed.shape)
    waiting_time = replace(passage, exposed=still, passed=np.zeros_like(passage.passed))
    assert len(animation.choose(waiting_time, window)) == 0


def test_frame_shows_how_grains_moved(passage: Passage) -> None:
    scene = animation.Scene(passage, marks.windows(passage.pile)[-1])
    sample = passage.first(0.3)
    assert sample is not None
    before, after = (_coloured(scene.frame(when)) for when in (0, sample))
    assert after > before + 300
    assert (scene.frame(0) == scene.frame(0)).all()


def _coloured(frame: NDArray[np.uint8]) -> int:
    """How many pixels have the colour of a way to move."""
    colours = [np.rint(255 * np.array(to_rgb(colour))) for colour, _ in marks.HOW.values()]
    near = [np.abs(frame - colour).max(axis=-1) < 3 for colour in colours]
    return int(np.any(near, axis=0).sum())
