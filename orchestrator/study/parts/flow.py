"""The flow of a scene."""

from typing import Annotated, Literal

from pydantic import Field

from orchestrator.study.part import Info, Length, Part, Roughness, Viscosity, unless

Model = Literal["solve", "waves", "hill", "flat"]
Top = Literal["open water", "closed channel", "boundary layer"]
Turbulence = Literal["kEpsilon", "RNGkEpsilon", "realizableKE", "kOmegaSST"]
Convection = Literal["linearUpwind", "upwind", "limitedLinear"]
FormHeights = Annotated[float, Field(ge=3, le=1000)]
"""A length of the flow's domain over the height of the forms."""


class Flow(Part):
    """The flow over the bed, and how a grain feels it."""

    model: Annotated[
        Model,
        Info(
            "flow model",
            column="flow_model",
            scope="piles",
            about="answer",
            choices={
                "solve": "OpenFOAM",
                "waves": "linear theory with A and B of each wavelength (Fourrière et al. 2010)",
                "hill": "linear theory with A and B of one low hill (Kroy et al. 2002)",
                "flat": "log law of a flat bed, u* = u*₀",
            },
        ),
    ] = "solve"
    """where the stress on a pile comes from"""
    speed: Annotated[
        Annotated[float, Field(ge=1e-6, le=1e3)],
        Info("speed of the solve", "U_e", "m/s", "solve_u_e_m_s", "solved flows", "answer"),
    ] = 10.0
    """speed 10 h above the flat bed at which the flow over a pile is solved; the stress is scaled
    from it"""
    viscosity: Annotated[
        Viscosity | None,
        Info(
            "viscosity of the solve",
            "ν",
            "m²/s",
            "solve_nu_m2_s",
            "solved flows",
            "answer",
            read="solve_viscosity",
        ),
    ] = None
    """kinematic viscosity of that solve: the wall is rough, the fluid's own moves only the grain's
    Re*; by default 1e-5, or less where the flow in the first cells would not be turbulent"""
    first_cell_height: Annotated[
        Length | None,
        Info(
            "first cell",
            unit="m",
            column="first_cell_m",
            scope="solved flows",
            about="answer",
            read="first_cell_height",
        ),
    ] = None
    """height of the mesh's cells on the bed; by default h/40, more on a very rough bed, 2.5 z₀, and
    where the viscosity of the solve is given and the flow in them would not be turbulent"""
    cells_per_face: Annotated[
        int, Field(ge=10, le=400), Info("cells per face", scope="solved flows", about="answer")
    ] = 40
    """cells of the mesh along each face of the pile"""
    expansion_ratio: Annotated[
        float, Field(ge=1.01, le=2), Info("expansion ratio", scope="solved flows", about="answer")
    ] = 1.1
    """ratio of neighbouring cells up from the bed and away from the pile, with 40 cells along a
    face; it follows their number"""
    roughness: Annotated[
        Roughness | None,
        Info(
            "roughness length of the solve",
            "z_0",
            "m",
            "solve_z0_m",
            scope="piles",
            about="answer",
            read="solve_roughness",
        ),
    ] = None
    """roughness length at which the flow is found, for beds of nearly the same one to share it; by
    default the bed's"""
    turbulence_model: Annotated[
        Turbulence,
        Info(
            "turbulence model",
            scope="solved flows",
            about="answer",
            choices={
                "kEpsilon": "k-ε",
                "RNGkEpsilon": "RNG k-ε",
                "realizableKE": "realizable k-ε",
                "kOmegaSST": "k-ω SST",
            },
        ),
    ] = "kEpsilon"
    """OpenFOAM's turbulence model"""
    convection_scheme: Annotated[
        Convection, Info("convection scheme", scope="solved flows", about="answer")
    ] = "linearUpwind"
    """OpenFOAM's scheme for the convection of U"""
    top: Annotated[
        Top,
        unless("boundary layer"),
        Info(
            "top of the flow",
            column="flow_top",
            scope="piles",
            choices={
                "open water": "a level surface without stress",
                "closed channel": "a wall as rough as the bed",
                "boundary layer": "the log layer goes on above",
            },
        ),
    ] = "boundary layer"
    """what the flow has above"""
    depth: Annotated[
        Length | None, unless(None), Info("depth", "D", "m", "depth_m", scope="piles")
    ] = None
    """depth of open water or of a closed channel over the flat bed"""
    lid: Annotated[
        FormHeights,
        unless(100.0),
        Info("lid", unit="h", scope="solved flows", about="answer"),
    ] = 100.0
    """height of a boundary layer's lid above the flat bed; the flow there is that of the
    undisturbed log layer"""
    upstream: Annotated[
        FormHeights,
        unless(80.0),
        Info("flat bed upstream", unit="h", scope="solved flows", about="answer"),
    ] = 80.0
    """flat bed from the inlet to the forms"""
    downstream: Annotated[
        FormHeights,
        unless(100.0),
        Info("flat bed downstream", unit="h", scope="solved flows", about="answer"),
    ] = 100.0
    """flat bed from the forms to the outlet"""
    non_orthogonal_correctors: Annotated[
        int,
        Field(ge=0, le=5),
        Info("non-orthogonal correctors", scope="solved flows", about="answer"),
    ] = 1
    """repeated solves of the pressure for cells that are not orthogonal, in each iteration"""
