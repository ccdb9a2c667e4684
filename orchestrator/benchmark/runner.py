"""A solver on the scenes of a pack: each in a process of its own, watched, ours in turn."""

import fnmatch
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from orchestrator.benchmark import pack, report, variants
from orchestrator.benchmark.answer import FILE
from orchestrator.benchmark.ours import Ours, Took
from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.problem import csv
from orchestrator.benchmark.report import Found
from orchestrator.benchmark.solver import Solver, split
from orchestrator.benchmark.verdict import OURS, USED, compared
from orchestrator.benchmark.watch import Watch
from orchestrator.errors import InputError
from orchestrator.runs import confined, workspace
from orchestrator.runs.confined import Limits, Used
from orchestrator.runs.files import Folder, text_of

LOG = "log.txt"


@dataclass(frozen=True)
class Choice:
    """Which scenes of a pack: of some levels, by patterns of names; empty for all."""

    levels: Sequence[int] = ()
    patterns: Sequence[str] = ()

    def of(self, chosen: Pack) -> list[str]:
        """Their names.

        Raises
        ------
        InputError
            If there are none.
        """
        found = [name for name, told in chosen.scenes.items() if self._has(name, told["level"])]
        if not found:
            raise InputError(
                "no scene of the pack is chosen",
                where=str(chosen.root),
                remedy="see its scenes.csv, and --level and --scene",
            )
        return found

    def _has(self, name: str, level: int) -> bool:
        named = not self.patterns or any(fnmatch.fnmatchcase(name, p) for p in self.patterns)
        return named and (not self.levels or level in self.levels)


def compare(root: Path, results: Sequence[Path], out: Path | None, choice: Choice) -> Found:
    """Compare answers that are there with a pack; write one page of all solvers.

    Parameters
    ----------
    root : Path
        The pack.
    results : sequence of Path
        A directory for each solver, which is named by it: ``RESULTS/SCENE/answer.csv``.
    out : Path or None
        Where page and tables go; by default where `run` left the only results, else `usual`.
    choice : Choice
        Which scenes.

    Raises
    ------
    InputError
        If the pack or a directory cannot be used, or two have one name.
    """
    chosen = pack.read(root.absolute())
    names = choice.of(chosen)
    for one in results:
        if not one.is_dir():
            raise InputError("there is no such directory", where=str(one), remedy="name another")
    _check_names([one.absolute().name for one in results])
    made = [_made(one) for one in results]
    alone = results[0] if len(results) == 1 and made[0] else usual(root)
    place = out or alone
    same = place.absolute() == results[0].absolute() and bool(made[0])
    kind = workspace.RESULTS if same else workspace.COMPARISON
    name = made[0]["name"] if same else chosen.root.name
    contenders = [compared(chosen, names, one) for one in results]
    notes = [
        _note(one.name, told.get("hidden")) for one, told in zip(contenders, made, strict=True)
    ]
    _check_apart(place.absolute(), chosen)
    with workspace.claimed(place, kind, name) as folder:
        return report.write(chosen, contenders, folder, notes)


def _made(results: Path) -> dict[str, Any]:
    """The notes of `run` in its results; empty for results of something else."""
    told = workspace.read_marker(results, workspace.RESULTS)
    return told if told and told["kind"] == workspace.RESULTS.word else {}


def usual(root: Path) -> Path:
    """Where results go if nobody says where."""
    return Path("results") / f"benchmark-{root.absolute().name}"


def _check_names(names: Sequence[str]) -> None:
    """See that no two solvers, nor one and ours, have one name."""
    twice = next((name for name in names if [OURS, *names].count(name) > 1), None)
    if twice is not None:
        raise InputError(
            f"two solvers have the name {twice}",
            where="RESULTS",
            remedy="name each directory of results after its solver",
        )


def _check_apart(out: Path, chosen: Pack) -> None:
    if out.resolve().is_relative_to(chosen.root.resolve()):
        raise InputError("the results may not lie in the pack", where=str(out), remedy="use --out")


def run(root: Path, command: str, out: Path | None, choice: Choice, limits: Limits) -> Found:
    """Run a solver on scenes of a pack, ours in turn, compare, and write the page.

    Parameters
    ----------
    root : Path
        The pack.
    command : str
        The solver's, with ``{case}`` and ``{out}``; it is split as a shell would, but no shell
        reads it.
    out : Path or None
        Where the results go; by default `usual`.
    choice : Choice
        Which scenes.
    limits : Limits
        What the solver may take for a scene.

    Raises
    ------
    InputError
        If the pack, the command or the directory cannot be used.
    """
    chosen = pack.read(root.absolute())
    names = choice.of(chosen)
    out = (out or usual(root)).absolute()
    _check_names([out.name])
    _check_apart(out, chosen)
    solver = Solver(split(command), limits, _secrets(chosen, out))
    ours = Ours(chosen, out / OURS / "cases")
    ours.check(names)
    with workspace.claimed(out, workspace.RESULTS, command) as folder:
        _check_answers(folder, chosen)
        ours.root.mkdir(parents=True, exist_ok=True)  # no link is on the way: the claim has looked
        note = _note(out.name, confined.hides())
        print(note, file=sys.stderr, flush=True)
        watch = Watch(chosen, folder)
        again = variants.drawn(chosen.scenes, names)
        for number, name in enumerate(names, 1):
            print(f"{number}/{len(names)} {name}", file=sys.stderr, flush=True)
            _attempt(name, solver, folder, watch, again=name in again)
            _answer_ours(name, ours, folder, watch)
        chosen.verify()
        return report.write(chosen, [compared(chosen, names, out)], folder, [note])


