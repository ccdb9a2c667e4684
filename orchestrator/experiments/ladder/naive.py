"""The naive route beside which the ladder stands: one run of the whole pile for each Re*.

Every grain of the pile is mobile and explicit, and each Re* is a run of its own that settles the
bed and holds the flow. It is measured on a small pile, with few flows, and extrapolated: the time
of a run is that of a load step, in proportion to the grains; the runs are as many as the load steps
by which the fast level finds the same curve.
"""

import math
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from orchestrator.errors import InputError
from orchestrator.fidelity.decision import Decision, as_asked
from orchestrator.fidelity.levels import changed, level, paper_stiffness
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study

FEW = {"protocol.load_increment": 0.2, "protocol.waiting_time": 10.0, "protocol.time_step": 0.2}
"""Few load steps, at the time step that is safe, on which the time of one is measured."""
FAST = "1 layer, fast"
"""The level that the routes are beside; the name of its own row."""
WHOLE = level("grains", "full pile, fast")


def small(study: Study) -> Scene:
    """The lowest pile of a study, in grains, that is answered by DEM; a lattice.

    Raises
    ------
    InputError
        If it has none.
    """
    piles = (
        scene
        for scene in study.scenes
        if isinstance(scene.bed, PileBed) and scene.protocol.method == "dem" and not scene.is_poured
    )
    found = min(piles, key=_height, default=None)
    if found is None:
        what = "it has no pile that is answered by DEM and is not poured"
        raise InputError(what, where=study.name, remedy="add one: the naive route is run on it")
    return found


def _height(scene: Scene) -> float:
    """In grains."""
    assert isinstance(scene.bed, PileBed)
    return scene.bed.height / scene.grain.diameter


def decisions(scene: Scene) -> dict[str, Decision]:
    """The scene by each route, by its name: the dearest, with the paper's K = 1e6 N/m, first."""
    stiffness = {
        "every Re* alone, K = 1e6 N/m": paper_stiffness(scene),
        "every Re* alone, K d/W = 1e4": 1e4,
    }
    whole = changed(WHOLE.answer(scene), FEW)
    return {
        name: as_asked(changed(whole, {"grain.stiffness": value}))
        for name, value in stiffness.items()
    }


def costs(
    routes: Mapping[str, Pile], fast: Pile, cases: Path, cpu_s: Mapping[str, float]
) -> pd.DataFrame:
    """Cost of each route for the curve of a pile: route, core_s, extrapolated.

    Parameters
    ----------
    routes : mapping of str to Pile
        The small pile by each route.
    fast : Pile
        The pile in question on the fast level.
    cases : Path
        Where the runs lie.
    cpu_s : mapping of str to float
        Processor seconds of the finished cases, by name; what is not finished costs NaN.
    """
    rows = [(name, _extrapolated(pile, fast, cases, cpu_s), True) for name, pile in routes.items()]
    rows.append((FAST, cpu_s.get(fast.case.name, math.nan), False))
    return pd.DataFrame(rows, columns=["route", "core_s", "extrapolated"])


def _extrapolated(small: Pile, fast: Pile, cases: Path, cpu_s: Mapping[str, float]) -> float:
    if not {small.case.name, fast.case.name} <= cpu_s.keys():
        return math.nan
    of_step = cpu_s[small.case.name] / _load_steps(small, cases)
    whole = Pile(WHOLE.answer(fast.scene), cases)
    grains = whole.packing.mobile.sum() / small.packing.mobile.sum()
    return float(of_step * grains * _load_steps(fast, cases))


def _load_steps(pile: Pile, cases: Path) -> int:
    return len(Motion.from_csv(cases / pile.case.name).flow) - 1
