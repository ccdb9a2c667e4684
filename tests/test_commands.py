"""The commands in the documents: the program, `make` or a script takes each of them.

A command is a line of a block of code, or a span of code in the text, that begins with
the program (`orchestrator`, `python -m orchestrator`), `python`, `make` or `sh`. A span
may also begin with a command of the program and more words, such as `study FILE`. In a
command

- `[A]` may be left out and is read as A, and `[A or B]` as A,
- `…` and `...` repeat what stands before them,
- a word in capitals stands for a value, and is the name that `--help` gives to it,
- what follows `>` or `#` is no part of it.

A name of the program alone is no command, nor is, in the text, a command of the program
with nothing or with names of its options alone: these must exist.
"""

import argparse
import ast
import contextlib
import io
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Collection, Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from orchestrator import cli
from orchestrator.benchmark.pack import MANIFEST
from orchestrator.study.source import presets

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted(ROOT.glob("examples/**/README.md")),
    *sorted(ROOT.glob("benchmark/*/README.md")),
    *sorted(ROOT.glob("templates/*/*/README.md")),
]
FENCE = re.compile(r"(?ms)^```(\w*)\n(.*?)^```$")
INDENTED = re.compile(r"(?m)(?:^ {4}.*\n)+")
SPAN = re.compile(r"(?s)(?<!`)`([^`]+)`(?!`)")
PARAGRAPH = re.compile(r"\n\s*\n|\n(?=[|#-])")
PYTHON = ("python", "python3", ".venv/bin/python")
PROGRAM = re.compile(rf"({'|'.join(PYTHON)}|orchestrator|make|sh)\s")
PLACEHOLDER = re.compile(r"[A-Z]+")
SCRIPTS = [
    str(path.relative_to(ROOT))
    for name in ("docs", "tools")
    for path in (ROOT / name).glob("*.py")
]
REPEATED = re.compile(r"\s(\.\.\.|…)(?=[\s\]]|$)")


class Said(NamedTuple):
    """A command of a page: its text, what surrounds it, and what is shown below it."""

    page: Path
    text: str
    around: str
    shown: tuple[str, ...] = ()
    in_text: bool = False

    @property
    def words(self) -> list[str]:
        """The words, without those that may be left out in other commands."""
        plain = REPEATED.sub("", self.text.partition(" > ")[0])
        plain = re.sub(r"\[(\S+) or [^]]+\]", r"\1", plain)
        words = shlex.split(re.sub(r"[][]", "", plain), comments=True)
        if words[0] in PYTHON and words[1:3] == ["-m", "orchestrator"]:
            return ["orchestrator", *words[3:]]
        return ["python", *words[1:]] if words[0] in PYTHON else words

    @property
    def is_whole(self) -> bool:
        """Whether it runs as it stands."""
        return not any(map(PLACEHOLDER.fullmatch, self.words))

    @property
    def files(self) -> dict[str, str]:
        """The files of the page, and of those that are linked beside the command."""
        linked = re.findall(r"\]\(([^)#:\s]+\.md)[^)]*\)", self.around)
        pages = [self.page.parent / name for name in linked]
        return {
            name: text
            for page in (*pages, self.page)
            for name, text in files(page).items()
        }

    @property
    def is_name(self) -> bool:
        """Whether it names, in the text, a command of the program or options of one."""
        if not self.in_text or self.words[0] != "orchestrator":
            return False
        _, rest = command_of(self.words[1:])
        return all(word.startswith("--") for word in rest)


def commands(page: Path, text: str = "") -> Iterator[Said]:
    """The commands of a page, or of a text that is taken for it."""
    text = text or page.read_text(encoding="utf-8")
    prose = FENCE.sub("", text)
    blocks = [block[2] for block in FENCE.finditer(text)]
    blocks += [re.sub("(?m)^ {4}", "", block[0]) for block in INDENTED.finditer(prose)]
    found = [one for block in blocks for one in _of_block(page, block)]
    found += [one for part in PARAGRAPH.split(prose) for one in _of_text(page, part)]
    return (one for one in found if PROGRAM.match(one.text) and one.words[1:])


def _of_block(page: Path, block: str) -> Iterator[Said]:
    """The lines of a block of code, each with those that follow before the next prompt."""
    lines = block.replace("\\\n", " ").splitlines()
    for number, line in enumerate(lines):
        shown: list[str] = []
        for after in lines[number + 1 :]:
            if after.startswith("$ "):
                break
            shown.append(after)
        yield Said(page, line.removeprefix("$ ").strip(), line, tuple(shown))


