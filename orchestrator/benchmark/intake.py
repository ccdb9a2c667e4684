"""Reading of packs: whoever made one, nothing of it is believed before it is checked here."""

import json
import os
import re
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from orchestrator.benchmark.problem import EXPECTED, SCHEMA
from orchestrator.errors import InputError
from orchestrator.physics.laws import LAWS

FILES = ("expected.csv", "scenes.csv", "times.csv", "study.toml", "README.md")
"""Beside the manifest and the directory of the scenes."""
SCENES = "scenes"
MOST_BYTES = 64 * 2**20
"""Largest file, bytes."""
MOST_SCENES, MOST_MEMBERS, MOST_LINES = 20_000, 20, 200_000
"""Scenes of a pack; files of a scene; lines of the expected answers."""
_SCENE = r"[1-5]-[a-z0-9]+([.+-][a-z0-9]+)*"
_MEMBER = r"[a-z0-9]+([_-][a-z0-9]+)*\.(csv|json)"
_QUANTITY = r"[a-z][a-z0-9_]{0,79}"

Between = tuple[float, float]
RANGES: dict[str, Between] = {
    "alpha_deg": (-90.0, 90.0),
    **dict.fromkeys(("phi_deg", "incline_deg", "beta_deg"), (0.1, 89.9)),
    **dict.fromkeys(("damping", "time_step"), (1e-6, 0.999)),
    **dict.fromkeys(("d_m", "z0_m", "h_m", "lid_m"), (1e-9, 1e4)),
    **dict.fromkeys(("rho_sol_kg_m3", "rho_f_kg_m3"), (1e-6, 1e6)),
    **dict.fromkeys(("g_m_s2", "reduced_gravity_m_s2", "nu_m2_s"), (1e-12, 1e6)),
    **dict.fromkeys(("speed_m_s", "u_e_m_s", "ustar0_m_s"), (1e-9, 1e6)),
    **dict.fromkeys(("force_n", "weight_n"), (1e-30, 1e9)),
    "alpha_s": (0.0, 1e3),
    "displacement_criterion": (1e-3, 10.0),
    "lift_off": (0.0, 1.0),
    "count": (1, 1e6),
}
"""Ranges of the parameters that are used here, wherever they are given; SI units, degrees."""
_GRAIN = ("d_m", "rho_sol_kg_m3", "phi_deg", "damping", "time_step", "reduced_gravity_m_s2")
_FLUID = ("rho_f_kg_m3", "nu_m2_s", "g_m_s2", "alpha_deg", "beta_deg", "z0_m", "alpha_s")
_FLOW = ("alpha_deg", "h_m", "z0_m", "rho_f_kg_m3", "lid_m", "u_e_m_s", "ustar0_m_s")
KINDS: dict[str, tuple[int, tuple[str, ...]]] = {
    "closed-form": (1, ("d_m", "rho_sol_kg_m3", *_FLUID)),
    "collision": (2, (*_GRAIN, "speed_m_s")),
    "incline": (2, (*_GRAIN, "incline_deg")),
    "sliding": (2, (*_GRAIN, "speed_m_s")),
    "passing": (2, (*_GRAIN, "beta_deg", "displacement_criterion", "force_n", "weight_n")),
    "pivot": (2, (*_GRAIN, *_FLUID)),
    "flow": (3, _FLOW),
    "pile": (4, (*_GRAIN, *_FLUID, "count")),
    "line": (5, (*_GRAIN, *_FLUID, *_FLOW)),
}
"""Level of each kind, and the numbers that a scene of it has at least."""
_COUNTS = ("moved", "not_moved")
_BED = (*_COUNTS, "carried_off", "ustar0_m_s", "shields")
ASKED: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "closed-form": (("ustar_m_s", "reynolds", "shields"), ("drag_n", "lift_n")),
    "collision": (("restitution",), ()),
    "incline": (("acceleration_over_g",), ()),
    "sliding": ((), ("speed_over_start", "spin_over_start")),
    "passing": (("passing_time_over_t",), ()),
    "pivot": (("ustar_m_s",), ()),
    "flow": (("windward_mean",), ("ustar_over_ustar0",)),
    "pile": ((), _BED),
    "line": (("count",), _BED),
}
"""Quantities of each kind: single numbers, and functions of something."""

