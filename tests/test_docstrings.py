"""Docstrings: their examples run, and they describe what goes in and out."""

import ast
import dataclasses
import doctest
import inspect
import pkgutil
import re
import textwrap
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import orchestrator

PHYSICS = (
    "orchestrator.physics.fluids",
    "orchestrator.physics.gusts",
    "orchestrator.physics.cessation",
    "orchestrator.physics.curves",
    "orchestrator.physics.laws",
    "orchestrator.physics.measured",
    "orchestrator.physics.rebound",
    "orchestrator.physics.rolling",
    "orchestrator.physics.saltation",
    "orchestrator.physics.threshold",
    "orchestrator.physics.velocity",
)
"""Modules whose public functions have an example each."""


def _modules() -> list[str]:
    """Names of all modules of the package that can be imported."""
    found = pkgutil.walk_packages(orchestrator.__path__, "orchestrator.")
    return [module.name for module in found if not module.name.endswith("__main__")]


@pytest.mark.parametrize("name", _modules())
def test_the_examples_of_a_module_are_right(name: str) -> None:
    assert doctest.testmod(import_module(name)).failed == 0


def _is_own(thing: Any, module: ModuleType) -> bool:
    return getattr(thing, "__module__", "") == module.__name__


def _public(name: str) -> Iterator[Any]:
    """The public functions, classes and methods that a module defines."""
    module = import_module(name)
    for key, thing in vars(module).items():
        if key.startswith("_") or not _is_own(thing, module):
            continue
        if inspect.isfunction(thing) or inspect.isclass(thing):
            yield thing
        if inspect.isclass(thing):
            yield from _methods(thing)


def _methods(owner: type) -> Iterator[Any]:
    """The public methods of a class, but for those whose base class describes them."""
    inherited = {key for base in owner.__mro__[1:] for key in vars(base)}
    for key, thing in vars(owner).items():
        function = getattr(thing, "__func__", thing)
        is_method = inspect.isfunction(function)
        if is_method and not key.startswith("_") and key not in inherited:
            yield function


def _sections(thing: Any) -> dict[str, str]:
    """The sections of a docstring, by their titles."""
    text = inspect.getdoc(thing) or ""
    parts = re.split(r"^(\w+)\n-+$", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def _described(section: str) -> set[str]:
    """The names that a section of parameters or attributes describes."""
    lines = re.findall(r"^\*{0,2}(\w[\w, ]*)$", section, flags=re.MULTILINE)
    return {name for line in lines for name in line.split(", ")}


def _fields(owner: type) -> set[str]:
    """The public fields of a data class or of a named tuple."""
    if dataclasses.is_dataclass(owner):
        names = [field.name for field in dataclasses.fields(owner)]
    else:
        names = list(getattr(owner, "_fields", ()))
    return {name for name in names if not name.startswith("_")}


@cache
def _classes() -> set[str]:
    """Names of the classes of the package, which describe themselves."""
    files = Path(orchestrator.__path__[0]).rglob("*.py")
    trees = [ast.parse(file.read_text("utf-8")) for file in files]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    return {node.name for node in nodes if isinstance(node, ast.ClassDef)}


def _is_of_package(parameter: inspect.Parameter) -> bool:
    """Whether a parameter is annotated with a class of the package alone."""
    kind = parameter.annotation
    return (
        kind if isinstance(kind, str) else getattr(kind, "__name__", "")
    ) in _classes()


def _raises(function: Any) -> bool:
    """Whether the body of a function raises an exception by name."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    raised = [node.exc for node in ast.walk(tree) if isinstance(node, ast.Raise)]
    return any(isinstance(error, ast.Call) for error in raised)


@pytest.mark.parametrize("name", _modules())
def test_docstrings_describe_what_goes_in_and_out(name: str) -> None:
    for thing in _public(name):
        where = f"{name}: {thing.__qualname__}"
        sections = _sections(thing)
        assert thing.__doc__, where
        parameters_and_fields = ("Parameters", "Attributes")
        texts = [sections.get(title, "") for title in parameters_and_fields]
        described = _described("".join(texts))
        if inspect.isclass(thing):
            assert described >= _fields(thing), where
            continue
        signature = inspect.signature(thing)
        parameters = dict(signature.parameters)
        for key in ("self", "cls"):
            parameters.pop(key, None)
        # what is described where its class is needs no second description
        is_told = all(map(_is_of_package, parameters.values()))
        if "Parameters" in sections or not is_told:
            assert described >= {key.lstrip("*") for key in parameters}, where
        if signature.return_annotation not in (None, "None"):
            assert {"Returns", "Yields"} & sections.keys(), where
        if _raises(thing):
            assert "Raises" in sections, where


@pytest.mark.parametrize("name", PHYSICS)
def test_each_function_of_the_physics_has_an_example(name: str) -> None:
    for thing in _public(name):
        is_function = "." not in thing.__qualname__ and inspect.isfunction(thing)
        assert not is_function or ">>>" in (thing.__doc__ or ""), thing.__qualname__