def _of_text(page: Path, paragraph: str) -> Iterator[Said]:
    """The spans of code of a paragraph, with the program's name before its commands."""
    for span in SPAN.findall(paragraph):
        text = " ".join(span.split())
        first, _, rest = text.partition(" ")
        if first in parts(taking_placeholders()) and rest and not rest.startswith("="):
            text = f"orchestrator {text}"
        yield Said(page, text, paragraph, in_text=True)


def parts(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of the commands of a parser, by their names."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    return {}


@cache
def taking_placeholders() -> argparse.ArgumentParser:
    """The program's parser, which takes for a value also its name in `--help`."""
    made = cli.parser()
    _take_placeholders(made)
    return made


def _take_placeholders(parser: argparse.ArgumentParser) -> None:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction) or action.nargs == 0:
            continue
        names = PLACEHOLDER.findall(str(action.metavar))
        action.type = _or_placeholder(action.type, names)
        if action.choices is not None:
            action.choices = [*action.choices, *names]
    for part in parts(parser).values():
        _take_placeholders(part)


def command_of(words: list[str]) -> tuple[argparse.ArgumentParser, list[str]]:
    """The parser of a command or of a part of one, and the words behind its name."""
    parser = taking_placeholders()
    while words and words[0] in parts(parser):
        parser, words = parts(parser)[words[0]], words[1:]
    return parser, words


def _or_placeholder(read: Any, names: list[str]) -> Callable[[str], object]:
    """Read a value, or one of its names."""

    def reads(text: str) -> object:
        if not PLACEHOLDER.fullmatch(text):
            return read(text) if read else text
        if text not in names:
            what = f"{text} stands for a value that is named {' or '.join(names)}"
            raise argparse.ArgumentTypeError(what)
        return text

    return reads


def fault(said: Said) -> str:
    """What is wrong with a command; nothing where it would be taken."""
    program, *words = said.words
    checks = {"orchestrator": _of_program, "python": _of_python, "make": _of_make}
    return checks.get(program, _of_shell)(words, said)


def _of_program(words: list[str], said: Said) -> str:
    if said.is_name:
        parser, rest = command_of(words)
        options = parser._option_string_actions
        return ", ".join(f"no option {word}" for word in rest if word not in options)
    try:
        asked = parsed(words)
    except ValueError as error:
        return str(error)
    return _of_study(asked, said) or _of_benchmark(asked, said)


def parsed(words: list[str]) -> argparse.Namespace:
    """Parse words of a command; a ValueError has the message of a refusal."""
    message = io.StringIO()
    try:
        with contextlib.redirect_stderr(message):
            return taking_placeholders().parse_args(words)
    except SystemExit as ended:
        raise ValueError(message.getvalue().splitlines()[-1]) from ended


def _of_study(asked: argparse.Namespace, said: Said) -> str:
    """A study is a preset, a file of the repository, or one of the page or of a linked one."""
    source = getattr(asked, "source", "FILE")
    if PLACEHOLDER.fullmatch(source) or source in presets():
        return ""
    if (ROOT / source).is_file() or source in said.files:
        return ""
    return f"no study {source}"


def _of_benchmark(asked: argparse.Namespace, said: Said) -> str:
    """A pack lies in the repository or is exported on the page; so is a solver's script."""
    pack = str(getattr(asked, "pack", "PACK"))
    text = said.page.read_text(encoding="utf-8")
    is_there = PLACEHOLDER.fullmatch(pack) or (ROOT / pack / MANIFEST).is_file()
    if not is_there and f"benchmark export {pack}" not in text:
        return f"no pack {pack}"
    solver = Said(said.page, getattr(asked, "solver", ""), said.around)
    return fault(solver) if PROGRAM.match(solver.text) else ""


def _of_python(words: list[str], said: Said) -> str:
    """A module that can be imported, or a script with as many arguments as it says."""
    if words[0] == "-m":
        return "" if find_spec(words[1]) else f"no module {words[1]}"
    script, *given = words
    path = ROOT / script
    if not path.is_file():
        return "" if script in said.files else f"no script {script}"
    least, most = arguments(path)
    return "" if least <= len(given) <= most else f"{script} takes other arguments"


def arguments(script: Path) -> tuple[float, float]:
    """The least and the largest number of arguments, by the docstring of a script."""
    name = script.relative_to(ROOT)
    text = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    form = re.search(rf"python3? {re.escape(str(name))}([^`>\n]*)", text)
    if not form:
        return 0, inf
    all_words = re.sub(r"[][.]", "", form[1]).split()
    needed = re.sub(r"\[.*\]", "", form[1]).split()
    return len(needed), inf if "..." in form[1] else len(all_words)


