"""Digests of the inputs of all kinds of cases, each with the recipe that made them.

A case keeps its results for as long as its name stays. The name is a digest of what was
asked, of the template and of `recipe` (`orchestrator.runs.case.Case`); what Python writes
is in it by `recipe` alone. ``pinned.json`` has the digests for the scenes of
``scenes.toml``, and ``python -m tests.recipes`` renews it.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from orchestrator.bed.poured import BED, PouredBed
from orchestrator.flow import theory
from orchestrator.flow.case import FlowCase
from orchestrator.flow.run import WALL_STRESS
from orchestrator.flow.stress import WallStress
from orchestrator.grains import pile
from orchestrator.grains.cells import batches
from orchestrator.grains.loads import Geometry
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile, PileCase, Worn, WornFlow
from orchestrator.runs.case import Case, template_files
from orchestrator.runs.files import canonical_json, digest_files, digest_text
from orchestrator.study import study
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.surface import heights as surface
from orchestrator.surface.case import SurfaceFlowCase
from orchestrator.surface.mesh import Level
from orchestrator.types import FloatArray

FOLDER = Path(__file__).parent
SCENES, PINNED = FOLDER / "scenes.toml", FOLDER / "pinned.json"
COMMAND = "python -m tests.recipes"
FORMS = {"a cone": surface.cone(10.0, 26.0), "a barchan": surface.barchan(3.0, 10.0)}
"""Beds in three dimensions, which scenes of grains have not."""
FEW_CELLS = Level("few cells", 6, 1, 1.35, 1.5, 8000)
SIZES = (1.0, 0.9, 1.1)
"""Sizes of the grains of a bed that stands in for a poured one, over d."""


class Inputs(NamedTuple):
    """The inputs of one case: a digest of what Python writes, and the recipe."""

    recipe: int
    digest: str


def current(cases: Path) -> dict[str, Inputs]:
    """Write the inputs of all cases of the scenes into a directory; no solver runs.

    A case that another one needs gets results that stand in for those of a run.

    Returns
    -------
    dict
        For each scene and case, as ``scene: pile 2``, its inputs.
    """
    found = {}
    digests: dict[str, str] = {}
    for group in study.load(SCENES).groups:
        counts: dict[str, int] = {}
        for case in _cases(group.scenes):
            counts[case.kind] = counts.get(case.kind, 0) + 1
            name = f"{group.name}: {case.kind} {counts[case.kind]}"
            if case.name not in digests:
                digests[case.name] = _written(case, cases)
                _stand_in(case, cases)
            found[name] = Inputs(case.recipe, digests[case.name])
    for name, form in FORMS.items():
        case = SurfaceFlowCase(form, 240.0, 10.0, 0.005, 1e-5, FEW_CELLS)
        found[f"{name}: surface 1"] = Inputs(case.recipe, _written(case, cases))
    return found


def pinned() -> dict[str, Inputs]:
    """The inputs that the file has."""
    values = json.loads(PINNED.read_text(encoding="utf-8"))
    return {name: Inputs(*value) for name, value in values.items()}


def pin(found: dict[str, Inputs]) -> None:
    """Write the file, a line for each case."""
    lines = [f"{json.dumps(name)}: {json.dumps(found[name])}" for name in found]
    PINNED.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def without_new_recipe(
    found: dict[str, Inputs], before: dict[str, Inputs]
) -> list[str]:
    """Names of those whose inputs have changed while their recipe has not."""
    names = []
    for name in found.keys() & before.keys():
        is_same_recipe = found[name].recipe <= before[name].recipe
        if is_same_recipe and found[name] != before[name]:
            names.append(name)
    return sorted(names)


def advice(names: list[str]) -> str:
    """What to do about inputs that have changed without a new recipe."""
    return (
        f"Inputs have changed, but the recipe of their case has not: {'; '.join(names)}. "
        "Results that were made of the former inputs would be taken for theirs. If you "
        "did not mean to change them, undo it. Else raise `recipe` by one in the class "
        "of each kind that is named: flow FlowCase (orchestrator/flow/case.py), which "
        "raises that of worn too; surface SurfaceFlowCase "
        "(orchestrator/surface/case.py); poured PouredBed (orchestrator/bed/poured.py); pile "
        "PileCase (orchestrator/grains/pile.py); cells SingleGrainCase "
        f"(orchestrator/grains/cells.py). Then run `{COMMAND}` and commit "
        "tests/recipes/pinned.json with it."
    )


def _cases(scenes: tuple[Scene, ...]) -> list[Case]:
    """The cases of some scenes in an order in which each follows those that it needs."""
    if not isinstance(scenes[0].bed, PileBed):
        return [*batches(scenes)]
    return [case for scene in scenes for case in Pile(scene).runs]


def _written(case: Case, cases: Path) -> str:
    """Write a case's inputs; the digest of those that are not the template's."""
    directory = cases / case.name
    before = {}
    for name, _, content in template_files(case.template):
        (directory / name).parent.mkdir(parents=True, exist_ok=True)
        (directory / name).write_bytes(content)
        before[name] = digest_files([directory / name], root=directory)[name]
    case.write(directory, cases)
    files = [path for path in directory.rglob("*") if path.is_file()]
    after = digest_files(files, root=directory)
    # the template is in the name of the case by itself
    of_python = {name: after[name] for name in after if after[name] != before.get(name)}
    assert of_python
    return digest_text(canonical_json(of_python))


def _stand_in(case: Case, cases: Path) -> None:
    """Write results that other cases can be made of, as if the case had run."""
    directory = cases / case.name
    if isinstance(case, FlowCase):
        _stress(case.bed_line.x, theory.flat(case.bed_line)).to_csv(
            directory / WALL_STRESS
        )
    elif isinstance(case, WornFlow):
        geometry = Geometry(case.scene, cases)
        line = pile.line(geometry, case, cases).scaled(case.scene.grain.diameter)
        _stress(line.x, theory.flat(line)).to_csv(directory / WALL_STRESS)
    elif isinstance(case, PouredBed):
        _rows(case).to_csv(directory / BED, index=False)
    elif isinstance(case, PileCase):
        _moved(case, cases)


def _stress(x: tuple[float, ...], flat: WallStress) -> WallStress:
    """A stress that rises and falls between the ends of a bed line's forms."""
    part = (flat.x_m - x[1]) / (x[-2] - x[1])
    tau = 1 + 0.3 * np.sin(2 * np.pi * part)
    return replace(
        flat,
        z_e_m=0.1 * flat.length_m,
        tau_wall=tau,
        ustar_over_ustar0_eq10=np.sqrt(tau),
    )


