"""No time decides a test, however slow a machine is or whatever else it has to do."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

TESTS = Path(__file__).parent
FILES = {str(path.relative_to(TESTS)): path for path in TESTS.rglob("*.py")}
LIMITS = {"timeout", "limit_s"}
"""Arguments that end what is waited for; `HANGS_S` is the one value for them."""


def _times_in(tree: ast.AST) -> Iterator[str]:
    """Lines with a sleep, or with a number as the limit of a wait."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            if ast.unparse(node.func).endswith("sleep"):
                yield f"{node.lineno}: {ast.unparse(node)}"
            given = [(word.arg, word.value) for word in node.keywords]
        elif isinstance(node, ast.Dict):
            given = [
                (_text(key), value)
                for key, value in zip(node.keys, node.values, strict=True)
            ]
        elif isinstance(node, ast.arguments):
            given = list(_defaults(node))
        else:
            continue
        for name, value in given:
            if name in LIMITS and isinstance(value, ast.Constant):
                yield f"{value.lineno}: {name} is {ast.unparse(value)}"


def _text(key: ast.expr | None) -> str | None:
    """The key of a dict, if it is a text."""
    if isinstance(key, ast.Constant) and isinstance(key.value, str):
        return key.value
    return None


def _defaults(arguments: ast.arguments) -> Iterator[tuple[str, ast.expr]]:
    """Arguments of a function with the values that they have by default."""
    named = [*arguments.posonlyargs, *arguments.args]
    first = len(named) - len(arguments.defaults)
    yield from zip((one.arg for one in named[first:]), arguments.defaults, strict=True)
    for one, value in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True):
        if value is not None:
            yield one.arg, value


@pytest.mark.parametrize("name", sorted(FILES.keys() - {"waiting.py"}))
def test_no_test_waits_for_a_time(name: str) -> None:
    assert list(_times_in(ast.parse(FILES[name].read_text("utf-8")))) == []


def test_no_example_has_a_deadline() -> None:
    assert settings().deadline is None
