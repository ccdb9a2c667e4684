"""How a scene is answered.

There are the threshold method, the solve of the flow, and the grains' run.

All numerics are here: none of these fields changes what is asked. A scene whose method
is ``auto`` leaves the choice to the program.
"""

from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal

from orchestrator.study import methods, models
from orchestrator.study.declare import (
    Fraction,
    Length,
    List,
    Part,
    Roughness,
    Viscosity,
    field,
)

if TYPE_CHECKING:
    MethodName = str
    ModelName = str
else:
    MethodName = Literal[tuple(methods.MEANINGS)]
    ModelName = Literal[tuple(models.MODELS)]
Turbulence = Literal["kEpsilon", "RNGkEpsilon", "realizableKE", "kOmegaSST"]
LEAST_FLOWS = 5
"""Least number of solved flows that another is put between."""
_solved = partial(field, scope="solved flows")
_dem = partial(field, scope="DEM")


class FlowMethod(Part):
    """How the flow over a pile is found: the model, and the numbers of a solve."""

    model: ModelName = field(
        models.SOLVE.name,
        scope="piles",
        column="flow_model",
        label="flow model",
        choices=models.MEANINGS,
    )
    """where the stress on a pile comes from"""
    speed: float = _solved(
        10.0,
        symbol="U_e",
        unit="m/s",
        column="solve_u_e_m_s",
        label="speed of the solve",
        ge=1e-6,
        le=1e3,
    )
    """speed 10 h above the flat bed at which the flow is solved; the stress is scaled
    from it"""
    viscosity: Viscosity | None = _solved(
        None,
        symbol="ν",
        unit="m²/s",
        column="solve_nu_m2_s",
        label="viscosity of the solve",
        read="solve_viscosity",
    )
    """kinematic viscosity of the solve, over a rough wall; by default 1e-5, or less
    where the first cells would not be turbulent"""
    first_cell_height: Length | None = _solved(
        None,
        unit="m",
        column="first_cell_m",
        label="first cell",
        read="first_cell_height",
    )
    """height of the cells on the bed; by default h/40, more on a rough bed and where
    the given viscosity needs it"""
    cells_per_face: int = _solved(40, ge=10, le=400)
    """cells of the mesh along each face of the pile"""
    expansion_ratio: float = _solved(1.1, ge=1.01, le=2)
    """ratio of neighbouring cells up from the bed and away from the pile, for 40 cells
    along a face"""
    roughness: Roughness | None = field(
        None,
        scope="piles",
        symbol="z_0",
        unit="m",
        column="solve_z0_m",
        label="roughness length of the solve",
        read="solve_roughness",
    )
    """roughness length at which the flow is solved, which similar beds can share; by
    default the bed's"""
    turbulence_model: Turbulence = _solved("kEpsilon")
    """OpenFOAM's turbulence model
    - kEpsilon: k-ε
    - RNGkEpsilon: RNG k-ε
    - realizableKE: realizable k-ε
    - kOmegaSST: k-ω SST"""
    convection_scheme: Literal["linearUpwind", "upwind", "limitedLinear"] = _solved(
        "linearUpwind"
    )
    """OpenFOAM's scheme for the convection of U"""
    non_orthogonal_correctors: int = _solved(
        1, label="non-orthogonal correctors", ge=0, le=5
    )
    """repeated solves of the pressure in each iteration"""
    lid: float = _solved(100.0, unit="h", ge=3, le=1000)
    """height of a boundary layer's lid above the flat bed, in undisturbed flow"""
    upstream: float = _solved(80.0, unit="h", label="flat bed upstream", ge=3, le=1000)
    """flat bed from the inlet to the forms"""
    downstream: float = _solved(
        100.0, unit="h", label="flat bed downstream", ge=3, le=1000
    )
    """flat bed from the forms to the outlet"""
    between: Annotated[tuple[Length, ...], List] = field(
        (),
        scope="flows between others",
        unit="m",
        column="solved_z0_m",
        label="roughness lengths of the flows that it lies between",
    )
    """roughness lengths, five or more, at which the flow is solved in place of that of
    the bed, which lies between them: the stress is interpolated in ln z0; within a
    tolerance the program chooses them"""

    @property
    def facts(self) -> models.FlowModel:
        """The facts of its model."""
        return models.MODELS[self.model]


HELD_FROM = 6.0
"""Least waiting time of load steps in which the flow is held, sqrt(d/g').

Shorter ones make a flow that rises steadily, with other thresholds: in the map
``quiet-step`` steps of at most 5 % are within 5 % of long ones from here on, and at
half of it up to 7 % off.
"""


class GrainMethod(Part):
    """How the grains are moved by DEM: contacts, layers that may move, load steps."""

    # softer grains sink into one another by a hundredth, harder ones are harder than
    # steel
    stiffness: float = _dem(1e4, symbol="K d/W", ge=1e2, le=1e9)
    """spring constant of a contact, normal and tangential, times the diameter over the
    weight"""
    damping: float = _dem(0.1, ge=0, le=1)
    """damping ratio of a collision"""
    mobile_layers: int = field(2, scope="piles", ge=1, le=1000)
    """layers that may move, of a poured bed by default 4; those below are fixed"""
    time_step: float = _dem(0.2, unit="√(m/K)", ge=1e-3, le=2)
    """time step of the grains' integration"""
    load_increment: float = _dem(0.02, symbol="Δu*/u*", ge=1e-4, le=0.2)
    """relative rise of u* from one load step to the next"""
    waiting_time: float = _dem(10.0, unit="√(d/g′)", ge=1, le=1e4)
    """time without a passage of the displacement criterion that ends a load step
    without rest"""
    final_fraction: Fraction = _dem(
        0.9, label="last fraction", scope="DEM of piles", read="last_fraction"
    )
    """fraction of the exposed grains that should have moved by the last load step, or
    0.05 more than the largest of `fractions` if that is more"""


class Method(Part):
    """How a scene is answered; `fidelity` names a set of its fields."""

    kind: MethodName = field(
        methods.AUTO,
        column="method",
        label="threshold method",
        choices=methods.MEANINGS,
    )
    """how the threshold is found: DEM, peeling (pivots that free one another), the
    pivot of each grain by itself, or the closed form along the bed line, without grains
    and for any length; left open, the program chooses one by numerical errors and by
    what each method knows"""
    flow: FlowMethod = FlowMethod()
    grains: GrainMethod = GrainMethod()

    @property
    def is_open(self) -> bool:
        """Whether the program chooses the threshold method."""
        return self.kind == methods.AUTO

    @property
    def candidates(self) -> tuple[methods.ThresholdMethod, ...]:
        """The threshold methods that may answer: one, or all while it is open."""
        if self.is_open:
            return tuple(methods.METHODS.values())
        return (self.facts,)

    @property
    def facts(self) -> methods.ThresholdMethod:
        """The facts of its threshold method, which is not left open."""
        return methods.METHODS[self.kind]

    @property
    def is_resolved_in_time(self) -> bool:
        """Whether grains are moved in time, and no other method may be chosen."""
        return all(each.is_resolved_in_time for each in self.candidates)

    @property
    def may_pack_grains(self) -> bool:
        """Whether grains are packed by it, or may be while it is open."""
        return any(each.packs_grains for each in self.candidates)
