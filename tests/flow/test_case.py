"""Flow cases run by the real solver on a coarse mesh, and their failures."""

import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator import pipeline, plan
from orchestrator.bed.line import between_flats
from orchestrator.errors import Exploded, SolverError, Stalled
from orchestrator.flow.case import FINE, FlowCase
from orchestrator.flow.foam import BED_FLOW, SolvedFlow
from orchestrator.flow.run import DIAGNOSTICS, WALL_STRESS
from orchestrator.flow.stress import APPROACH_ERROR, WallStress, bubble
from orchestrator.runs import case
from orchestrator.runs.files import read_json
from orchestrator.solvers import openfoam
from orchestrator.study.study import parse
from tests.flow.conftest import OPEN, PILE, Solve, allrun, changed, edit, of_hill

FACE = PILE.height_m / np.sin(np.radians(PILE.slope_deg))


def windward_mean(directory: Path, flow: FlowCase) -> float:
    """Mean of u*/u*_0 over the windward face."""
    stress = WallStress.from_csv(directory / WALL_STRESS)
    face = flow.height_m / np.sin(np.radians(flow.slope_deg))
    on_it = (stress.s_m > 0.0) & (stress.s_m < face)
    ustar, length = stress.ustar_over_ustar0_wall[on_it], stress.length_m[on_it]
    return float(np.average(ustar, weights=length))


def test_a_case_from_its_inputs_to_its_table(solve: Solve) -> None:
    directory = solve(PILE)
    assert case.done_state(PILE, directory.parent)
    kept = WallStress.from_csv(directory / WALL_STRESS)
    read = SolvedFlow(directory).stress(PILE.roughness_m)
    for name, values in vars(
        read
    ).items():  # the table loses nothing but digits beyond nine
        np.testing.assert_allclose(getattr(kept, name), values, rtol=5e-9)
    assert (directory / "parameters").read_text().count("//") == 19
    sums = (directory / "results.sha256").read_text().splitlines()
    assert [line.split()[1] for line in sums] == ["bed_flow.csv", "column_flow.csv"]
    # the fields, whose last digits are those of this processor, are known by their digests, too
    others = read_json(directory / "done.json")["others_sha256"]
    assert {Path(name).name for name in others} >= {
        "U",
        "epsilon",
        "k",
        "nut",
        "p",
        "phi",
    }


def test_the_flow_speeds_up_to_the_crest_and_separates_behind_it(solve: Solve) -> None:
    stress = WallStress.from_csv(solve(PILE) / WALL_STRESS)
    windward = (stress.s_m > 0.0) & (stress.s_m < FACE)
    assert np.count_nonzero(windward) == PILE.settings.cells_per_face
    x = stress.s_m * np.where(windward, np.cos(np.radians(15.0)), 1.0)
    np.testing.assert_allclose(
        stress.x_m[stress.s_m < FACE], x[stress.s_m < FACE], rtol=1e-5
    )
    np.testing.assert_allclose(
        stress.edges_m[:-1], stress.s_m - stress.length_m / 2, atol=1e-8
    )
    np.testing.assert_allclose(
        stress.z_e_m[windward], PILE.first_cell_m / 2.0, rtol=2e-3
    )
    places, lengths = np.array([[0.05, 0.5, 0.98, 1.5], [0.1, 0.1, 0.04, 0.2]]) * FACE
    toe, mid, crest, lee = stress.mean_over(places, lengths)
    assert 0.0 < toe < mid < crest
    assert crest > 2.0
    assert lee < 0.0
    start, end = stress.edges_m[[0, -1]]
    assert stress.mean_over(start + 0.02, 0.02) == pytest.approx(1.0, abs=0.01)
    assert 0.8 < stress.mean_over(end - 0.02, 0.02) < 1.0