Text = Annotated[str, Field(max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
SceneName = Annotated[str, Field(max_length=80, pattern=f"^{_SCENE}$")]
Word = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._+-]{0,79}$")]
Whole = Annotated[int, Field(ge=-(2**53), le=2**53)]


class Machine(BaseModel):
    """Where a pack was made."""

    model_config = ConfigDict(strict=True, extra="forbid")
    processor: Text
    cores: Whole | None


class Manifest(BaseModel):
    """The manifest of a pack."""

    model_config = ConfigDict(strict=True, extra="forbid")
    kind: Literal["benchmark pack"]
    name: Text
    format: Annotated[Literal[1], Field(alias="schema")]
    scenes: Annotated[list[SceneName], Field(min_length=1)]
    sha256: dict[str, Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]]
    programs: dict[Text, Text] = {}
    machine: Machine | None = None


_PARAMETERS = TypeAdapter(
    dict[Annotated[str, Field(pattern=f"^{_QUANTITY}$")], Whole | float | Word],
    config=ConfigDict(strict=True, allow_inf_nan=False),
)


def refuse(what: str, where: Path) -> NoReturn:
    """Refuse a pack for one of its files."""
    raise InputError(what, where=str(where), remedy="the pack is not used: export it again")


def members(root: Path) -> dict[str, Path]:
    """Every file of a pack but the manifest, by its name in the pack.

    Raises
    ------
    InputError
        Naming what cannot be a file of a pack: a link, a strange name, a huge file.
    """
    found = {name: root / name for name in FILES}
    folders = list(_entries(root / SCENES, MOST_SCENES))
    for folder in folders:
        if not re.fullmatch(_SCENE, folder.name):
            refuse("this is no name of a scene", folder)
        for path in _entries(folder, MOST_MEMBERS):
            if not re.fullmatch(_MEMBER, path.name):
                refuse("this is no name of a scene's file", path)
            found[path.relative_to(root).as_posix()] = path
    for path in found.values():
        check(path)
    return found


def is_member(inner: str) -> bool:
    """Whether a path below the directory of the scenes is that of a scene's file."""
    return re.fullmatch(f"{_SCENE}/{_MEMBER}", inner) is not None


def _entries(folder: Path, most: int) -> Iterator[Path]:
    if folder.is_symlink() or not folder.is_dir():
        refuse("this is no directory", folder)
    names = sorted(os.listdir(folder))
    if len(names) > most:
        refuse(f"it holds more than {most} entries", folder)
    return (folder / name for name in names)


def check(path: Path) -> None:
    """See that a file of a pack is one, and of a size that can be read."""
    try:
        state = path.lstat()
    except OSError as error:
        refuse(f"it cannot be read: {error.strerror}", path)
    if not stat.S_ISREG(state.st_mode):
        refuse("this is a link or no file", path)
    if state.st_size > MOST_BYTES:
        refuse(f"it is larger than {MOST_BYTES // 2**20} MiB", path)


def value(path: Path) -> Any:
    """The value of a JSON file: no key twice, no number that is none."""
    check(path)
    try:
        text = path.read_text(encoding="utf-8")
        return json.loads(text, object_pairs_hook=_object, parse_constant=_constant)
    except (ValueError, RecursionError, OSError) as error:
        refuse(f"it cannot be read: {error}", path)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key is there twice")
    return found


def _constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number of JSON")


def manifest(path: Path) -> dict[str, Any]:
    """Read a manifest."""
    found = value(path)
    if isinstance(found, dict) and found.get("schema", SCHEMA) != SCHEMA:
        refuse(f"its schema is {found['schema']!r}, this program knows {SCHEMA}", path)
    try:
        told = Manifest.model_validate(found)
    except ValidationError as error:
        refuse(_said(error), path)
    if len(set(told.scenes)) < len(told.scenes):
        refuse("it lists a scene twice", path)
    return told.model_dump(by_alias=True, exclude_none=True)


def scene(path: Path, name: str) -> dict[str, Any]:
    """Read the parameters of a scene."""
    try:
        told = _PARAMETERS.validate_python(value(path))
    except ValidationError as error:
        refuse(_said(error), path)
    if (told.get("schema"), told.get("scene")) != (SCHEMA, name):
        refuse(f"its schema and scene are not {SCHEMA} and {name}", path)
    level, needed = KINDS.get(str(told.get("kind")), (None, ()))
    if level is None or (told.get("level"), name[0]) != (level, str(level)):
        refuse(f"it has no kind that is known of level {name[0]}", path)
    if set(_FLUID) <= {*needed} and told.get("force_law") not in LAWS:
        refuse("its force law is none that is known", path)
    _check_numbers(told, needed, path)
    return told


