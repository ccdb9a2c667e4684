"""Heaps on a surface: what is counted of them, by made-up stresses in place of a solver."""

from collections.abc import Callable, Sequence
from math import cos, pi, radians, tan
from pathlib import Path
from typing import TypeVar

import numpy as np
import pandas as pd
import pytest

from orchestrator import guests
from orchestrator.errors import InputError
from orchestrator.experiment import Experiment, ExperimentResults, Runs
from orchestrator.flow.run import WALL_STRESS
from orchestrator.report.card import Card
from orchestrator.report.page import Paragraphs, Section, Table
from orchestrator.surface import cards, erosion, pipeline
from orchestrator.surface.raster import geotiff
from orchestrator.surface.stress import SurfaceStress, faces_of
from orchestrator.surface.study import SurfaceStudy

Kind = TypeVar("Kind")
EAST, NORTH = 431_200.0, 5_571_000.0
SLOPE = 36.0
ONE = ((24.0, 26.0, 7.0),)
TWO = (*ONE, (54.0, 32.0, 5.5))
FILE = """
[fluid]
kind = "air"
[grain]
diameter = 1e-3
density = 2650.0
[bed]
kind = "surface"
surface = "heaps.tif"
entrainment_angle_deg = 50.0
[method.flow]
roughness = 0.005
[axes]
"flow.from_deg" = {}
[erosion]
"""


def study_of(
    folder: Path,
    cones: Sequence[tuple[float, float, float]] = TWO,
    *,
    fall: float = 0.0,
    noise: float = 0.01,
    directions: Sequence[float] = (270.0,),
    more: str = "",
) -> SurfaceStudy:
    """A study of cones, m, on ground that falls to the east."""
    folder.mkdir(exist_ok=True)
    x, y = np.arange(0, 80.1, 0.5), np.arange(0, 60.1, 0.5)
    z = np.zeros((len(y), len(x)))
    for east, north, height in cones:
        distance = np.hypot(x - east, (y - north)[:, None])
        z = np.maximum(z, height - distance * tan(radians(SLOPE)))
    z += 100 - fall * x + np.random.default_rng(3).normal(0, noise, z.shape)
    (folder / "heaps.tif").write_bytes(geotiff(EAST + x, NORTH + y, z, ""))
    path = folder / "heaps.toml"
    path.write_text(FILE.format([*directions]) + more)
    found: SurfaceStudy = guests.load_study(path, None)
    return found


def answered(
    study: SurfaceStudy,
    experiment: Experiment,
    folder: Path,
    strength: Callable[[float], float] = lambda from_deg: 1.0,
) -> ExperimentResults:
    """The results of an experiment over flows of which u*/u*_0 rises with the height."""
    for scene in study.scenes:
        flow = pipeline.flow_of(scene)
        middles, normals, _ = faces_of(flow.mesh)
        along = np.array([1.0, 0.0, 0.0]) - normals[:, :1] * normals
        along /= np.linalg.norm(along, axis=1)[:, None]
        ratio = strength(scene.flow.from_deg) * (1 + middles[:, 2] / flow.height_m)
        on_slab = np.zeros((flow.mesh.shape[1], 3))
        tau = np.concatenate([on_slab, ratio[:, None] ** 2 * along])
        centre = np.array(scene.heights.centre)
        directory = folder / flow.name
        directory.mkdir(parents=True, exist_ok=True)
        stress = SurfaceStress.of_faces(flow.mesh, tau, flow.axes, centre)
        stress.to_csv(directory / WALL_STRESS)
    names = {name: {"id": name} for name in experiment.planned.cases}
    results = experiment.results(Runs(experiment.planned, folder, names))
    assert results is not None
    return results


def lateral(cones: Sequence[tuple[float, float, float]]) -> float:
    """Area of the sides of cones, m2."""
    return sum(
        pi * (height / tan(radians(SLOPE))) ** 2 / cos(radians(SLOPE))
        for *_, height in cones
    )