def test_a_copy_run_by_hand_gives_the_same_bytes(solve: Solve, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(solve(PILE), tmp_path / '-a "b" c\'é'))
    shutil.rmtree(next(copy.glob("[1-9]*")))
    environment = {"PATH": os.environ["PATH"]}
    ended = subprocess.run(
        [copy / "Allrun"], env=environment, capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == "bed_flow.csv: OK\ncolumn_flow.csv: OK\n"
    edit(copy / "parameters", "freeStream       10.0;", "freeStream       10.1;")
    ended = subprocess.run(["./Allrun"], cwd=copy, capture_output=True, text=True)
    assert ended.returncode != 0
    assert "bed_flow.csv: FAILED" in ended.stdout


def test_the_template_runs_as_it_lies(template: Path) -> None:
    assert allrun(template).returncode == 0
    assert openfoam.check_log(template) > 10
    assert SolvedFlow(template).stress(1e-4 / 3).tau_wall.max() > 2.0
    left = {path.name for path in template.iterdir()}
    subprocess.run([template / "Allclean"], check=True)
    gone = left - {path.name for path in template.iterdir()}
    assert {"log.simpleFoam", "log.gmshToFoam", "log.wallShearStress"} < gone
    assert not (template / "constant" / "polyMesh").exists()


def test_short_chords_do_not_end_the_iterations_early(solve: Solve) -> None:
    """The more cells, the less of the residual is left when the flow has come to rest."""
    ends = []
    for chords in (40, 240):
        t = np.linspace(0, 1, chords + 1)
        length = np.pi * PILE.height_m / np.tan(np.radians(26))
        wave = np.column_stack(
            [length * t, PILE.height_m / 2 * (1 - np.cos(2 * np.pi * t))]
        )
        line = between_flats(wave, PILE.height_m)
        domain = changed(PILE, lid=30.0, upstream=10.0, downstream=40.0)
        hill = replace(domain, slope_deg=26.0, line=line)
        stress = WallStress.from_csv(solve(hill) / WALL_STRESS)
        ends.append((bubble(stress, PILE.height_m) or (0, 0))[1])
    assert ends[1] == pytest.approx(ends[0], rel=0.05)


@pytest.mark.parametrize(
    ("trap", "cause"),
    [
        ("true", "floating point exception after iteration"),
        ("false", "residuals are not numbers"),
    ],
)
def test_a_diverged_run(tmp_path: Path, trap: str, cause: str) -> None:
    directory = case.prepare(PILE, tmp_path)
    edit(
        directory / "system" / "fvSolution",
        "consistent      yes;",
        "consistent      no;",
    )
    edit(directory / "Allrun", "relaxation       0.7;", "relaxation 1.9;")
    assert allrun(directory, FOAM_SIGFPE=trap).returncode != 0
    told = f"simpleFoam diverged: .*{cause}.*it was the second try"
    with pytest.raises(Exploded, match=told) as raised:
        PILE.collect(directory)
    assert "log.simpleFoam.first" in raised.value.remedy
    assert "cells per face may do" in raised.value.remedy


@pytest.mark.parametrize(
    ("fault", "first"),
    [
        (("relaxation       0.95;", "relaxation 1.9;"), "simpleFoam diverged: "),
        (
            ("iterations       1000;", "iterations 80;"),
            "simpleFoam did not converge: ",
        ),
    ],
)
def test_a_flow_that_fails_is_tried_once_more_with_more_relaxation(
    solve: Solve, tmp_path: Path, fault: tuple[str, str], first: str
) -> None:
    ends = []
    for folder in ("one", "other"):
        directory = case.prepare(PILE, tmp_path / folder)
        edit(directory / "parameters", *fault)
        ended = allrun(directory)
        assert ended.returncode == 0
        PILE.collect(directory)
        case.finish(PILE, directory, solver_s=1.0, cpu_s=1.0, wall_s=1.0)
        said = case.said_of(directory)
        assert said.startswith(first)
        assert "the second try converged, with the values of second_try" in said
        changes = (directory / "second_try").read_text()
        assert "relaxation       0.7;\n" in changes
        asked = (directory / "parameters").read_text()
        for name, factor in (
            ("residual", 0.1),
            ("residualOfK", 0.1),
            ("iterations", 3),
        ):
            of_first, of_second = (
                float(re.findall(rf"(?m)^{name} +(\S+);", text)[0])
                for text in (asked, changes)
            )
            assert of_second == pytest.approx(factor * of_first)
        ends.append(read_json(directory / case.DONE)["results_sha256"])
        logs = {path.name for path in directory.glob("log.simpleFoam*")}
        assert logs == {"log.simpleFoam", "log.simpleFoam.first"}
    assert ends[0] == ends[1]
    assert {"second_try", BED_FLOW} < ends[0].keys()
    # by hand the same, and a change of what was other in the second try is noticed
    assert allrun(directory).returncode == 0
    assert case.run_of(directory, PILE.id)
    stress = windward_mean(solve(PILE), PILE)
    assert windward_mean(directory, PILE) == pytest.approx(stress, rel=0.01)
    (directory / "second_try").write_text(changes.replace("0.7", "0.6"))
    assert not case.run_of(directory, PILE.id)


def test_a_flow_of_several_processes_is_tried_once_more(template: Path) -> None:
    hill = of_hill(template)
    edit(hill / "parameters", "relaxation       0.95;", "relaxation 1.9;")
    edit(hill / "parameters", "ranks            1;", "ranks 2;")
    assert allrun(hill).returncode == 0
    assert "simpleFoam diverged: " in openfoam.second_try(hill)
    assert not [*hill.glob("processor*")]
    assert subprocess.run([hill / "Allclean"], check=True)
    assert not (hill / "second_try").exists()
    assert not (hill / openfoam.FIRST_LOG).exists()


def test_a_first_try_that_converges_is_the_only_one(solve: Solve) -> None:
    directory = solve(PILE)
    assert not case.said_of(directory)
    assert not (directory / "second_try").exists()
    assert not (directory / openfoam.FIRST_LOG).exists()


def test_a_solver_that_cannot_start_is_not_tried_again(template: Path) -> None:
    edit(template / "parameters", "turbulence       kEpsilon;", "turbulence nosuch;")
    assert allrun(template).returncode != 0
    with pytest.raises(SolverError, match=r"simpleFoam stopped: .*nosuch"):
        openfoam.check_log(template)
    assert not (template / openfoam.FIRST_LOG).exists()


@pytest.mark.parametrize(
    "name", ["wallShearStress", "U", "../constant/polyMesh/points"]
)
def test_a_broken_file_is_not_a_result(solve: Solve, tmp_path: Path, name: str) -> None:
    copy = Path(shutil.copytree(solve(PILE), tmp_path / "copy"))
    file = next(copy.glob("[1-9]*")) / name
    os.truncate(file, file.stat().st_size * 9 // 10)
    with pytest.raises(SolverError, match="the results are not whole"):
        PILE.collect(copy)


@pytest.mark.parametrize(
    ("settings", "within"),
    [
        ({"roughness": 3.3e-6, "first_cell_height": 2.5e-4}, 0.015),
        ({"roughness": 1e-4, "first_cell_height": 2e-3}, 0.015),
        # the log law of other models is another than that of k-epsilon, whose constants the lid has
        ({"turbulence_model": "RNGkEpsilon", "cells_per_face": 16}, APPROACH_ERROR),
        ({"turbulence_model": "realizableKE", "cells_per_face": 16}, APPROACH_ERROR),
        ({"turbulence_model": "kOmegaSST", "cells_per_face": 16}, APPROACH_ERROR),
        (
            {"top": "open water", "depth": 0.12, "upstream": 20.0, "downstream": 20.0},
            # its residuals do not fall, either; after the second try it is 0.22 % off
            3e-3,
        ),
        (
            {
                "top": "closed channel",
                "depth": 0.12,
                "upstream": 20.0,
                "downstream": 20.0,
            },
            2e-3,
        ),
    ],
)
def test_a_flat_bed_keeps_the_friction_velocity(
    tmp_path: Path, settings: dict[str, Any], within: float
) -> None:
    """Along 40 h the flow does not change; the log law, or the slope of a channel, gives u*_0."""
    channel, other = "depth" in settings, "turbulence_model" in settings
    cells = 16 if channel else 40
    flow = replace(
        changed(PILE, **{"cells_per_face": cells, **settings}), slope_deg=0.0
    )
    directory = case.prepare(flow, tmp_path)
    if not channel:  # the residuals of a flat bed do not fall: only noise is left
        edit(directory / "parameters", "iterations       1000;", "iterations 300;")
    allrun(directory)
    solved = SolvedFlow(directory)
    stress = solved.stress(flow.roughness_m)
    np.testing.assert_allclose(
        stress.ustar_over_ustar0_wall, 1.0, atol=0.01 if other else 0.002
    )
    assert solved.ustar0 / flow.ustar0_m_s == pytest.approx(1, abs=within)
    if channel:
        # k-epsilon is slow to mix below a surface: above the log law
        speed = solved.column_speed()
        ratio = flow.mean_speed_over_log_law(speed, solved.ustar0)
        assert 1 < ratio < 1.1
    elif not other:
        assert np.ptp(stress.x_m[np.abs(stress.x_m) < 0.8]) > 60 * flow.height_m
        np.testing.assert_allclose(stress.ustar_over_ustar0_eq10, 1.0, atol=0.02)


@pytest.mark.parametrize(
    ("settings", "ratio", "within"),
    [
        ({"speed": 5.0}, 1.0, 0.01),
        ({"speed": 20.0}, 1.0, 0.005),
        ({"cells_per_face": 32}, 1.0, 0.02),
        ({"non_orthogonal_correctors": 2}, 1.0, 1e-3),
        ({"lid": 200.0, "upstream": 160.0, "downstream": 200.0}, 1.0, 0.005),
        (
            {"lid": 10.0, "upstream": 10.0, "downstream": 20.0},
            1.08,
            0.05,
        ),  # too small a domain
        ({"convection_scheme": "upwind"}, 1.1, 0.045),  # too much diffusion
    ],
)
def test_the_windward_stress_under_other_settings(
    solve: Solve, settings: dict[str, Any], ratio: float, within: float
) -> None:
    other = changed(PILE, **settings)
    over = windward_mean(solve(other), other) / windward_mean(solve(PILE), PILE)
    assert over == pytest.approx(ratio, rel=within)


def test_a_fine_flow_starts_near_where_it_ends(solve: Solve) -> None:
    fine = replace(changed(PILE, cells_per_face=FINE, lid=10.0), slope_deg=25.0)
    (coarser,) = fine.needs
    assert (coarser.settings.cells_per_face, coarser.needs) == (FINE // 2, ())
    fine_, coarse = (solve(flow) for flow in (fine, coarser))
    over = windward_mean(fine_, fine) / windward_mean(coarse, coarser)
    assert over == pytest.approx(1, rel=0.02)
    assert f"[{coarser.name!r}]" == str(read_json(fine_ / "case.json")["needs"])
    iterations = [openfoam.check_log(directory) for directory in (fine_, coarse)]
    assert iterations[0] < 1.2 * iterations[1]


@pytest.mark.long
@pytest.mark.parametrize("pruned", [True, False])
def test_a_pruned_flow_runs_again_for_a_finer_one(tmp_path: Path, pruned: bool) -> None:
    """A finished flow runs once: again only where a finer one starts from what prune dropped."""
    text = """
        grain = {{ diameter = 1e-3 }}
        bed = {{ kind = "pile", slope_deg = 15.0 }}
        method.flow = {{ lid = 10.0, upstream = 10.0, downstream = 20.0, cells_per_face = {} }}
        method.kind = "pivot"
    """
    coarse, fine = (
        parse(text.format(n), name="a", where="a") for n in (FINE // 2, FINE)
    )
    pipeline.run(coarse, tmp_path, workers=1)
    if pruned:
        (flow,) = plan.make(coarse).cases.values()
        case.prune_case(flow, tmp_path / "cases")
    finished = pipeline.run(fine, tmp_path, workers=1)
    assert (finished.started, finished.failures) == (1 + pruned, {})


def test_the_stress_scales_with_the_size_and_grows_in_shallow_water(
    solve: Solve,
) -> None:
    lengths = ("roughness", "first_cell_height", "viscosity")
    settings = {name: 10 * getattr(PILE.settings, name) for name in lengths}
    larger = replace(changed(PILE, **settings), height_m=10 * PILE.height_m)
    shallow = changed(OPEN, depth=3.0 * PILE.height_m)
    flows = PILE, larger, OPEN, shallow
    deep, scaled, six, three = (windward_mean(solve(flow), flow) for flow in flows)
    assert scaled == pytest.approx(deep, rel=1e-4)
    # the water that passes the form has less than the depth
    assert deep < 0.95 * six < 0.9 * three


def test_diagnostics_tell_a_sound_run_from_others(solve: Solve) -> None:
    def verdicts(flow: FlowCase) -> dict[str, str]:
        rows = (solve(flow) / DIAGNOSTICS).read_text().splitlines()[1:]
        return {row.split(",")[0]: row.rsplit(",", 1)[1] for row in rows}

    assert set(verdicts(PILE).values()) == {"yes"}
    assert verdicts(OPEN)["mean_speed_over_log_law"] == "yes"
    upwind = changed(PILE, convection_scheme="upwind", cells_per_face=40)
    assert verdicts(upwind)["reattachment_over_h"] == "no"  # too early


@pytest.mark.parametrize(
    ("settings", "last", "error", "cause"),
    [
        (
            {},
            "20",
            Stalled,
            "did not converge: .* after iteration 60; it was the second",
        ),
        ({"viscosity": 1e-3}, "1000", SolverError, "the wall function fails"),
    ],
)
def test_runs_without_an_answer(
    tmp_path: Path,
    settings: dict[str, Any],
    last: str,
    error: type[SolverError],
    cause: str,
) -> None:
    flow = changed(PILE, **settings)
    directory = case.prepare(flow, tmp_path)
    edit(directory / "parameters", "iterations       1000;", f"iterations {last};")
    allrun(directory)
    with pytest.raises(error, match=cause):
        flow.collect(directory)


def test_results_of_another_mesh_are_refused(solve: Solve) -> None:
    with pytest.raises(
        SolverError, match=r"z_e is 0.5 to 0.5 of that of the first cells"
    ):
        changed(PILE, first_cell_height=1e-3).collect(solve(PILE))
