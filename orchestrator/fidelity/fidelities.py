"""Fidelities: named ways to answer a pile, by cost.

A fidelity changes how a scene is answered, never what it asks. It has two rungs of the
ladder of models, one for the flow and one for the grains. ``study/fidelities.toml``
writes each of them out.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from orchestrator.physics.constants import KARMAN
from orchestrator.study import fidelities as written
from orchestrator.study import models
from orchestrator.study.closed_form import closed_form, flow_roughness
from orchestrator.study.fidelities import Fields
from orchestrator.study.methods import LOCAL as LOCAL_METHOD
from orchestrator.study.methods import METHODS
from orchestrator.study.models import MODELS, FlowModel
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed, value_of

FINER = {
    "method.flow.cells_per_face": 1,
    "method.flow.expansion_ratio": -1,
    "method.grains.mobile_layers": 1,
    "method.grains.stiffness": 1,
    "method.grains.time_step": -1,
    "method.grains.waiting_time": 1,
    "method.grains.load_increment": -1,
}
"""Numbers of a fidelity, and whether a larger (1) or a smaller one (-1) is finer."""


@dataclass(frozen=True, eq=False)
class Rung:
    """One way to answer the flow or the grains of a pile.

    Attributes
    ----------
    name, meaning
        Its name, and what it does in words.
    sets
        The fields of a scene that it sets.
    on
        By packing, the fields that it sets to something else there.
    not_on
        The packings that it cannot answer.
    derived
        The field that follows from the scene: "threshold_speed", else empty.
    most_grains
        The ladder measures it on piles of at most so many exposed grains.
    """

    name: str
    meaning: str
    sets: Fields = field(default_factory=dict)
    on: Mapping[str, Fields] = field(default_factory=dict)
    not_on: Sequence[str] = ()
    derived: str = ""
    most_grains: float = math.inf

    @property
    def model(self) -> FlowModel | None:
        """The flow model that it sets."""
        name = self.sets.get("method.flow.model")
        return None if name is None else MODELS[name]

    def takes(self, scene: Scene) -> bool:
        """Whether it can answer a pile.

        Parameters
        ----------
        scene
            The scene of a pile.

        Returns
        -------
        bool
            Whether it can.
        """
        bed = scene.bed
        assert isinstance(bed, PileBed)
        model = self.model
        if model is not None and model.misfit(scene):
            return False
        # an obstacle is never low
        if model is not None and model.is_of_low_beds and bed.obstacles:
            return False
        return packing(scene) not in self.not_on

    def changes(self, scene: Scene) -> Fields:
        """List the fields that it sets where it answers.

        Of fine sand it sets z0, too.

        Parameters
        ----------
        scene
            The scene of a pile.

        Returns
        -------
        dict
            Values by the fields' names.
        """
        fields = dict(self.fields(scene))
        if self.model is not None and self.model.follows_bed:
            fields["method.flow.roughness"] = flow_roughness(scene)
        return fields

    def describes(self, scene: Scene, *, or_finer: bool = False) -> bool:
        """Whether the scene has the numbers of this rung, or finer ones.

        Parameters
        ----------
        scene
            The scene of a pile.
        or_finer
            Whether finer numbers count as well.

        Returns
        -------
        bool
            Whether it has them.
        """
        if not self.takes(scene):
            return False
        for name, value in self.fields(scene).items():
            own = value_of(scene, name)
            if or_finer and name in FINER:
                if FINER[name] * (own - value) < 0:
                    return False
            elif own != value:
                return False
        return True

    def fields(self, scene: Scene) -> Fields:
        """List the fields that it sets in a scene.

        Parameters
        ----------
        scene
            The scene of a pile.

        Returns
        -------
        dict
            Values by the fields' names.
        """
        bed = scene.bed
        assert isinstance(bed, PileBed)
        fields = {**self.sets, **self.on.get(packing(scene), {})}
        if self.derived == "threshold_speed":
            ustar = float(closed_form(scene).friction_velocity)
            speed = ustar / KARMAN * math.log1p(10 * bed.height / bed.roughness)
            fields["method.flow.speed"] = float(f"{speed:.6g}")
            fields["method.flow.first_cell_height"] = scene.first_cell_height
        return fields


@dataclass(frozen=True)
class Fidelity:
    """A way to answer a pile: a rung for its flow and one for its grains.

    Attributes
    ----------
    name
        Its name.
    flow
        The rung for the flow.
    grains
        The rung for the grains.
    meaning
        What it is, in words.
    """

    name: str
    meaning: str
    flow: Rung
    grains: Rung

    @property
    def is_resolved_in_time(self) -> bool:
        """Whether grains are moved in time."""
        return METHODS[self.grains.sets["method.kind"]].is_resolved_in_time

    def takes(self, scene: Scene) -> bool:
        """Whether it can answer a pile.

        Parameters
        ----------
        scene
            The scene of a pile.

        Returns
        -------
        bool
            Whether both of its rungs can.
        """
        return self.flow_over(scene).takes(scene) and self.grains.takes(scene)

    def flow_over(self, scene: Scene) -> Rung:
        """Choose its rung for the flow over a pile.

        Over a level bed u* is u*_0, and no flow is solved.

        Parameters
        ----------
        scene
            The scene of a pile.

        Returns
        -------
        Rung
            The rung.
        """
        assert isinstance(scene.bed, PileBed)
        return FLAT if scene.bed.is_level else self.flow

    def answer(self, scene: Scene) -> Scene:
        """Make the scene as this fidelity answers it.

        Parameters
        ----------
        scene
            The scene of a pile.

        Returns
        -------
        Scene
            The scene with the numbers of both rungs.
        """
        flow = self.flow_over(scene).changes(scene)
        return changed(scene, {**flow, **self.grains.changes(scene)})

    def describes(self, scene: Scene) -> bool:
        """Whether a scene has all of its numbers.

        Parameters
        ----------
        scene
            The scene of a pile.

        Returns
        -------
        bool
            Whether it has them.
        """
        return self.flow_over(scene).describes(scene) and self.grains.describes(scene)


def named(name: str) -> Fidelity:
    """Find a fidelity by its name.

    Parameters
    ----------
    name
        The name.

    Returns
    -------
    Fidelity
        The fidelity.
    """
    return next(one for one in FIDELITIES if one.name == name)


def packing(scene: Scene) -> str:
    """Name the packing of a pile.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    str
        The packing; that of a poured bed in space is ``strip``.
    """
    assert isinstance(scene.bed, PileBed)
    return "strip" if scene.bed.width else scene.bed.packing


def _load() -> tuple[Fidelity, ...]:
    loaded = []
    for name, row in written.WRITTEN.items():
        flow = Rung(name, row.meaning, row.flow)
        grains = Rung(name, row.meaning, row.grains, row.on, row.not_on)
        loaded.append(Fidelity(name, row.meaning, flow, grains))
    return tuple(loaded)


FLAT = Rung(
    "flat",
    "log law on a flat bed: u*₀ everywhere",
    {"method.flow.model": models.FLAT.name},
)
FIDELITIES = _load()
"""The fidelities, by cost."""
REFERENCE = next(one for one in FIDELITIES if written.WRITTEN[one.name].is_reference)
"""The fidelity against which errors are measured; a choice takes none of its rungs."""


def _pairs() -> tuple[Fidelity, ...]:
    """Each rung of the flow beside each rung of the grains, but for the reference."""
    flows: list[Rung] = []
    grains: list[Rung] = []
    for one in FIDELITIES:
        if one is REFERENCE:
            continue
        if all(one.flow.sets != flow.sets for flow in flows):
            flows.append(one.flow)
        grains.append(one.grains)
    return tuple(_pair(flow, other) for flow in flows for other in grains)


def _pair(flow: Rung, grains: Rung) -> Fidelity:
    """The fidelity of two rungs: one that has a name, or a new one."""
    for one in FIDELITIES:
        if one.flow.sets == flow.sets and one.grains is grains:
            return one
    meaning = f"flow as in {flow.name}, grains as in {grains.name}"
    return Fidelity(f"{flow.name} flow, {grains.name} grains", meaning, flow, grains)


PAIRS = _pairs()
"""The fidelities that a choice may take: flow and grains are chosen apart."""
OWN = Rung("own", "numbers of the study file")
OWN_NUMBERS = Fidelity("own numbers", "numbers of the study file", OWN, OWN)
"""Stands for the fidelity of a scene that has the numbers of none."""
LOCAL = Fidelity(
    "local",
    "closed form along the bed line",
    OWN,
    Rung("local", "closed form along the bed line", {"method.kind": LOCAL_METHOD.name}),
)
"""A way without grains, for beds that have too many: its error is that of pivots."""


def fidelity_of(scene: Scene) -> Fidelity:
    """Find the fidelity whose numbers a pile has.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    Fidelity
        The fidelity; `OWN_NUMBERS` where it is none.
    """
    if LOCAL.grains.describes(scene):
        return LOCAL
    for one in FIDELITIES[::-1]:
        if one.describes(scene):
            return one
    return OWN_NUMBERS