@pytest.mark.parametrize("fall", [0.0, 0.015, 0.05])
def test_areas_and_shares_are_of_the_heaps_alone(tmp_path: Path, fall: float) -> None:
    study = study_of(tmp_path, fall=fall)
    made = answered(study, pipeline.SurfaceMotion(study), tmp_path / "cases").tables
    faces = made["faces-1-270"]
    on_heaps = faces[faces["heap"] > 0]
    # a face counts whose middle is on a heap: of the 200 at the edge half do. The lowest
    # hundredth of the highest heap is ground
    foot = 0.07 / tan(radians(SLOPE))
    plan = sum(pi * (h / tan(radians(SLOPE)) - foot) ** 2 for *_, h in TWO)
    upright = on_heaps["area_m2"] * np.cos(np.radians(on_heaps["slope_deg"]))
    assert upright.sum() == pytest.approx(plan, rel=0.03)
    # smoothing makes the toe and the crest less steep
    assert 0.9 < on_heaps["area_m2"].sum() / lateral(TWO) < 1.0
    first = on_heaps[on_heaps["heap"] == 1]
    assert 0.9 < first["area_m2"].sum() / lateral(ONE) < 1.0
    assert np.hypot(first["x_m"] - EAST - 24, first["y_m"] - NORTH - 26).max() < 10
    (row,) = made["directions"].to_dict("records")
    assert row["area, m²"] == pytest.approx(on_heaps["area_m2"].sum())


def test_grains_feel_the_fall_that_the_flow_does_not(tmp_path: Path) -> None:
    level, falls = (
        answered(
            study, pipeline.SurfaceMotion(study), tmp_path / f"{fall}" / "cases"
        ).tables
        for fall in (0.0, 0.05)
        for study in [study_of(tmp_path / f"{fall}", fall=fall)]
    )
    one, other = level["faces-1-270"], falls["faces-1-270"]
    assert other["z_m"].to_numpy() == pytest.approx(one["z_m"].to_numpy(), abs=2e-3)
    # ground that falls with the wind: grains of its flat part move in less of it
    is_flat = (one["heap"] == 0) & (one["slope_deg"] < 0.1)
    slopes = other["slope_deg"][is_flat]
    assert slopes.to_numpy() == pytest.approx(np.degrees(np.arctan(0.05)), abs=0.1)
    assert other["heading_deg"][is_flat].to_numpy() == pytest.approx(180.0, abs=3)
    ratio = other["wind_entrained_m_s"][is_flat] / one["wind_entrained_m_s"][is_flat]
    # straight down a slope b: sqrt(sin(p - b) / sin p), with p of 40 deg
    by_hand = np.sqrt(np.sin(radians(40) - np.arctan(0.05)) / np.sin(radians(40)))
    assert ratio.to_numpy() == pytest.approx(by_hand, abs=0.01)


def only(section: Section, kind: type[Kind]) -> Kind:
    """The one element of a kind in a section."""
    (found,) = (each for each in section.content if isinstance(each, kind))
    return found


def test_directions_that_the_interval_does_not_tell_apart_are_a_tie(
    tmp_path: Path,
) -> None:
    study = study_of(tmp_path, directions=[0.0, 90.0, 180.0])
    # stresses 3 % and 30 % below those of the worst direction
    strengths = {0.0: 0.97, 90.0: 1.0, 180.0: 0.7}
    experiment = pipeline.SurfaceMotion(study)
    strength = strengths.__getitem__
    sections = answered(study, experiment, tmp_path / "cases", strength).page
    card = only(sections[0], Card)
    assert "2 heaps of " in card.scene
    first = card.numbers[0]
    assert first.meaning.startswith("threshold wind at 10 m from 90°, first motion")
    assert "0° lies within the interval" in first.note
    assert "180°" not in first.note
    assert "From 180° motion starts at" in only(sections[2], Paragraphs).text
    assert "within the interval" not in only(sections[2], Paragraphs).text


def test_a_tie_of_all_directions_has_no_worst() -> None:
    every = [0.0, 90.0, 180.0, 270.0]
    assert cards.tie(every, 90.0, 4) == (
        "the directions differ by less than the interval"
    )
    assert cards.tie([90.0], 90.0, 4) == ""
    assert cards.tie([0.0, 90.0, 180.0], 90.0, 4) == (
        "0° and 180° lie within the interval"
    )
    many = [float(angle) for angle in range(0, 330, 30)]
    assert cards.tie(many, 0.0, 12).startswith("10 other directions lie")


