"""The naive route beside which the ladder stands: one run of the whole pile for each Re*.

Every grain of the pile is mobile and explicit, and each Re* is a run of its own that settles the
bed and load steps the flow. It is measured on a small pile, with few flows, and extrapolated: the
time of a run is that of a load step, in proportion to the grains; the runs are as many as the load
steps by which the fast level finds the same curve.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator.errors import InputError
from orchestrator.fidelity import levels
from orchestrator.fidelity.decision import Decision, as_asked
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study

FEW = {"protocol.load_increment": 0.2, "protocol.waiting_time": 10.0, "protocol.time_step": 0.2}
"""Few holds, at the time step that is safe, on which the time of one is measured."""
FAST = "1 layer, fast"
"""The level that the routes are beside; the name of its own row."""


@dataclass(frozen=True)
class Route:
    """One way of the naive route: what it is called and its contact stiffness K d/W."""

    name: str
    stiffness: float


def routes(scene: Scene) -> tuple[Route, Route]:
    """With softened contacts, and with the paper's K = 1e6 N/m."""
    paper = levels.paper_stiffness(scene)
    return Route("every Re* alone, K d/W = 1e4", 1e4), Route("every Re* alone, K = 1e6 N/m", paper)


def small(study: Study) -> Scene:
    """The lowest pile of a study, in grains, that is answered by DEM.

    Raises
    ------
    InputError
        If it has none.
    """
    piles = {
        scene.bed.height / scene.grain.diameter: scene
        for scene in reversed(study.scenes)
        if isinstance(scene.bed, PileBed) and scene.protocol.method == "dem"
    }
    if not piles:
        raise InputError("it has no pile that is answered by DEM", where=study.name)
    return piles[min(piles)]


def answers(scene: Scene) -> dict[str, Decision]:
    """The scenes to run, by the route's name."""
    return {route.name: as_asked(measured(scene, route)) for route in routes(scene)}


def measured(scene: Scene, route: Route) -> Scene:
    """The scene on one route."""
    whole = levels.level("grains", "full pile, fast").answer(scene)
    return levels.changed(whole, {**FEW, "grain.stiffness": route.stiffness})


def costs(
    piles: Mapping[str, Pile], fast: Pile, cases: Path, seconds: Mapping[str, float]
) -> pd.DataFrame:
    """What each route costs for the curve of a pile: route, core_s, extrapolated.

    Parameters
    ----------
    piles : mapping
        The finished runs of the small pile, by route.
    fast : Pile
        The pile in question, on the fast level, finished.
    cases : Path
        Where they lie.
    seconds : mapping
        Solver's seconds by case.
    """
    runs = len(Motion.from_csv(cases / fast.case.name).flow) - 1
    rows: list[dict[str, Any]] = []
    # the dearest first: the others are compared with it
    for name, pile in reversed(list(piles.items())):
        load_steps = len(Motion.from_csv(cases / pile.case.name).flow) - 1
        whole = Pile(levels.level("grains", "full pile, fast").answer(fast.scene))
        grains = whole.packing.mobile.sum() / pile.packing.mobile.sum()
        rows.append(
            {
                "route": name,
                "core_s": seconds[pile.case.name] / load_steps * grains * runs,
                "extrapolated": True,
            }
        )
    rows.append({"route": FAST, "core_s": seconds[fast.case.name], "extrapolated": False})
    return pd.DataFrame(rows)