def _secrets(chosen: Pack, out: Path) -> list[Path]:
    """The pack, the results, and what else holds answers beside them or the working directory."""
    here = Path.cwd()
    places = (chosen.root.parent, out.parent, here, here / "results", here / "packs")
    beside = (path for place in places if place.is_dir() for path in place.iterdir())
    known = {
        path.resolve()
        for path in beside
        if any(workspace.read_marker(path, kind) for kind in workspace.KINDS)
    }
    found = known | {chosen.root.resolve(), out.resolve()}
    # what lies in another is hidden with it
    return sorted(path for path in found if found.isdisjoint(path.parents))


def _note(name: str, hidden: bool | None) -> str:
    """Notes on the surroundings in which a solver answered."""
    if hidden is None:
        return f"{name}: nothing is known of how its answers were made."
    if hidden:
        return (
            f"{name} ran without sight of the pack, of these results, and of the packs, studies and"
            " results beside them."
        )
    return (
        f"{name} could see the pack with its expected answers: this system lets no program run"
        " without sight of a directory (no user namespaces)."
    )


def _check_answers(folder: Folder, chosen: Pack) -> None:
    """See that a directory holds answers to this pack or none, and say so in its marker."""
    told = _made(folder.root)
    if told.get("pack", chosen.digest) != chosen.digest:
        raise InputError(
            "the directory holds answers to another pack, or to this one before it was exported"
            " again",
            where=str(folder.root),
            remedy="choose another with --out, or remove it",
        )
    about = {**told, "pack": chosen.digest, "hidden": confined.hides()}
    folder.note(workspace.RESULTS.marker, text_of(about))


def _attempt(name: str, solver: Solver, folder: Folder, watch: Watch, *, again: bool) -> None:
    """Run the solver on one scene; what it took, or why it failed, is in its directory.

    It may be asked `again`, with other numbers.

    Raises
    ------
    InputError
        If it changed the pack.
    """
    place = f"{name}/{FILE}"
    watch.forget(place)
    own = folder.clear(name, {FILE, LOG, USED}.__contains__)
    own.mkdir()
    solved = solver.solve(watch.pack.directory(name), own / LOG)
    error = solved.error
    if solved.answer is not None:
        watch.keep(place, solved.answer)
        if again and not error:
            error = _known_by_heart(watch.pack, name, solver, solved.answer)
    harm, other = watch.harm(), watch.restored()
    error = harm or other or error
    folder.note(f"{name}/{USED}", text_of({**_known(solved.used), "error": error}))
    if harm:
        raise InputError(
            f"{name}: {harm}: the pack is not used further",
            where=str(watch.pack.root),
            remedy="export it again",
        )


def _known_by_heart(chosen: Pack, name: str, solver: Solver, given: bytes) -> str:
    """Why right answers to a scene are no answers: they are wrong where its numbers differ."""
    expected = chosen.expected[chosen.expected["scene"] == name]
    problem = variants.variant(chosen.scenes[name])
    if problem is None or variants.wrong(
        expected, given
    ):  # of what is wrong the verdict tells more
        return ""
    with tempfile.TemporaryDirectory() as place:
        problem.write(Path(place) / "scene")
        solved = solver.solve(Path(place) / "scene", Path(place) / LOG)
    wrong = solved.error or variants.wrong(problem.expected, solved.answer or b"")
    changed = variants.changes(chosen.scenes[name], problem.parameters)
    return f"it fails the same scene with {changed}: {wrong}" if wrong else ""


def _answer_ours(name: str, ours: Ours, folder: Folder, watch: Watch) -> None:
    table, took = ours.answer(name)
    watch.forget(f"{OURS}/{name}/{FILE}")
    folder.clear(f"{OURS}/{name}", {FILE, USED}.__contains__)
    watch.keep(f"{OURS}/{name}/{FILE}", csv(table).encode())
    folder.note(f"{OURS}/{name}/{USED}", text_of(_known(took)))


def _known(used: Used | Took) -> dict[str, Any]:
    return {name: value for name, value in asdict(used).items() if value == value}
