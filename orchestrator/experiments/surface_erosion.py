"""What wind takes from a pile in three dimensions, beside AP-42, section 13.2.5."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator import plan
from orchestrator.experiments import erosion, surface, surface_answer
from orchestrator.experiments.experiment import TEXTS, Experiment, Results, Runs
from orchestrator.flow.surface_case import SURFACE_STRESS, SurfaceFlowCase
from orchestrator.flow.surface_stress import SurfaceStress
from orchestrator.grains.onset import WIND_HEIGHT
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.report.page import Section
from orchestrator.report.style import Figure
from orchestrator.study.surface_parts import SurfaceScene
from orchestrator.study.surface_study import SurfaceStudy

ROW = 1.5
"""Distance from the middle up to which faces are of its row, over the least."""


def surface_of(
    scene: SurfaceScene, faces: pd.DataFrame, threshold: float
) -> erosion.Surface:
    """Make the surface of a pile of its faces.

    Parameters
    ----------
    scene
        The pile under the wind of one direction.
    faces
        The faces of the form, as `surface_answer.Ground.faces` lists them, with the
        slope along the wind in ``uphill``.
    threshold
        u*_t, m/s.

    Returns
    -------
    erosion.Surface
        The surface; shares are by area.
    """
    faces = faces.sort_values("along_m")
    is_level = faces["slope_deg"] < erosion.LEVEL_DEG
    side = np.where(faces["uphill"] > 0, "windward", "lee")
    columns = {
        "x_m": faces["along_m"],
        "z_m": faces["z_m"],
        "part": np.where(is_level, "top", side),
        "share": faces["area_m2"],
        "ratio": faces[surface_answer.RATIO],
    }
    name = f"wind from {scene.flow.from_deg:g}°"
    over_wind = float(log_law_ustar(1.0, WIND_HEIGHT, scene.solve_roughness))
    listed = pd.DataFrame(columns)
    off_middle = faces["across_m"].abs()
    # the middles of a row of faces lie within a part of a cell
    is_middle = off_middle <= ROW * off_middle.min()
    return erosion.Surface(name, listed, over_wind, threshold, listed[is_middle])


def experiment(study: SurfaceStudy, out: Path) -> Experiment:
    """Make the experiment on the erosion potential of piles in three dimensions.

    Parameters
    ----------
    study
        The study.
    out
        The directory of the results.

    Returns
    -------
    Experiment
        Its runs, and what is made of them.

    Raises
    ------
    InputError
        If the threshold is no number that a wind can reach, nor a material of AP-42.
    """
    del out
    winds = study.erosion.fastest_mile
    least, source = erosion.given_threshold(study.erosion.threshold, study.file)
    flows = {scene: surface.flow_of(scene) for scene in study.scenes}

    def results(runs: Runs) -> Results:
        done = [scene for scene in flows if flows[scene].name in runs.done]
        if not done:
            return {}, ()
        found = piles(done, flows, least, runs.cases)
        texts = TEXTS["erosion"]
        own = TEXTS["surface"]
        table = erosion.rows(found, winds)
        drawing = erosion.picture(found[: erosion.DRAWN], winds)
        figure = Figure("erosion", "Stress and loss", own["erosion"], (), drawing)
        said = [*erosion.sentences(found, winds, source), own["erosion_sure"]]
        told = "\n\n".join(said)
        limits = own["erosion_limits"].split("\n\n")
        tables = [erosion.AREAS, erosion.MATERIALS]
        return {"erosion": table}, [
            Section("", told, [figure], card=erosion.card(found, winds, source)),
            Section("Parts", texts["rows"], (), [table], limits),
            Section("The tables of AP-42", texts["sources"], (), tables),
        ]

    planned = plan.Plan({}, {}, (), {}, plan.listed(flows.values()))
    return Experiment(
        "erosion",
        study.title,
        planned,
        results,
        study.time_limit_s,
        source=study.source,
    )


def piles(
    scenes: Sequence[SurfaceScene],
    flows: Mapping[SurfaceScene, SurfaceFlowCase],
    least: float | None,
    cases: Path,
) -> list[erosion.Pile]:
    """The piles of some scenes, each with a surface for every direction of the wind.

    Parameters
    ----------
    scenes
        The scenes.
    flows
        The run of the flow of each.
    least
        Threshold friction velocity of every face, m/s; None: the closed form.
    cases
        The directory of the finished runs.

    Returns
    -------
    list of Pile
        The piles.
    """
    found = []
    for bare, members in surface.alike(scenes).items():
        surfaces = []
        for scene in members:
            ground = surface.ground_of(scene, least)
            stress = SurfaceStress.from_csv(cases / flows[scene].name / SURFACE_STRESS)
            direction = surface_answer.Direction.of(
                ground, stress, scene.flow.from_deg, scene.heights
            )
            surfaces.append(surface_of(scene, direction.form, ground.level_ustar))
        base = 2 * bare.heights.radius
        is_flat = bare.heights.relief < erosion.FLAT_BELOW * base
        found.append(erosion.Pile(bare.name, surfaces, is_flat, has_bare=False))
    return found