def _check_numbers(told: Mapping[str, Any], needed: tuple[str, ...], path: Path) -> None:
    for name in (*needed, *(name for name in RANGES if name in told)):
        low, high = RANGES[name]
        number = told.get(name)
        if isinstance(number, str) or number is None or not low <= number <= high:
            refuse(f"{name} is no number from {low:g} to {high:g}", path)
    if told.get("rho_f_kg_m3", 0.0) >= told.get("rho_sol_kg_m3", 1e30):
        refuse("the grains are not denser than the fluid", path)


def _said(error: ValidationError) -> str:
    first = error.errors()[0]
    field = ".".join(map(str, first["loc"][:2]))
    return f"{field}: {first['msg']}" if field else str(first["msg"])


def expected(path: Path, scenes: Mapping[str, Any]) -> pd.DataFrame:
    """Read the expected answers; `at` is a text.

    Parameters
    ----------
    path : Path
        The table.
    scenes : mapping
        Its keys are the names of all scenes.
    """
    check(path)
    if path.read_bytes().count(b"\n") > MOST_LINES:
        refuse(f"it has more than {MOST_LINES} lines", path)
    try:
        table = pd.read_csv(path, dtype=str, keep_default_na=False, encoding="utf-8")
        if list(table.columns) != ["scene", *EXPECTED]:
            refuse(f"its columns are not scene,{','.join(EXPECTED)}", path)
        numbers = table[list(EXPECTED[2:])].where(lambda part: part != "").astype(float)
    except (ValueError, OverflowError) as error:
        refuse(f"it cannot be read: {error}", path)
    table[list(EXPECTED[2:])] = numbers
    _check_table(table, path)
    if set(table["scene"]) != set(scenes):
        refuse("its scenes are not those of the manifest", path)
    for name, rows in table.groupby("scene"):
        _check_asked(rows, str(scenes[str(name)]["kind"]), path)
    return table


def _check_asked(rows: pd.DataFrame, kind: str, path: Path) -> None:
    """See that a scene is asked what its kind is, and its counts at the same places."""
    places = rows.groupby("quantity")["at"].agg(set).to_dict()
    single, functions = ASKED[kind]
    for quantity, at in places.items():
        if not (quantity in single and at == {""}) and not (quantity in functions and "" not in at):
            refuse(f"{kind} is not asked {quantity} like this", path)
    lacking = set(_COUNTS) & {*functions} - places.keys()
    if lacking or not places.get("not_moved", set()) <= places.get("moved", set()):
        refuse(f"{rows['scene'].iloc[0]} is asked how many have moved, or not, at no place", path)
    if not places.get("carried_off", set()) <= places.get("not_moved", set()):
        refuse(f"{rows['scene'].iloc[0]} is asked carried_off where not_moved is not", path)


def mobile(path: Path) -> int:
    """How many of the grains of a scene may move."""
    check(path)
    try:
        kinds = pd.read_csv(path, usecols=["kind"], dtype=str, encoding="utf-8")["kind"]
    except (ValueError, OverflowError) as error:
        refuse(f"it cannot be read: {error}", path)
    return int((kinds != "fixed").sum())


def _check_table(table: pd.DataFrame, path: Path) -> None:
    wanted = table[["value", "low", "high"]]
    at = pd.to_numeric(table["at"], errors="coerce")
    tolerance = table["tolerance"]
    wrong = {
        "holds what is no quantity": ~table["quantity"].str.fullmatch(_QUANTITY),
        "has an at that is no number": (table["at"] != "") & ~(at.abs() < 1e30),
        "lacks a finite value, low or high": ~(wanted.abs() < 1e30).all(axis=1),
        "has a low above its high": table["low"] > table["high"],
        "has a tolerance that is none": tolerance.notna() & ~tolerance.between(0, 10),
        "has an infinite number of ours": table["ours"].abs() > 1e30,
        "has a negative count or Shields number": (table["value"] < 0)
        & table["quantity"].isin(["moved", "not_moved", "carried_off", "shields"]),
        "asks the same again": table.duplicated(["scene", "quantity", "at"]),
    }
    for what, where in wrong.items():
        if where.any():
            refuse(f"line {int(where.to_numpy().argmax()) + 2} {what}", path)
