"""One answer on every processor: two studies in processes that use less of this one.

The libraries choose their code by the processor. Settings in the environment take
vector units away from numpy and OpenBLAS, and from the C library, in the process and in
all that it starts, as on an older processor. Everything that a study leaves but its
`OWN` files is then the same byte for byte.
"""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.runs.case import CHECKSUMS, IDENTITY
from tests.waiting import HANGS_S

ROOT = Path(__file__).parents[1]
POURED = """
title = "Small poured beds"
fluid = { density = 1000.0, viscosity = 1e-6 }
grain = { diameter = 1e-3, density = 2650.0 }

[bed]
kind = "pile"
shape = "flat"
packing = "poured"
poured_depth = 3.0

[threshold]
fractions = [0.1, 0.3]

[method]
kind = "dem"

[method.flow]
model = "flat"

[method.grains]
stiffness = 1e3
mobile_layers = 2
load_increment = 0.05
waiting_time = 6.0
time_step = 0.3
final_fraction = 0.5

[[group]]
name = "pile under its flow"
grain = { sizes = { sigma_g = 1.2 } }
bed = { shape = "triangle", slope_deg = 15.0, height = 0.006 }
method.flow = { model = "solve", cells_per_face = 20 }

[[group]]
name = "mixture"
grain = { sizes = [[5e-4, 0.3], [1e-3, 0.4], [2e-3, 0.3]] }
bed = { length = 0.02 }

[[group]]
name = "strip"
grain = { sizes = { sigma_g = 1.2 } }
bed = { length = 0.005, width = 5.0 }
method.grains.mobile_layers = 1
"""
OWN = {
    "cases/*/done.json": "has the times that the run took, and those of its files",
    "report.json": "the same of the page",
    "timings/*": "tables of times",
    "cases/*/log.*": "logs of the solvers tell times and the machine",
    "written.sha256": "has digests of the files above",
    "cases/flow-*/[1-9]*/*": "fields of the flow, whose last digits may differ; every "
    "number that is made of them is rounded, and compared here",
}
"""Files that a run has for itself, by pattern, each with the reason."""
FULL = "as it is"
LESS: dict[str, dict[str, str]] = {
    "numpy and OpenBLAS of an old processor": {
        "NPY_DISABLE_CPU_FEATURES": " ".join(
            np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
        ),
        "OPENBLAS_CORETYPE": "Nehalem",
    },
    "C library of an old processor": {
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F"
    },
}
"""Environments with less of the processor.

The C library, of versions 2.33 and later, knows its features by these names; it has
code of its own for AVX-512 in string functions alone.
"""
SETTINGS = {FULL: {}, **LESS}
PROBE = """
import hashlib, json, math
import numpy as np
import numpy.linalg
values = np.linspace(-30, 30, 20001)
singles = values.astype(np.float32)
# numpy has code of its own for single precision with AVX2, for double with AVX-512
vectorised = (np.sin(values) + np.exp(values), np.sin(singles) + np.exp(singles))
library = [(math.sin(x), math.exp(x)) for x in values.tolist()]
print(json.dumps({
    "features": np.show_config(mode="dicts")["SIMD Extensions"].get("found", []),
    "numpy": hashlib.sha256(b"".join(x.tobytes() for x in vectorised)).hexdigest(),
    "library": hashlib.sha256(repr(library).encode()).hexdigest(),
}))
"""


def _has_units() -> bool:
    """Whether this processor has the vector units that the settings take away."""
    about = Path("/proc/cpuinfo").read_text()
    return {"avx2", "fma"} <= set(about.split())


pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        not _has_units(), reason="this processor has neither AVX2 nor FMA to leave out"
    ),
]


def _run(setting: str, *arguments: str) -> "subprocess.CompletedProcess[str]":
    """Run Python in a process of its own with one of the `SETTINGS`."""
    names = {name for changed in LESS.values() for name in changed}
    inherited = {name: text for name, text in os.environ.items() if name not in names}
    return subprocess.run(
        [sys.executable, *arguments],
        # pages have a date, but for this
        env={
            **inherited,
            "PYTHONPATH": str(ROOT),
            "SOURCE_DATE_EPOCH": "1767225600",
            **SETTINGS[setting],
        },
        capture_output=True,
        text=True,
        timeout=HANGS_S,
    )


