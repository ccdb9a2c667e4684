"""Every field of a study file, changed alone: another run, another answer, or a refusal."""

import json
import warnings
from collections.abc import Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any, get_args

import pandas as pd
import pytest

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.study import study
from orchestrator.study.fields import COLUMNS, FIELDS, PARTS, Quantity, default_of
from orchestrator.tables import csv
from orchestrator.tables.answer import Answer
from orchestrator.tables.piles import pile_grain
from orchestrator.tables.single_grains import single_grain_rows
from orchestrator.tables.thresholds import pile_threshold

ROOT = Path(__file__).parents[2]
PROFILE = str(ROOT / "tests/study/profile.csv")
OTHER_PROFILE = str(ROOT / "tests/study/other_profile.csv")
Asked = Mapping[str, Any]
Found = list[str]
QUARTZ = {
    "grain.diameter": 1e-3,
    "grain.density": 2650.0,
    "fluid.density": 1000.0,
    "fluid.viscosity": 1e-6,
    "bed.roughness": 1e-4,
    "threshold.criterion": "entrained",
}
PILE: Asked = {**QUARTZ, "bed.kind": "pile", "bed.height": 8e-3}
SLOPE: Asked = {"bed.slope_deg": 20.0}
POURED: Asked = {"bed.packing": "poured", "bed.poured_depth": 5.0}
LEVEL: Asked = {**QUARTZ, "bed.kind": "pile", "bed.shape": "flat", "bed.length": 0.02}
DUNES: Asked = {
    **PILE,
    **SLOPE,
    "bed.shape": "dune",
    "bed.forms": 2,
    "bed.spacing": 0.1,
}
DEM: Asked = {"method.kind": "dem", "method.grains.load_increment": 0.05}
FLAT: Asked = {"method.flow.model": "flat"}
WAVES: Asked = {"method.flow.model": "waves"}
PEELING: Asked = {"method.kind": "peeling"}
PIVOT: Asked = {"method.kind": "pivot"}
WATER: Asked = {"flow.top": "open water", "flow.depth": 0.1}
STUDIES: Mapping[str, Asked] = {
    "a grain": {**QUARTZ, "bed.roughness": 1e-3 / 30, **PIVOT, "bed.kind": "grain"},
    "a grain by DEM in the gas of the paper": {
        **SLOPE,
        **DEM,
        "fluid.kind": "paper",
        "grain.diameter": 1e-3,
        "bed.roughness": 1e-4,
        "bed.kind": "grain",
    },
    "a grain by DEM": {**QUARTZ, **SLOPE, **DEM, "bed.kind": "grain"},
    "a pile by pivots": {**PILE, **SLOPE, **PIVOT, **FLAT},
    "a disordered pile by peeling": {
        **PILE,
        **SLOPE,
        **PEELING,
        **FLAT,
        "bed.packing": "disordered",
        "bed.seed": 1,
    },
    "dunes by pivots over waves": {
        **DUNES,
        **PIVOT,
        **WAVES,
        "forces.averaging_length": 0.5,
    },
    "a profile by peeling": {
        **QUARTZ,
        **PEELING,
        **FLAT,
        "bed.kind": "pile",
        "bed.profile": PROFILE,
    },
    "a profile in closed form over waves": {
        **QUARTZ,
        **WAVES,
        "bed.kind": "pile",
        "bed.profile": PROFILE,
        "method.kind": "local",
        "forces.averaging_length": 0.5,
    },
    "a level bed by pivots": {**LEVEL, **PIVOT},
    "a pile by DEM": {**PILE, **SLOPE, **DEM},
    "dunes by DEM in open water": {**DUNES, **DEM, **WATER},
    "a poured pile by DEM": {**PILE, **SLOPE, **POURED, **DEM},
    "a strip by DEM": {**LEVEL, **POURED, **DEM, "bed.width": 6.0},
    "a strip that DEM follows": {
        **LEVEL,
        **POURED,
        **DEM,
        **FLAT,
        "bed.width": 6.0,
        "threshold.criterion": "sustained",
        "flow.gusts": {"intensity": 0.4, "events": 100},
    },
}
"""Studies of one scene: of those by DEM the runs are compared, of others the answers."""
FENCE = {"kind": "fence", "x": -0.1, "height": 0.01}
OTHERS: Mapping[str, tuple[Any, ...]] = {
    "bed.brink_radius": (2e-3,),
    "bed.counted": ("all", [5e-3, 1.2e-2]),
    "bed.lee_slope_deg": (25.0,),
    "bed.length": (0.03,),
    "bed.obstacles": ([FENCE],),
    "bed.profile": (PROFILE, OTHER_PROFILE),
    "bed.smoothing": (0.015,),
    "bed.spacing": (0.2,),
    "flow.depth": (0.12,),
    "flow.gusts": ({"intensity": 0.4, "events": 10},),
    "fluid.kind": ("air",),
    "forces.law": ("profile",),
    "grain.sizes": ({"sigma_g": 1.2},),
    "method.flow.between": ([5e-5, 8e-5, 1.3e-4, 2e-4, 3e-4],),
    "method.flow.first_cell_height": (1e-3,),
    "method.flow.roughness": (2e-4,),
    "method.flow.viscosity": (5e-6,),
    "threshold.displacement": (0.01,),
    "threshold.fractions": ([0.2],),
}
"""What is written for fields that are no numbers or left open, and where a tenth of a
number is too little."""
FRICTION = (
    "of pivots it limits the slope alone: what is refused, and what error is known"
)
FLUID = "the scene has its fluid's numbers and a criterion, which the kind stands for"
READ = "no run depends on it; answers of other studies here, read of the same, do"
CHOSEN = "left open, its own load steps choose the same method"
LEVEL_HEIGHT = "a level bed has no height, whatever is given, as its declaration says"
WEDGE = "rows of one pile of two faces lie alike, with any number of layers below"
REPLICA = "a replica has grains 1e-6 d aside, and the closed form along a line has none"
FOLLOWED = "its grains have a drag, a way and times of their own"
LIFTED = "its grains are lifted, and do not roll out of their pockets"
OF_PIVOTS = {"fluid.kind": FLUID, "grain.friction_angle_deg": FRICTION}
OF_DEM = {
    "fluid.kind": FLUID,
    "method.kind": CHOSEN,
    "threshold.criterion": READ,
    "threshold.fractions": READ,
}
OF_GRAINS = {name: OF_DEM[name] for name in OF_DEM if name != "threshold.fractions"}
WITHOUT: Mapping[str, Mapping[str, str]] = {
    "a grain": OF_PIVOTS,
    "a grain by DEM in the gas of the paper": {
        name: why for name, why in OF_GRAINS.items() if name != "fluid.kind"
    },
    "a grain by DEM": OF_GRAINS,
    "a pile by pivots": {**OF_PIVOTS, "method.grains.mobile_layers": WEDGE},
    "a disordered pile by peeling": {**OF_PIVOTS, "method.grains.mobile_layers": WEDGE},
    "dunes by pivots over waves": OF_PIVOTS,
    "a profile by peeling": {**OF_PIVOTS, "threshold.displacement": LIFTED},
    "a profile in closed form over waves": {**OF_PIVOTS, "bed.seed": REPLICA},
    "a level bed by pivots": {**OF_PIVOTS, "bed.height": LEVEL_HEIGHT},
    "a pile by DEM": OF_DEM,
    "dunes by DEM in open water": OF_DEM,
    "a poured pile by DEM": OF_DEM,
    "a strip by DEM": {**OF_DEM, "bed.height": LEVEL_HEIGHT},
    "a strip that DEM follows": {
        **{name: why for name, why in OF_DEM.items() if name != "threshold.criterion"},
        "bed.height": LEVEL_HEIGHT,
        **dict.fromkeys(
            (
                "forces.law",
                "forces.lift_coefficient",
                "forces.loaded_grains",
                "method.flow.roughness",
                "method.grains.waiting_time",
                "threshold.displacement",
            ),
            FOLLOWED,
        ),
    },
}
"""Fields that neither change a study nor are refused there, each with the reason."""


