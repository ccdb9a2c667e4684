"""Where the model holds: what a study refuses, and what a map of its failures looks beyond."""

from orchestrator.closures import KARMAN
from orchestrator.flow.case import LID_OVER_HEIGHT
from orchestrator.flow.stress import undisturbed_ustar
from orchestrator.scene import PileBed, Scene, UnfitError

PILE_SLOPES_DEG = (10.0, 35.0)
"""Slopes of piles that the mesh and the packing have been tried for."""


def check(scene: Scene) -> None:
    """Refuse a scene outside of the range in which its answer means something.

    Raises
    ------
    UnfitError
        For the first field that is out of its range, with the remedy.
    """
    bed = scene.bed
    check_slope(bed.slope_deg, bed.entrainment_angle_deg, scene.grain.friction_angle_deg)
    if isinstance(bed, PileBed):
        check_pile_slope(bed.slope_deg)
        if scene.flow.model == "solve":
            check_first_cell(scene.solve_roughness, scene.first_cell_height)
            check_turbulence(scene)


def check_slope(slope_deg: float, entrainment_angle_deg: float, friction_angle_deg: float) -> None:
    """Beyond these limits a grain rolls or slides back without any flow."""
    limit = min(friction_angle_deg, 90 - entrainment_angle_deg)
    if slope_deg > limit + 1e-9:
        raise UnfitError(
            "bed.slope_deg",
            f"{slope_deg:g} deg is beyond min(friction angle, 90 deg - entrainment angle)"
            f" = {limit:g} deg",
            "a steeper bed rolls back without any flow: lower the slope or the entrainment angle",
        )


def check_pile_slope(slope_deg: float) -> None:
    """What meshes and packings of piles have been tried for."""
    low, high = PILE_SLOPES_DEG
    if not low <= slope_deg <= high:
        raise UnfitError(
            "bed.slope_deg", f"a pile of {slope_deg:g} deg", f"choose {low:g} ... {high:g} deg"
        )


def check_first_cell(roughness: float, first_cell_height: float) -> None:
    """The rough wall's log law fails where the first cell's centre is near the roughness."""
    if 4 * roughness > first_cell_height:
        raise UnfitError(
            "bed.roughness",
            f"z0 = {roughness:g} m is above half of z_e = {first_cell_height / 2:g} m, the height"
            " of the first cell's centre",
            "lower it, or raise flow.first_cell_height or bed.height; z_e of 10 z0 is sound",
        )


def check_turbulence(scene: Scene) -> None:
    """The wall function needs an eddy viscosity above the molecular one in the first cell."""
    assert isinstance(scene.bed, PileBed)
    lid = LID_OVER_HEIGHT * scene.bed.height
    ustar0 = undisturbed_ustar(scene.flow.speed, lid, scene.solve_roughness)
    ratio = KARMAN * ustar0 * scene.first_cell_height / 2 / scene.flow.viscosity
    if ratio < 1:
        raise UnfitError(
            "flow.viscosity",
            "the flow at the bed is not turbulent: in the first cell the eddy viscosity is "
            f"{ratio:.2g} of the molecular one",
            "take the field of a lower viscosity or a higher speed: u*/U_e is the same",
        )
