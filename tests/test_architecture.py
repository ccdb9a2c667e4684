"""The rooms of the house: a package imports from those below it, and never in a circle.

The order of the rooms is that of the table in docs/architecture.md, low to high.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import orchestrator
from orchestrator.guests import GUESTS
from orchestrator.solvers import dem
from orchestrator.study.methods import METHODS
from orchestrator.study.models import MODELS
from orchestrator.study.shapes import SHAPES

PACKAGE = Path(orchestrator.__file__).parent
PAGE = PACKAGE.parent / "docs" / "architecture.md"
ENDS = {"orchestrator", "orchestrator.__main__"}
"""The face of the package, which imports its functions when they are called."""


def _modules() -> dict[str, Path]:
    """The file of each module of the package."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        name = ".".join(part for part in parts if part != "__init__")
        found[name] = path
    return found


MODULES = _modules()


def _rooms() -> list[str]:
    """The rooms of the table in the document, low to high."""
    _, table = PAGE.read_text("utf-8").split("## Packages, low to high")
    table, *_ = table.split("\n## ")
    rows = re.findall(r"^\| (`.*?) \|", table, re.MULTILINE)
    rooms = []
    for row in rows:
        rooms += re.findall(r"`(\w+)(?:/|\.py)`", row)
    return rooms


def _imported(path: Path) -> Iterator[str]:
    """The modules of the package that a file imports, also within its functions."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names if one.name in MODULES)
        if not isinstance(node, ast.ImportFrom) or node.module not in MODULES:
            continue
        for one in node.names:
            module = f"{node.module}.{one.name}"
            yield module if module in MODULES else node.module


def _room(module: str) -> str:
    """The room of a module."""
    return module.split(".")[1]


def arrows() -> list[tuple[str, str]]:
    """Which module imports which other one."""
    arrows = []
    for name, path in MODULES.items():
        if name in ENDS:
            continue
        for other in set(_imported(path)) - ENDS:
            arrows.append((name, other))
    return sorted(arrows)


def test_every_module_has_its_room_in_the_document() -> None:
    rooms = _rooms()
    assert len(rooms) == len(set(rooms))
    assert {_room(name) for name in MODULES if name not in ENDS} == set(rooms)


def test_a_room_imports_from_those_below_it() -> None:
    rooms = _rooms()
    upward = []
    for name, other in arrows():
        if rooms.index(_room(other)) > rooms.index(_room(name)):
            upward.append(f"{name} imports {other}")
    assert upward == []


def reached(start: str, graph: dict[str, set[str]]) -> set[str]:
    """The modules that a module imports, directly or through others."""
    found: set[str] = set()
    todo = [start]
    while todo:
        for other in graph.get(todo.pop(), ()):
            if other not in found:
                found.add(other)
                todo.append(other)
    return found


def test_no_module_of_the_core_imports_a_guest() -> None:
    guests = set(GUESTS)
    rooms = _rooms()
    assert set(rooms[-len(GUESTS) :]) == guests, "they are the last of the document"
    inward = []
    for name, other in arrows():
        if _room(other) in guests and _room(name) not in guests:
            inward.append(f"{name} imports {other}")
    assert inward == []


def test_no_modules_import_each_other_in_a_circle() -> None:
    graph: dict[str, set[str]] = {}
    for name, other in arrows():
        graph.setdefault(name, set()).add(other)
    behind = {name: reached(name, graph) for name in graph}
    circles = []
    for name in graph:
        circle = {other for other in behind[name] if name in behind.get(other, ())}
        if circle and circle not in circles:
            circles.append(circle)
    assert circles == []


NAMES = {*METHODS, *MODELS, *SHAPES}
"""Names of threshold methods, flow models and shapes of beds, by their seams."""


def test_methods_models_and_shapes_are_asked_for_facts_and_never_for_their_names() -> (
    None
):
    compared = []
    for name, path in MODULES.items():
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(node, ast.Compare):
                continue
            words = [each for each in ast.walk(node) if isinstance(each, ast.Constant)]
            found = {str(each.value) for each in words} & NAMES
            if found:
                compared.append(f"{name}:{node.lineno} compares {', '.join(found)}")
    assert compared == []


def test_one_module_knows_the_code_that_moves_grains() -> None:
    code = "orchestrator.solvers.liggghts"
    knowing = {name for name, other in arrows() if other == code}
    # doctor says whether each program is installed
    assert knowing == {"orchestrator.solvers.dem", "orchestrator.solvers.doctor"}


def test_all_that_is_asked_of_the_code_that_moves_grains_is_listed() -> None:
    asked = set()
    for path in MODULES.values():
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(node, ast.Attribute):
                continue
            if isinstance(node.value, ast.Name) and node.value.id == "ENGINE":
                asked.add(node.attr)
    listed = set()
    for line in (dem.__doc__ or "").split("\n- ")[1:]:
        listed |= set(re.findall(r"``(\w+)``", line.partition(":")[0]))
    assert asked == listed
    assert all(hasattr(dem.ENGINE, name) for name in listed)
