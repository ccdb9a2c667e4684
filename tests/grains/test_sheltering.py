"""Sheltering: drags that add up to the stress; a grain that stands clear, one that does not."""

import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from orchestrator.bed.packing import Packing
from orchestrator.bed.places import Places
from orchestrator.grains import peeling, sheltering
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.loads import loads_of
from orchestrator.grains.peeling import ForceTable, Loading
from orchestrator.lab import validate
from orchestrator.lab.sphere import sphere
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import peak_over_mean
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import threshold
from orchestrator.study.closed_form import closed_form
from orchestrator.study.study import parse
from orchestrator.types import FloatArray

D, Z0, RHO, NU = 0.01, 0.01 / 30, 1000.0, 1e-6
LAW = LAWS["bridged-gravel"]

PILE = """
grain.diameter = 1e-3
bed = { kind = "pile", slope_deg = 15.0 }
method.flow.model = "flat"
forces = { sheltering = "balanced", lift_coefficient = 0.0 }
method.kind = "%s"
"""


def _drag(ustar: FloatArray, sizes: FloatArray, gaps: FloatArray) -> FloatArray:
    return LAW.drag(
        ustar,
        Grain(
            diameter=D * sizes, roughness=Z0, fluid_density=RHO, viscosity=NU, gap=gaps
        ),
    )


def _levels(
    packing: Packing, gaps: FloatArray, ustar: float
) -> tuple[FloatArray, FloatArray]:
    """Of each grain the level over which it feels a flow; of its patch the area, m2."""
    patch, areas = sheltering.patches(packing, 1.0)
    given = {"diameter": D, "unit": ustar, "density": RHO}
    shelter = sheltering.balanced(
        _drag, patch, packing.sizes, gaps, areas * D**2, **given
    )
    return shelter.level(ustar, patch), areas * D**2


@pytest.mark.parametrize("reynolds", [0.1, 30.0, 3000.0])
def test_the_drags_on_each_patch_add_up_to_its_stress(reynolds: float) -> None:
    rng = np.random.default_rng(1)
    count, width = 300, 6.0
    every = np.ones(count, bool)
    s = np.sort(rng.uniform(0, 30, count))
    centres, sizes = np.column_stack([s, np.zeros(count)]), rng.uniform(0.7, 1.4, count)
    across = rng.uniform(0, width, count)
    packing = Packing(centres, sizes, every, every, ~every, s, across, width)
    gaps = Z0 + rng.uniform(-0.3, 0.4, count) * D
    ustar = reynolds * NU / D
    levels, areas = _levels(packing, gaps, ustar)
    drag = _drag(np.full(count, ustar), packing.sizes, gaps - levels)
    assert len(areas) > 10
    assert areas.sum() == pytest.approx(30 * width * D**2, rel=0.02)
    patch, _ = sheltering.patches(packing, 1.0)
    assert np.bincount(patch, drag) == pytest.approx(RHO * ustar**2 * areas, rel=1e-6)


def test_a_grain_alone_on_a_plane_keeps_its_drag() -> None:
    one = np.ones(1, bool)
    packing = Packing(np.zeros((1, 2)), np.ones(1), one, one, ~one, np.zeros(1))
    assert _levels(packing, np.array([Z0]), 0.1)[0] == 0.0


def test_a_sphere_that_stands_clear_and_one_level_with_its_neighbours() -> None:
    """Fenton and Abbott 1977: theta 0.010 on a close-packed layer; 0.1 to 0.3 level with it."""
    *_, model = validate.MODELS
    clear = sphere(model.fields, 3000.0, clear=True) / model.gust
    assert clear == pytest.approx(0.010, rel=0.3)
    assert 0.1 < sphere(model.fields, 3000.0, clear=False) / model.gust < 0.3


@pytest.mark.parametrize(
    ("intensity", "over_mean"),
    [
        (0.36, [1.47, 1.78, 2.12, 2.43, 2.77, 3.45]),
        (0.4, [1.52, 1.88, 2.28, 2.64, 3.05, 3.89]),
    ],
)
def test_the_largest_of_many_log_normal_stresses(
    intensity: float, over_mean: list[float]
) -> None:
    peaks = [
        peak_over_mean(intensity, events) for events in (10, 30, 100, 300, 1000, 10_000)
    ]
    assert peaks == pytest.approx(over_mean, abs=0.006)
    width = math.sqrt(math.log1p(intensity**2))
    drawn = np.random.default_rng(2).lognormal(-(width**2) / 2, width, 2_000_000)
    assert drawn.std() / drawn.mean() == pytest.approx(intensity, rel=0.01)
    assert np.quantile(drawn, 0.99) == pytest.approx(peaks[2], rel=0.01)


