"""Programs that answer oddly, or not at all, when they are asked what they are."""

import os
import stat
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from orchestrator.errors import SolverError
from orchestrator.runs import program
from orchestrator.solvers import doctor, liggghts, openfoam

VERSIONS: dict[str, Callable[[], str]] = {
    "simpleFoam": openfoam.version.__wrapped__,
    "liggghts": liggghts.version.__wrapped__,
}
STATED = {
    "simpleFoam": "Using: OpenFOAM-v1912 (see www.OpenFOAM.com)",
    "liggghts": "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0)",
}
SAYING = {
    "letters that are no UTF-8": "printf '\\377\\376 \\300\\n'; echo '{stated}'",
    "a banner of megabytes after it": "echo '{stated}'; head -c 30000000 /dev/zero",
    "it on the other stream": "echo '{stated}' >&2",
    "it with a failure": "echo '{stated}'; exit 3",
    "it, and leaves a child with its streams": "sleep 1000 & echo '{stated}'",
}
SILENT = {
    "nothing": ("exit 0", "it ended with 0 and said nothing"),
    "nothing and fails": ("exit 4", "it ended with 4 and said nothing"),
    "no text": ("printf '\\377\\376\\000'; exit 1", "it ended with 1 and said "),
    "megabytes of nothing": ("yes x", "said “x”"),
    "a library that is missing": (
        "echo '$0: error while loading shared libraries: libnone.so' >&2; echo; exit 127",
        "it ended with 127 and said “$0: error while loading shared libraries: libnone.so”",
    ),
    "its death": ("kill -SEGV $$", "it was killed by SIGSEGV and said nothing"),
}


@pytest.fixture(params=VERSIONS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def put(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Put a program of a name in front of the real one."""

    def put(text: str, mode: int = 0o755) -> Path:
        path = tmp_path / name
        path.write_text(text)
        path.chmod(mode)
        monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
        return path

    return put


@pytest.mark.parametrize("how", SAYING)
def test_a_version_is_heard_through_all_else(put: Callable[..., Path], name: str, how: str) -> None:
    put("#!/bin/sh\n" + SAYING[how].format(stated=STATED[name]) + "\n")
    assert VERSIONS[name]() in STATED[name]


@pytest.mark.parametrize("how", SILENT)
def test_a_program_that_says_no_version_is_quoted(
    put: Callable[..., Path], name: str, how: str
) -> None:
    script, told = SILENT[how]
    path = put(f"#!/bin/sh\n{script}\n")
    with pytest.raises(SolverError) as caught:
        VERSIONS[name]()
    assert str(caught.value).startswith(str(path))
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("no script", "#!"),
        ("#!/nowhere/sh\n", "interpreter"),
        ("", "#!"),
        ("\x7fELF of another machine", "machine"),
    ],
)
def test_a_program_that_does_not_start(
    put: Callable[..., Path], name: str, text: str, told: str
) -> None:
    path = put(text)
    with pytest.raises(SolverError, match=f"{path} does not start: .*{told}"):
        VERSIONS[name]()


def test_a_program_that_may_not_be_run(
    tmp_path: Path, put: Callable[..., Path], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = put("#!/bin/sh\n", mode=stat.S_IRUSR)
    monkeypatch.setenv("PATH", str(tmp_path))
    # OpenFOAM's other programs are looked for first
    for other in ("gmshToFoam", "setExprFields"):
        (tmp_path / other).symlink_to("/bin/true")
    with pytest.raises(SolverError, match=f"{path} may not be run .chmod"):
        VERSIONS[name]()


def test_a_program_that_hangs_is_killed_with_all_that_it_started(
    put: Callable[..., Path], name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(program, "LIMIT_S", 0.5)
    put(f"#!/bin/sh\ntrap '' TERM\nsleep 1000 &\necho $! >{tmp_path}/child\nwait\nsleep 1000\n")
    with pytest.raises(SolverError, match=r"did not end within 0\.5 s"):
        VERSIONS[name]()
    child = Path("/proc", (tmp_path / "child").read_text().strip(), "stat")
    for _ in range(100):
        if not child.exists() or child.read_text().rpartition(")")[2].split()[0] == "Z":
            return
        time.sleep(0.05)
    pytest.fail("its child lives")


def test_the_environment_of_another_openfoam_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WM_PROJECT_DIR", str(tmp_path))
    with pytest.raises(SolverError, match=f"WM_PROJECT_DIR is {tmp_path}, .*unset it"):
        VERSIONS["simpleFoam"]()
    monkeypatch.setenv("WM_PROJECT_DIR", "")
    assert VERSIONS["simpleFoam"]() in openfoam.TRIED


def test_the_doctor_reports_each_in_a_line(put: Callable[..., Path], name: str) -> None:
    put("#!/bin/sh\nprintf '\\377\\n\\376\\n'\nexit 1\n")
    openfoam.version.cache_clear()
    liggghts.version.cache_clear()
    findings = doctor.examine()
    assert sum(not finding.good for finding in findings) == 1
    assert len(doctor.text(findings).splitlines()) == len(findings)