def _probed(setting: str) -> dict[str, Any]:
    """What a process with a setting finds, and digests of what it computes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OPENBLAS_VERBOSE", "2")
        ended = _run(setting, "-c", PROBE)
    assert ended.returncode == 0, ended.stderr
    return {**json.loads(ended.stdout), "openblas": ended.stderr}


def test_each_setting_takes_units_away_from_what_it_is_for() -> None:
    numpy, library = LESS
    found = {setting: _probed(setting) for setting in SETTINGS}
    assert found[FULL]["features"]
    assert not found[numpy]["features"]
    assert found[numpy]["numpy"] != found[FULL]["numpy"]
    assert "Core: Nehalem" in found[numpy]["openblas"]
    assert "Core: Nehalem" not in found[FULL]["openblas"]
    assert found[library]["library"] != found[FULL]["library"]


def _files(out: Path) -> dict[str, str]:
    """Digests of the files of a study that are the same on every processor."""
    digests = {}
    for path in sorted(out.rglob("*")):
        name = path.relative_to(out).as_posix()
        if path.is_file() and not any(fnmatchcase(name, own) for own in OWN):
            digests[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return digests


def _answer(printed: str, out: Path) -> str:
    """What the command printed, but for the place of the page."""
    return printed.replace(str(out), "")


def _differing(some: Mapping[str, str], others: Mapping[str, str]) -> list[str]:
    """Names of the files that are in one study alone, or have another content."""
    names = some.keys() | others.keys()
    return sorted(name for name in names if some.get(name) != others.get(name))


@pytest.mark.parametrize(
    ("study", "kinds"),
    [
        ("first-look", {"cells", "flow", "pile"}),
        ("poured.toml", {"flow", "pile", "poured"}),
    ],
)
def test_a_study_is_the_same_byte_for_byte_on_other_processors(
    tmp_path: Path, study: str, kinds: set[str]
) -> None:
    """Single grains, a flow and a lattice; a poured pile, a mixture and a strip.

    Pouring is chaotic: one other last digit of one number in an input, and the tables
    are of another bed.
    """
    source = study
    if study != "first-look":
        source = str(tmp_path / study)
        Path(source).write_text(POURED)
    found, answers = {}, {}
    for number, setting in enumerate(SETTINGS):
        out = tmp_path / f"out-{number}"
        ended = _run(setting, "-m", "orchestrator", "study", source, "--out", str(out))
        assert ended.returncode == 0, ended.stderr
        found[setting], answers[setting] = _files(out), _answer(ended.stdout, out)
    names = [Path(name) for name in found[FULL]]
    assert {
        name.parts[1].partition("-")[0] for name in names if name.name == IDENTITY
    } == (kinds)
    assert sum(name.name == CHECKSUMS for name in names) >= 3
    assert sum(name.parts[0] == "tables" for name in names) > 3
    for setting in LESS:
        assert _differing(found[FULL], found[setting]) == [], setting
        assert answers[setting] == answers[FULL]
    page = (tmp_path / "out-0" / "report.html").read_text(encoding="utf-8")
    assert "2026-01-01 00:00 UTC" in page


RANGES = {
    "water": ("--diameter", "5e-5:2e-2:400"),
    "air": ("--diameter", "5e-5:5e-3:300", "--criterion", "sustained"),
}
"""Ranges of single grains, by fluid: of 700 rows the last digits of some differ."""


@pytest.mark.parametrize("form", ["--csv", "--json"])
@pytest.mark.parametrize("fluid", RANGES)
def test_thresholds_of_single_grains_are_the_same_bytes_on_other_processors(
    fluid: str, form: str
) -> None:
    command = ["threshold", "--fluid", fluid, "--density", "2650", *RANGES[fluid]]
    printed = {}
    for setting in SETTINGS:
        ended = _run(setting, "-m", "orchestrator", *command, form)
        assert ended.returncode == 0, ended.stderr
        printed[setting] = ended.stdout
    assert printed[FULL].count("\n") > 300
    for setting in LESS:
        assert printed[setting] == printed[FULL], setting