def _written(value: Any) -> str:
    """A value as a study file has it."""
    if isinstance(value, dict):
        inside = (f"{key} = {_written(each)}" for key, each in value.items())
        return f"{{ {', '.join(inside)} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_written, value))}]"
    return json.dumps(value)


def _study(fields: Asked) -> study.Study:
    text = "\n".join(f"{name} = {_written(value)}" for name, value in fields.items())
    return study.parse(text, name="every", where=str(ROOT / "every.toml"))


def _found(asked: study.Study) -> Found:
    """The names of the runs of a study, and where it has none its answers."""
    planned = plan.make(asked)
    if planned.cases:
        return sorted(planned.cases)
    none = Path("no case")
    tables = [pd.DataFrame(single_grain_rows(planned, (), none))]
    for scene_id, pile in planned.piles.items():
        answer = Answer(planned.decisions[scene_id], pile, none)
        tables += [
            pd.DataFrame(pile_threshold(answer)),
            pd.DataFrame(pile_grain(answer)),
        ]
    # what is said of the scene again is no answer
    answers = [
        csv(each.drop(columns=["scene_id", *COLUMNS], errors="ignore"))
        for each in tables
    ]
    assert any(answers)
    return answers


def _words(kind: Any) -> Iterator[str]:
    """The words of a type."""
    for each in get_args(kind):
        yield from [each] if isinstance(each, str) else _words(each)