def _of_make(words: list[str], said: Said) -> str:
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"(?m)^([a-z-]+):", text))
    asked = {word for word in words if "=" not in word}
    return ", ".join(f"no target {name}" for name in sorted(asked - targets))


def _of_shell(words: list[str], said: Said) -> str:
    return "" if (ROOT / words[0]).is_file() else f"no script {words[0]}"


@cache
def files(page: Path) -> dict[str, str]:
    """The files that stand on a page whole, by the name that was last said before each."""
    text = page.read_text(encoding="utf-8")
    found: dict[str, str] = {}
    for block in FENCE.finditer(text):
        suffix = {"toml": "toml", "python": "py"}.get(block[1])
        names = re.findall(rf"`([\w-]+\.{suffix})`", text[: block.start()])
        if names:
            found.setdefault(names[-1], block[2])
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_commands_of_a_page_are_taken(page: Path) -> None:
    wrong = [(said.text, fault(said)) for said in commands(page)]
    assert [each for each in wrong if each[1]] == []


def test_commands_are_found() -> None:
    found = [said for page in PAGES for said in commands(page)]
    programs = [said.words[0] for said in found]
    assert {name: programs.count(name) > 2 for name in programs} == dict.fromkeys(
        ("orchestrator", "python", "make", "sh"), True
    )
    text = (ROOT / "docs" / "threshold.md").read_text(encoding="utf-8")
    assert len(re.findall(r"(?m)^(?:\$ )?orchestrator ", text)) == len(
        [said for said in commands(ROOT / "docs" / "threshold.md") if not said.in_text]
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("`orchestrator studdy sand.toml`", "invalid choice"),
        ("`orchestrator study first-lok`", "no study first-lok"),
        ("`study nowhere.toml --plan`", "no study nowhere.toml"),
        ("`study FILE --plans`", "no option --plans"),
        ("`threshold --bed-slopes`", "no option --bed-slopes"),
        ("`status DIRECTORY`", "named DIR"),
        ("`benchmark run benchmark/smal --solver ./mine`", "no pack"),
        ("`benchmark run PACK --solver 'python3 examples/no.py {case}'`", "no script"),
        ("```\n$ orchestrator threshold --fluid air\n```\n", "--diameter"),
        ("```sh\npython -m orchestrator study FILE --workers many\n```\n", "--workers"),
        ("    .venv/bin/python -m orchestrator stats DIR\n", "invalid choice"),
        ("`python docs/measure_flow.py`", "takes other arguments"),
        ("`python tools/errors.py DIRECTORY`", "takes other arguments"),
        ("`python tools/eror.py`", "no script"),
        ("`python -m tests.recipe`", "no module"),
        ("`make tests`", "no target tests"),
        ("`sh tools/bar.sh DIRECTORY`", "no script"),
    ],
)
def test_a_wrong_command_is_found(text: str, message: str) -> None:
    (said,) = commands(ROOT / "README.md", text)
    assert message in fault(said)


def _whole(program: str, names: Collection[str]) -> list[Any]:
    """The commands of these names that run as they stand, each with a file once."""
    found = [said for page in PAGES for said in commands(page) if said.is_whole]
    whole = {
        tuple(said.files.get(word, word) for word in said.words): said for said in found
    }
    return [
        pytest.param(said, id=f"{said.page.relative_to(ROOT)}: {said.text}")
        for said in whole.values()
        if said.words[0] == program and said.words[1] in names and not said.is_name
    ]


@pytest.mark.parametrize("said", _whole("orchestrator", ["threshold"]))
def test_a_threshold_of_a_page_is_computed_or_refused_there(
    said: Said, capsys: pytest.CaptureFixture[str]
) -> None:
    code = cli.main(said.words[1:])
    printed = capsys.readouterr()
    if code:
        assert printed.err.splitlines()[-1] in said.shown
    else:
        assert printed.out.strip()


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory with the files of the repository and the raster of docs/surface.md."""
    monkeypatch.chdir(tmp_path)
    for name in ("benchmark", "docs", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    runpy.run_path(str(ROOT / "tools" / "heap.py"))["write"](tmp_path)
    return tmp_path


def _planned() -> list[str]:
    """The commands that can say what they would run."""
    made = parts(taking_placeholders())
    return [
        name for name, part in made.items() if "--plan" in part._option_string_actions
    ]


@pytest.mark.long
@pytest.mark.parametrize("said", _whole("orchestrator", _planned()))
def test_a_study_of_a_page_is_planned(
    said: Said, reader: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, text in said.files.items():
        (reader / name).write_text(text, encoding="utf-8")
    words = [word for word in said.words[1:] if word != "--plan"]
    assert cli.main([*words, "--plan"]) == 0
    assert "expected: about" in capsys.readouterr().out
    assert not (reader / "results").exists()


@pytest.mark.long
@pytest.mark.parametrize("name", _planned())
def test_a_command_says_what_it_would_run_on_its_own_scenes(
    name: str, reader: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pages name the experiments without a study, too."""
    needed = [
        action.dest
        for action in parts(taking_placeholders())[name]._actions
        if action.required
    ]
    source = ["first-look"] if "source" in needed else []
    assert cli.main([name, *source, "--plan"]) == 0
    assert "expected: about" in capsys.readouterr().out
    assert not (reader / "results").exists()


