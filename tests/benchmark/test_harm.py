"""Answers, files and processes that no solver should leave: each is named, and the run goes on."""

import re
from pathlib import Path

import pytest

from orchestrator.benchmark import answer
from orchestrator.benchmark.answer import AnswerError
from orchestrator.benchmark.runner import Choice
from orchestrator.benchmark.solver import Solved, Solver, split
from orchestrator.runs import confined
from orchestrator.runs.confined import Limits
from tests.benchmark.programs import SMALL, program, run, verdicts_in

pytestmark = pytest.mark.usefixtures("nothing_left")
ANSWERS = {
    "a huge file": ("out.open('wb').truncate(30 * 2**20)", "answer.csv has 30 MiB, more than 4"),
    "a huge line": (
        "out.write_text('quantity,at,value\\n' + 'a' * 3 * 2**20 + '\\n')",
        "field larger than field limit",
    ),
    "many lines": (
        "out.write_text('quantity,at,value\\n' + 'a,,1\\n' * 500_000)",
        "answers a twice",
    ),
    "zeros": ("out.write_bytes(b'quantity,at,value\\n' + bytes(99))", "is no table|of 3 fields"),
    "a link": ("out.symlink_to('/etc/passwd')", "it is a link"),
    "a link to nothing": ("out.symlink_to('nowhere')", "it is a link"),
    "a device": ("out.symlink_to('/dev/zero')", "it is a link"),
    "a pipe": ("os.mkfifo(out)", "answer.csv is no file"),
    "a directory": ("out.mkdir()", "answer.csv is no file"),
    "a closed file": ("out.write_text(''); out.chmod(0)", "answer.csv is empty|cannot be read"),
    "its directory gone": (
        "import shutil; shutil.rmtree(out.parent)",
        "it changed the files of its case",
    ),
    "its case a link": (
        "solver.main(case, out)\nimport shutil; shutil.rmtree(case); case.symlink_to('/')",
        "it changed the files of its case",
    ),
    "a huge case": (
        "os.truncate(case / 'scene.json', 30 * 2**20)",
        "it changed the files of its case",
    ),
    "a closed directory": ("(case / 'more').mkdir(); (case / 'more').chmod(0)", "its case"),
    "a pipe in its case": ("os.mkfifo(case / 'more')", "its case"),
    "deep": (
        "for _ in range(900): os.mkdir('a'); os.chdir('a')",
        "it wrote no answer.csv",
    ),
    "a core": ("os.abort()", "it ended with -6"),
    "a signal to all": ("os.kill(-1, 9)", "it ended with 1: ProcessLookupError"),
    "no stdout": ("os.close(1); os.close(2); sys.exit(9)", "it ended with 9"),
    "prints": ("while True: print('y' * 4096)", "printed more than 4 MiB"),
    "memory": ("b = bytes([1]) * 10**9", "more than 400 MiB of memory|MemoryError"),
    "disk": (
        "for i in range(9): open(str(i), 'w').write('x' * 9 * 2**20)\ntime.sleep(9)",
        "its files took more than 32 MiB",
    ),
    "files of memory": (
        "for i in range(40):\n    os.write(os.memfd_create(str(i)), bytes(2**20))\ntime.sleep(9)",
        "its files took more than 32 MiB",
    ),
    "files without a name": (
        "for i in range(40):\n    os.write(os.open('f', 66), bytes(2**20)); os.unlink('f')\n"
        "time.sleep(9)",
        "its files took more than 32 MiB",
    ),
    "threads": (
        "import threading\nfor _ in range(700):\n"
        "    threading.Thread(target=time.sleep, args=(9,), daemon=True).start()\ntime.sleep(9)",
        "more than 640 threads",
    ),
    "forks": (
        "for _ in range(99): os.fork() or time.sleep(9)\ntime.sleep(9)",
        "more than 40 processes",
    ),
    "sleeps": ("signal = __import__('signal'); signal.signal(15, signal.SIG_IGN); time.sleep(99)",
               "did not end within 2 s"),
}  # fmt: skip


def _solved(pack: Path, folder: Path, body: str, limits: Limits = SMALL) -> Solved:
    """What comes of a scene for a solver that means harm."""
    one = Solver(split(program(folder, body)), limits, [pack.resolve()])
    return one.solve(pack / "scenes" / "2-incline-5", folder / "log")


@pytest.mark.parametrize("name", ANSWERS)
@pytest.mark.parametrize("walled", [True, False])
def test_harm_is_named(
    formulas: Path, tmp_path: Path, name: str, walled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not walled:
        monkeypatch.setattr(confined, "hides", lambda: False)
        if name == "a signal to all":
            pytest.skip("without walls it would end every process of its user")
    body, message = ANSWERS[name]
    solved = _solved(formulas, tmp_path, body, SMALL if name != "sleeps" else Limits(seconds=2.0))
    assert re.search(message, solved.error or _wrong(solved.answer)), solved


def _wrong(given: bytes | None) -> str:
    with pytest.raises(AnswerError) as caught:
        answer.parsed(given or b"")
    return str(caught.value)


def test_a_run_goes_on_after_harm(
    formulas: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    harms = {
        "2-incline-5": "print(chr(27) + '[2J'); sys.exit(1)",
        "2-incline-45": "import shutil; shutil.rmtree(out.parent)",
        "2-incline-60": "out.mkdir()",
        "2-incline-70": "out.symlink_to('/dev/zero')",
        "2-incline-75": "out.write_bytes(bytes(99))",
    }
    body = f"harm = {harms!r}.get(solver.json.loads((case / 'scene.json').read_text())['scene'])"
    body += "\nif harm:\n    exec(harm)\nelse:\n    solver.main(case, out)\n"
    found = run(formulas, tmp_path, body, Choice(patterns=("2-incline-*",)))
    assert set(verdicts_in(tmp_path).query("passed").index) == {"2-incline-20"}
    assert "\x1b" not in "".join(found.failures)
    assert "\x1b" not in found.page.read_text()