def _others(field: Quantity, value: Any) -> Iterator[Any]:
    """Other values of a field: all its words, a tenth more and less, one more and less."""
    table, _, name = field.name.rpartition(".")
    words = [*_words(PARTS[table].model_fields[name].annotation)]
    if words:
        # the bed of a grain is another class
        yield from (word for word in [*words, "grain"] if word != value)
    elif isinstance(value, int):
        yield from (value + 1, value - 1)
    elif isinstance(value, float):
        yield from (1.1 * value, 0.9 * value) if value else (0.1,)
    yield from OTHERS.get(field.name, ())


def _outcome(fields: Asked, field: Quantity, before: Found) -> str:
    """What becomes of a study whose field is changed: another, the same, or refused."""
    (scene,) = _study(fields).scenes
    try:
        value = field.read(scene)
    except AttributeError:  # a bed of one grain has no such field
        value = default_of(field.name)
    outcomes = set()
    for other in _others(field, value):
        try:
            after = _found(_study({**fields, field.name: other}))
        except InputError:
            outcomes.add("refused")
            continue
        if after != before:
            return "another"
        outcomes.add("the same")
    return max(outcomes)


@pytest.fixture(scope="module")
def outcomes() -> dict[str, dict[str, str]]:
    """What becomes of each study by each field."""
    found = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, fields in STUDIES.items():
            before = _found(_study(fields))
            assert before == _found(_study(fields))
            found[name] = {
                field.name: _outcome(fields, field, before) for field in FIELDS
            }
    return found


def test_a_field_that_is_changed_alone_changes_a_run_or_an_answer_or_is_refused(
    outcomes: dict[str, dict[str, str]],
) -> None:
    same = {
        name: {field for field, outcome in of_study.items() if outcome == "the same"}
        for name, of_study in outcomes.items()
    }
    assert same == {name: {*WITHOUT.get(name, {})} for name in STUDIES}


def test_every_field_changes_a_study(outcomes: dict[str, dict[str, str]]) -> None:
    """None is refused or without effect everywhere: a new field is varied here, too."""
    effects = chain.from_iterable(of_study.items() for of_study in outcomes.values())
    changing = {field for field, outcome in effects if outcome == "another"}
    assert changing == {field.name for field in FIELDS}


INNER: Mapping[str, tuple[Asked, Asked]] = {
    "flow.gusts": (
        {"intensity": 0.4, "events": 100, "duration": 1.0},
        {"intensity": 0.5, "events": 50, "duration": 2.0},
    ),
    "bed.obstacles": (
        {"kind": "block", "x": -0.1, "height": 0.01, "length": 0.02},
        {"kind": "half-cylinder", "x": -0.12, "height": 0.012, "length": 0.03},
    ),
    "grain.sizes": (
        {"sigma_g": 1.3, "smallest": 0.7, "largest": 1.5},
        {"sigma_g": 1.2, "smallest": 0.65, "largest": 1.4},
    ),
}
"""Tables that are fields, and another value for each of their keys."""


def _inner_outcomes(name: str, fields: Asked) -> Iterator[tuple[str, str]]:
    """What becomes of a study by each key of a table, where it takes the table."""
    table, others = INNER[name]

    def with_(keys: Asked) -> Asked:
        return {**fields, name: [keys] if name == "bed.obstacles" else keys}

    try:
        before = _found(_study(with_(table)))
    except InputError:
        return
    for key, other in others.items():
        changed = {**table, key: other}
        if other == "half-cylinder":
            del changed["length"]
        try:
            after = _found(_study(with_(changed)))
        except InputError:
            yield key, "refused"
        else:
            yield key, "the same" if after == before else "another"


@pytest.mark.parametrize("name", INNER)
def test_a_key_that_is_changed_alone_changes_a_run_or_an_answer_or_is_refused(
    name: str,
) -> None:
    found: dict[str, set[str]] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for fields in STUDIES.values():
            for key, outcome in _inner_outcomes(name, fields):
                found.setdefault(key, set()).add(outcome)
    assert not [key for key, of_key in found.items() if "the same" in of_key]
    assert [key for key, of_key in found.items() if "another" in of_key] == [
        *INNER[name][1]
    ]