FINISHED = ("status", "report", "gallery", "prune")
"""Commands on results that are there."""


@pytest.mark.long
@pytest.mark.parametrize("name", FINISHED)
def test_a_command_of_a_page_on_a_finished_study_ends_well(
    name: str, finished_pile: Path, tmp_path: Path
) -> None:
    shutil.copytree(finished_pile, tmp_path / "results" / "pile")
    found = [said for page in PAGES for said in commands(page)]
    asked = {tuple(each.words[2:]) for each in found if each.words[1] == name}
    given = {tuple(word for word in words if word.startswith("--")) for words in asked}
    assert given
    folder = tmp_path / "results" / ("" if name == "gallery" else "pile")
    movie = tmp_path / "grains.gif"
    for options in given:
        values = [str(movie)] if options[-1:] == ("--movie",) else []
        assert cli.main([name, str(folder), *options, *values]) == 0
    if name == "report":
        assert movie.read_bytes().startswith(b"GIF8")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of this checkout, which scripts may write into."""
    ignored = shutil.ignore_patterns("__pycache__")
    for part in ("docs", "orchestrator", "templates", "tools"):
        shutil.copytree(ROOT / part, tmp_path / part, ignore=ignored)
    return tmp_path


@pytest.mark.long
@pytest.mark.parametrize("said", _whole("python", SCRIPTS))
def test_a_script_of_a_page_runs_and_changes_no_page(
    said: Said, checkout: Path
) -> None:
    script = [sys.executable, *said.words[1:]]
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    run = subprocess.run(
        script, cwd=checkout, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    _, _, redirected = said.text.partition(" > ")
    if redirected:
        assert (ROOT / redirected).read_text(encoding="utf-8") == run.stdout
    for page in (ROOT / "docs").glob("*.md"):
        assert (checkout / "docs" / page.name).read_bytes() == page.read_bytes()


def _uses(script: Path) -> Iterator[tuple[str, str]]:
    """The names of this package that a script takes from its modules."""
    tree = ast.parse(script.read_text(encoding="utf-8"))
    modules: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            modules |= {one.asname or one.name: one.name for one in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            for one in node.names:
                yield node.module, one.name
                modules[one.asname or one.name] = f"{node.module}.{one.name}"
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            module = modules.get(node.value.id, "")
            if module.startswith("orchestrator") and _is_module(module):
                yield module, node.attr


def _is_module(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ModuleNotFoundError:
        return False  # a name of a module that is no package


def _missing(script: Path) -> list[str]:
    """The names that a script takes from modules of this package that have no such."""
    used = {
        each for each in _uses(script) if each[0].partition(".")[0] == "orchestrator"
    }
    return [
        f"{module}.{name}"
        for module, name in sorted(used)
        if not hasattr(import_module(module), name)
        and not _is_module(f"{module}.{name}")
    ]


@pytest.mark.parametrize(
    "script",
    [
        path
        for name in ("docs", "examples", "tools")
        for path in sorted((ROOT / name).rglob("*.py"))
    ],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_a_script_takes_names_that_the_package_has(script: Path) -> None:
    """Scripts that take hours fail where they first use a name that is gone."""
    assert _missing(script) == []


def test_a_name_that_is_gone_is_found(tmp_path: Path) -> None:
    script = tmp_path / "one.py"
    script.write_text(
        "from orchestrator.runs import case, engine\n"
        "from orchestrator.digits import text, nothing\n"
        "import numpy as np\n"
        "def late():\n    np.gone()\n    engine.run()\n    return case.is_done\n",
        encoding="utf-8",
    )
    assert _missing(script) == [
        "orchestrator.digits.nothing",
        "orchestrator.runs.case.is_done",
    ]