@pytest.mark.parametrize("gamma", [1.65e-4, 3e-4])
@pytest.mark.parametrize("method", ["closed form", "pivot", "peeling"])
def test_cohesion_is_shao_and_lu_s(gamma: float, method: str) -> None:
    """u*^2 over that without cohesion is 1 + gamma/(rho_p g d^2) for F_a = pi gamma d/(12 cos phi).

    Y. Shao and H. Lu, 2000, for forces that rise as u*^2, in a pocket of pivot angle phi.
    """
    d, density, g = np.geomspace(3e-5, 8e-4, 8), 2650.0, 9.81
    phi = math.radians(30)
    cohesion = math.pi * gamma / (12 * math.cos(phi))
    if method == "closed form":
        at = Grain(
            diameter=d,
            roughness=d / 30,
            fluid_density=1.2,
            viscosity=1.5e-5,
            lift_coefficient=0.0,
            density=density,
            entrainment_angle_deg=60.0,
        )
        with_it, without = (
            threshold(LAWS["low"], at.changed(cohesion=value)).friction_velocity
            for value in (cohesion, 0.0)
        )
    else:
        find = (
            peeling.pivots
            if method == "pivot"
            else partial(peeling.leaving, criterion=0.3)
        )
        centres = np.array([[0.0, math.cos(phi)], [-0.5, 0], [0.5, 0]])
        ways = np.tile(np.eye(2), (3, 1, 1)).transpose(1, 0, 2)
        loading = Loading(np.square, np.zeros_like, np.array([1.0, 0, 0]), *ways)
        ustar = np.geomspace(*peeling.RANGE, peeling.FINE_TABLE)
        tables = dict(
            enumerate(ForceTable.of(np.square, np.zeros_like, np.ones(3), ustar))
        )
        bonds = cohesion * d / (math.pi / 6 * d**3 * (density - 1.2) * g)
        given = Places.of(centres), np.ones(3), loading, tables
        with_it = np.array([find(*given, bond=bond)[0] for bond in bonds])
        without = np.full(len(d), find(*given)[0])
    assert (with_it / without) ** 2 == pytest.approx(
        1 + gamma / ((density - 1.2) * g * d**2)
    )


def test_each_grain_of_a_lattice_bears_the_stress_of_its_own_bed() -> None:
    """On rows of equal grains, 2 d cos(beta) apart, each has drag tau d 2 d cos(beta): Eq. 1."""
    answers = {}
    for method in ("pivot", "peeling"):
        (scene,) = parse(PILE % method, name="a", where="a").scenes
        loads = loads_of(Geometry(scene), Path())
        answers[method] = loads.alone() if method == "pivot" else loads.leaving()
    beta, alpha = math.radians(60), math.radians(15)
    tau = (
        scene.weight
        * math.cos(alpha - beta)
        / math.sin(beta)
        / (2 * math.cos(beta) * 1e-6)
    )
    exact = math.sqrt(tau / scene.fluid.density)
    assert np.median(answers["pivot"]) == pytest.approx(exact, rel=1e-6)
    # by peeling a grain waits for those before it, and needs no more flow once they have gone; the
    # grain of the crest and that of the toe have another share of the bed
    assert answers["peeling"].max() == pytest.approx(exact, rel=0.05)
    text = PILE % "pivot" + "flow.gusts = { intensity = 0.4, events = 100 }\n"
    (gusty,) = parse(text, name="a", where="a").scenes
    ratio = loads_of(Geometry(gusty), Path()).alone() / answers["pivot"]
    assert ratio == pytest.approx(1 / math.sqrt(peak_over_mean(0.4, 100)), rel=1e-6)


def test_grains_that_were_hidden_share_the_stress_when_those_above_have_gone() -> None:
    """Of equal grains in rows n neighbours that have gone free the n - 1 below them."""
    (scene,) = parse(PILE % "peeling", name="a", where="a").scenes
    bed, unit = Geometry(scene), float(closed_form(scene).friction_velocity)
    packed, present = bed.packing, np.ones(len(bed.packing.sizes), bool)
    counted = np.flatnonzero(packed.windward)
    present[counted[np.argsort(packed.arc_length[counted])[30:42]]] = False
    loads = replace(loads_of(bed, Path()), present=present)
    assert loads.exposed.sum() == bed.exposed(np.ones_like(present)).sum() - 1
    drag = np.where(loads.exposed, loads.loading.drag(np.full(len(present), unit)), 0.0)
    patch, areas = bed.patches
    stress = scene.fluid.density * unit**2
    assert np.bincount(patch, drag) == pytest.approx(stress * areas * 1e-6, rel=1e-6)