def test_the_page_has_places_to_a_part_of_a_cell(tmp_path: Path) -> None:
    study = study_of(tmp_path, directions=[0.0, 90.0])
    experiment = pipeline.SurfaceMotion(study)
    results = answered(study, experiment, tmp_path / "cases")
    made, sections = results.tables, results.page
    shown = only(sections[2], Table).frame
    for place, exact in zip(
        shown["first at x, m"], made["directions"]["x_m"], strict=True
    ):
        assert place == f"{exact:.1f}"
    card = only(sections[0], Card)
    assert card.numbers[0].note.startswith("at x = 4312")


COAL = 'threshold = "uncrusted coal pile"\n'


def eroded(
    folder: Path,
    cones: Sequence[tuple[float, float, float]] = TWO,
    strength: Callable[[float], float] = lambda from_deg: 1.0,
    directions: Sequence[float] = (270.0,),
    more: str = "",
) -> tuple[pd.DataFrame, Card, str]:
    """The table, the card and the sentences of the erosion of cones."""
    study = study_of(folder, cones, directions=directions, more=COAL + more)
    experiment = erosion.HeapErosion(study)
    results = answered(study, experiment, folder / "cases", strength)
    made, sections = results.tables, results.page
    card = only(sections[0], Card)
    return made["erosion"], card, only(sections[0], Paragraphs).text


def test_each_heap_is_a_pile_of_ap42(tmp_path: Path) -> None:
    alone, one, said = eroded(tmp_path / "one", ONE)
    both, card, of_both = eroded(tmp_path / "both", TWO)
    # AP-42: a pile of coal of 36 deg loses 6.4 to 11.2 g/m2 in 20 m/s
    for shown in (one, card):
        assert shown.numbers[1].figure == "6.4–11.2"
    assert "flat ground" not in said + of_both
    assert both["pile"].nunique() == 2
    whole = both[both["part"] == "all"]
    epa = whole.loc[whole["surface"] == "AP-42, A", "P, g/m²"]
    assert epa.to_numpy() == pytest.approx(6.4, abs=0.05)
    areas = whole.loc[whole["surface"] == "wind from 270°", "area, m²"]
    assert areas.to_numpy() == pytest.approx(
        [0.95 * lateral([cone]) for cone in TWO], rel=0.05
    )
    # with a second heap cells are 1.23 m long, not 0.79: they smooth the first more
    first = both[both["pile"] == both["pile"].iloc[0]]
    own = alone["P, g/m²"].to_numpy()
    assert first["P, g/m²"].to_numpy() == pytest.approx(own, rel=0.06)


def test_a_low_heap_alone_is_flat_ground_to_ap42(tmp_path: Path) -> None:
    """One heap is as high as before, the other has a base of 24 m and 2.2 m."""
    x, y = np.arange(0, 80.1, 0.5), np.arange(0, 60.1, 0.5)
    high = 7.0 - tan(radians(SLOPE)) * np.hypot(x - 24, (y - 26)[:, None])
    low = 2.2 - 2.2 / 12 * np.hypot(x - 60, (y - 30)[:, None])
    study_of(tmp_path, more=COAL)
    heights = np.maximum(np.maximum(high, low), 0.0)
    (tmp_path / "heaps.tif").write_bytes(geotiff(EAST + x, NORTH + y, heights, ""))
    study = guests.load_study(tmp_path / "heaps.toml", None)
    experiment = erosion.HeapErosion(study)
    results = answered(study, experiment, tmp_path / "cases")
    made, sections = results.tables, results.page
    told = only(sections[0], Paragraphs).text.split("\n\n")
    assert "flat ground" not in told[0]
    assert "by AP-42, to which it is flat ground, " in told[1]
    rows = made["erosion"]
    by_epa = rows[rows["surface"].str.startswith("AP-42")]
    assert by_epa.groupby("pile", sort=False).size().tolist() == [4, 1]