def _rows(bed: PouredBed) -> pd.DataFrame:
    """A bed of rows of grains over the fixed ones of a mould, each over the gaps below."""
    fixed, first, aside, rise = bed.floor, bed.floor, (0.5, 0.0), 0.86
    if bed.width:
        first = fixed[: len(fixed) // 2]
        aside, rise = (0.5, bed.width / len(np.unique(first[:, 1])) / 2), 0.7
    rows: list[FloatArray] = [fixed]
    for number in range(1, int((bed.depth + bed.surface) / rise) + 1):
        is_odd = number % 2
        rows.append(first + np.array([*aside, 0.0]) * is_odd + [0, 0, rise * number])
    x, y, z = np.concatenate(rows).T
    is_fixed = (np.arange(len(x)) < len(fixed)).astype(int)
    size = np.resize(SIZES, len(x))
    columns = {"x_over_d": x, "y_over_d": y, "z_over_d": z}
    return pd.DataFrame({**columns, "size": size, "fixed": is_fixed})


def _moved(case: PileCase, cases: Path) -> None:
    """The first grains of a pile have moved, in its second load step."""
    geometry = Geometry(case.scene, cases)
    flow = case.flow or (geometry.model.cases or (None,))[0]
    worn = pile.grains(geometry, flow, cases) if flow else Worn.whole(geometry.packing)
    loads = geometry.loads(cases)
    table = pile.table(loads, worn)
    counted = table.counted_ids - 1
    gone = counted[: max(pile.goal(geometry, case.flow) - worn.moved, 1)]
    level = np.where(np.isin(counted, gone), 2, 0)
    motion = Motion.of_flows(np.full(len(counted), np.inf))
    reached = float(np.max(worn.left, initial=0.01, where=np.isfinite(worn.left)))
    rising = reached * np.array([0.5, 1.0, 1.05])
    replace(motion, flow=rising, level=level).to_csv(cases / case.name, table)
    left, places = worn.left.copy(), worn.places.copy()
    left[gone], places[gone] = rising[2], np.nan
    Worn(places, left, loads.ratio).to_csv(cases / case.name)