def test_masses_are_those_of_areas_and_parts_add_up(tmp_path: Path) -> None:
    table, card, said = eroded(tmp_path)
    assert (table["loss, kg"] * 1000).to_numpy() == pytest.approx(
        (table["area, m²"] * table["P, g/m²"]).to_numpy()
    )
    own = table[table["surface"] == "wind from 270°"]
    for _, pile in own.groupby("pile"):
        whole, *parts = pile["loss, kg"]
        assert sum(parts) == pytest.approx(whole)
    total = own.loc[own["part"] == "all", "loss, kg"].sum()
    assert f"{total:.3g} kg in all" in card.numbers[0].note
    area = own.loc[own["part"] == "all", "area, m²"].sum()
    assert f"2 heaps of {area:.3g} m²" in card.scene
    assert card.numbers[0].value == pytest.approx(1000 * total / area)
    assert said.count(" kg from its ") == 2
    assert "38 to 2,000 times" in card.source


def test_the_worst_direction_leads_and_a_tie_is_said(tmp_path: Path) -> None:
    strengths = {0.0: 0.8, 90.0: 0.99, 180.0: 1.0}
    *_, card, said = eroded(tmp_path, TWO, strengths.__getitem__, [0.0, 90.0, 180.0])
    first, _, last = card.numbers
    assert first.meaning.endswith("with a wind from 180°, the worst of 3")
    assert "90° lies within the interval" in first.note
    assert first.low < first.value < first.high
    assert last.meaning == "with a wind from 0°, the least of all"
    assert last.value < first.low
    at = [said.index(f"wind from {angle}°") for angle in (180, 90, 0)]
    assert at == sorted(at)


def test_the_rose_of_the_file_weighs_the_directions(tmp_path: Path) -> None:
    rose = "from_deg,speed_m_s,share\n0,20,0.1\n0,5,0.5\n180,20,0.3\n180,30,0.1\n"
    tmp_path.joinpath("year.csv").write_text(rose)
    strengths = {0.0: 1.1, 180.0: 1.0}
    more = 'wind = "year.csv"\nfastest_mile = [20.0, 30.0]\n'
    table, card, said = eroded(tmp_path, TWO, strengths.__getitem__, [0.0, 180.0], more)
    # the worst of single winds is 0, but most of the year's blow from 180
    assert "wind from 0°, the worst of 2" in card.numbers[0].meaning
    assert card.numbers[2].meaning.startswith("in the mean over the winds of the rose")
    assert card.numbers[2].note.endswith("in wind from 180°")
    one = table[(table["part"] == "all") & (table["surface"] == "wind from 180°")]
    by_20, by_both = (
        eroded(
            tmp_path / f"{n}",
            TWO,
            strengths.__getitem__,
            [0.0, 180.0],
            f"fastest_mile = {winds}\n",
        )[0]
        for n, winds in enumerate(([20.0], [20.0, 30.0]))
    )

    def kg(rows: pd.DataFrame, angle: int) -> float:
        is_meant = (rows["part"] == "all") & (rows["surface"] == f"wind from {angle}°")
        return float(rows.loc[is_meant, "loss, kg"].sum())

    assert one["loss, kg"].sum() == pytest.approx(kg(by_both, 180))
    # 5 m/s takes nothing, and 30 m/s is the rest of both
    by_hand = 0.1 * kg(by_20, 0) + 0.3 * kg(by_20, 180)
    by_hand += 0.1 * (kg(by_both, 180) - kg(by_20, 180))
    assert card.numbers[2].value == pytest.approx(by_hand)
    assert f"costs {by_hand:.3g} kg in the mean" in said


def test_a_calm_rose_takes_nothing(tmp_path: Path) -> None:
    tmp_path.joinpath("year.csv").write_text("from_deg,speed_m_s,share\n270,4,1\n")
    *_, card, said = eroded(tmp_path, more='wind = "year.csv"\n')
    assert card.numbers[2].value == 0
    assert card.numbers[2].note == "none of them reaches the threshold"
    assert "No wind of the rose reaches the threshold" in said


def test_a_current_takes_no_dust(tmp_path: Path) -> None:
    study_of(tmp_path)
    path = tmp_path / "heaps.toml"
    path.write_text(path.read_text().replace('"air"', '"water"'))
    study = guests.load_study(path, None)
    with pytest.raises(InputError, match=r"fluid.density: a fluid of .* is no wind"):
        erosion.HeapErosion(study)
