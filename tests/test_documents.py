"""Documents that must follow the code: the citation, and the links between pages."""

import ast
import copy
import re
import runpy
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import nbclient
import nbformat
import numpy as np
import pandas as pd
import pytest
from PIL import Image

import orchestrator
from orchestrator import __version__, cli, plan, tables
from orchestrator.physics import beside
from orchestrator.report.results import Results
from orchestrator.stockpile import erosion
from orchestrator.study import study
from orchestrator.study.parts import PileBed
from tests.conftest import Command
from tests.waiting import HANGS_S

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted(ROOT.glob("*/*/README.md")),
    *sorted(ROOT.glob("templates/*/*/README.md")),
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
]


def test_the_citation_and_the_index_follow() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"(?m)^version: (.+)$", text) == [__version__]
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    pages = sorted(path.name for path in (ROOT / "docs").glob("*.md"))
    assert [name for name in pages if f"({name})" not in index] == ["README.md"]


def test_the_index_has_every_page_that_a_page_links() -> None:
    """A link to a page that the site lacks stops `make docs`."""
    index = ROOT / "docs" / "README.md"
    listed = {ROOT / "README.md", index, *_linked(index)}
    pages = [page for page in PAGES if not page.is_relative_to(ROOT / "orchestrator")]
    found = {goal for page in pages for goal in _linked(page)}
    assert sorted(found - listed) == []
    assert sorted(set(pages) - listed) == []


def test_the_page_of_commands_has_every_command_and_preset() -> None:
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    names = [command.name for command in cli.commands()]
    assert [name for name in names if f"| `{name}" not in text] == []
    presets = {path.stem for path in (ROOT / "orchestrator").glob("*/presets/*.toml")}
    _, listed = text.split("## Presets")
    named = {
        name
        for row in re.findall(r"(?m)^\| (`.+?) \|", listed)
        for name in re.findall(r"`([\w-]+)`", row)
    }
    assert presets == named - {"erosion"}


@pytest.mark.parametrize("name", ["columns", "paper"])
def test_a_page_is_written_from_the_program(name: str) -> None:
    page = ROOT / "docs" / f"{name}.md"
    written = runpy.run_path(str(page.with_suffix(".py")))["text"]()
    assert page.read_text(encoding="utf-8") == written


def test_tables_of_pages_are_those_of_their_measurements() -> None:
    for name, page, function in (
        ("errors", "ladder", "tables"),
        ("budget", "budget", "table"),
        ("maps", "stability", "table"),
    ):
        tool = runpy.run_path(str(ROOT / "tools" / f"{name}.py"))
        text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
        assert tool["BEGIN"] + tool[function]() + tool["END"] in text
    tool = runpy.run_path(str(ROOT / "tools" / "validation.py"))
    for page, blocks in tool["BLOCKS"].items():
        text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
        for name, made in blocks.items():
            assert tool["begin"](name) + made() + tool["END"] in text, (page, name)


def test_the_page_of_maps_counts_the_stored_verdicts() -> None:
    text = (ROOT / "docs" / "stability.md").read_text(encoding="utf-8")
    stored = pd.read_csv(ROOT / "orchestrator/fidelity/calibration/maps.csv")
    head, _ = text.split("## What a study says")
    rows = re.findall(r"(?m)^\| [^|]+ \| (\d+) \| (\d+) \| (\d+) \| ", head)
    good, wrong, noticed = np.array(rows, int).sum(axis=0)
    is_good = stored["verdict"] == "good"
    assert good == is_good.sum()
    assert noticed == stored["caught"].sum()
    assert wrong == (~is_good & ~stored["caught"]).sum()
    assert f"{stored['map'].nunique()} maps" in text.replace("seventeen", "17")
    assert f"with {len(stored)} cells in all" in text


def test_the_gallery_shows_presets_with_small_pictures() -> None:
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    presets = {path.stem for path in (ROOT / "orchestrator").glob("*/presets/*.toml")}
    shown = re.findall(r"(?m)^## ([\w-]+)$", text)
    assert len(shown) > 10
    assert set(shown) <= presets
    # and what another command makes of a preset
    others = dict(re.findall(r"(?m)^## ([\w-]+) of ([\w-]+)$", text))
    assert set(others.values()) <= presets
    for preset in (*shown, *others):
        picture = ROOT / "docs" / "figures" / f"gallery-{preset}.png"
        assert f"(figures/{picture.name})" in text
        assert picture.stat().st_size < 100_000


def _linked(page: Path) -> set[Path]:
    """The pages that a page links."""
    text = page.read_text(encoding="utf-8")
    names = re.findall(r"\]\(([^)#:\s]+\.md)(?:#[^)\s]*)?\)", text)
    return {(page.parent / name).resolve() for name in names}


def test_the_page_of_functions_has_every_module_of_the_physics() -> None:
    text = (ROOT / "docs" / "functions.md").read_text(encoding="utf-8")
    listed = re.findall(r"(?m)^\| `(orchestrator[.\w]*)` \|", text)
    assert [name for name in listed if not import_module(name).__doc__] == []
    modules = {path.stem for path in (ROOT / "orchestrator/physics").glob("[a-z]*.py")}
    # numbers alone, and the columns of tables
    modules -= {"constants", "beside"}
    assert modules <= {name.rpartition(".")[2] for name in listed}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(
        r"\]\(([^)#:\s]*)(#[^)\s]*)?\)", page.read_text(encoding="utf-8")
    )
    for target, anchor in links:
        goal = page.parent / target if target else page
        assert goal.exists(), target
        if anchor:
            titles = re.findall(r"(?m)^#+ (.+)$", goal.read_text(encoding="utf-8"))
            # the anchors that GitHub gives headings
            anchors = [
                re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
                for title in titles
            ]
            assert anchor[1:] in anchors, anchor


def test_every_page_says_where_to_go_next() -> None:
    """The tables of study-file.md and the index are made or are lists themselves."""
    pages = [page for page in PAGES if page.parent.name == "docs"]
    ends = [page for page in pages if page.name not in ("README.md", "study-file.md")]
    missing = [
        page.name
        for page in ends
        if "## Where to go next" not in page.read_text(encoding="utf-8")
    ]
    assert not missing


# words that the glossary has another word for, and the word
INSTEAD = {
    r"fast to accurate": "by cost",
    r"quiet time": "waiting time",
    r"fidelity levels?": "fidelity",
    r"every level, keeps": "fidelity",
    r"add up by their squares": "combine as the root of the sum of their squares",
    r"level rows": "horizontal rows",
    r"all levels share": "all methods share",
    r"Shields stress": "Shields number",
    r"aligned rows": "rows along the slope",
    r"\bdear(er|est)?\b": "costly",
    r"grains? that go(es)? on": "sustained motion",
    r"lea(ves|ving) (its|their) pockets? and go": "entrained and sustained",
    r"pull of the flow": "friction velocity",
    r"[Tt]hreshold Shields": "critical Shields number",
    r"of (its|their) like\b": "identical grains",
    r"differ in chance": "replicates",
    r"[Hh]ollow": "open (marker)",
    r"[Ww]hat qualifies": "caveats",
    r"row.hold\b": "interlocking",
    r"\bload levels?\b": "load step",
}


def _texts(module: Path) -> Iterator[str]:
    """The texts of a module that are no docstrings: messages, labels, captions."""
    tree = ast.parse(module.read_text(encoding="utf-8"))
    docstrings = {
        id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)
    }
    for node in ast.walk(tree):
        if not isinstance(node, ast.Constant) or id(node) in docstrings:
            continue
        if isinstance(node.value, str):
            yield node.value


def test_messages_and_figures_use_the_words_of_the_glossary() -> None:
    package = ROOT / "orchestrator"
    texts: list[str] = []
    for module in package.rglob("*.py"):
        texts += _texts(module)
    for name in ("*.j2", "texts.toml", "claims.toml", "fidelities.toml"):
        texts += [path.read_text("utf-8") for path in package.rglob(name)]
    assert len(texts) > 5000
    for text in texts:
        plain = " ".join(text.split())
        assert [word for word in INSTEAD if re.search(word, plain)] == [], plain[:200]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_page_uses_the_words_of_the_glossary(page: Path) -> None:
    text = " ".join(page.read_text(encoding="utf-8").split())
    assert [word for word in INSTEAD if re.search(word, text)] == []


def test_columns_and_fields_use_the_words_of_the_glossary() -> None:
    for column, meaning in tables.meanings().items():
        assert [word for word in INSTEAD if re.search(word, meaning)] == [], column


def test_the_glossary_has_the_words_that_pages_use() -> None:
    text = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    words = ["method", "fidelity", "reference", "core-s", "deck", "floor", "preset"]
    words += ["digest", "criterion", "answer card", "engine", "interlocking"]
    words += ["protocol", "level", "row", "aligned", "sustained motion", "replicates"]
    assert [word for word in words if f"| {word} |" not in text] == []


def test_the_first_picture_is_of_the_preset_that_make_study_runs() -> None:
    drawn = (ROOT / "docs" / "first-look.svg").read_text(encoding="utf-8")
    piles = plan.make(study.load("first-look")).piles.values()
    shown = max(piles, key=lambda pile: pile.scene.grain.diameter)
    grains = drawn[drawn.index('class="grains"') :].count("<circle")
    assert grains == shown.packing.mobile.sum()
    assert f"α = {shown.scene.bed.slope_deg:g}°, d = 1 mm" in drawn


@pytest.mark.long
def test_the_notebook_says_what_a_run_of_it_says(tmp_path: Path) -> None:
    written = nbformat.read(ROOT / "docs" / "example.ipynb", 4)  # type: ignore[no-untyped-call]
    again = copy.deepcopy(written)
    place = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(
        again,
        resources=place,
        kernel_name="python3",
        startup_timeout=int(HANGS_S),
        iopub_timeout=int(HANGS_S),
    ).execute()
    assert _said(again) == _said(written)
    assert "Grains of 0.2 mm to 0.5 mm, a slope of 10°" in " ".join(_said(again))
    rows = orchestrator.open(tmp_path / "dune").thresholds
    exact = rows["ustar_closed_form_m_s"]
    assert ((rows["ustar_low_m_s"] <= exact) & (exact <= rows["ustar_high_m_s"])).all()
    assert "<svg" in (tmp_path / "shields.svg").read_text(encoding="utf-8")


def _said(notebook: Any) -> list[str]:
    """What a notebook prints and what its tables hold, but for paths and progress."""
    outputs = [one for cell in notebook.cells for one in cell.get("outputs", [])]
    said = [one["text"] for one in outputs if one.get("name") == "stdout"]
    tables = [one["data"] for one in outputs if one["output_type"] == "execute_result"]
    return said + [one["text/plain"] for one in tables if "text/html" in one]


def test_every_how_to_names_studies_that_are_accepted(tmp_path: Path) -> None:
    for page in ("mars.md", "first-study.md"):
        text = (ROOT / "docs" / page).read_text(encoding="utf-8")
        for number, block in enumerate(re.findall(r"(?s)```toml\n(.*?)```", text)):
            file = tmp_path / f"{page}-{number}.toml"
            file.write_text(block, encoding="utf-8")
            assert plan.make(study.load(str(file))).decisions


@pytest.mark.long
@pytest.mark.parametrize("page", ["beach", "water", "dune", "stockpile"])
def test_a_question_is_answered_as_its_page_says(
    page: str, tmp_path: Path, orchestrator: Command
) -> None:
    """From the study file to the picture; the question "my solver" is that of the benchmark."""
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    name, block = re.findall(r"(?s)`([\w-]+\.toml)`.*?```toml\n(.*?)```", text)[0]
    (tmp_path / name).write_text(block, encoding="utf-8")
    command, said = re.findall(rf"(?s)orchestrator (\w+ {name}[^\n]*)\n(.*?)```", text)[
        0
    ]
    assert orchestrator(*command.split()).stdout.replace(str(tmp_path), "…") == said


def test_the_script_of_a_flow_shows_the_pile(results: Results, tmp_path: Path) -> None:
    text = (ROOT / "docs" / "paraview.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"(?s)```python\n(.*?)```", text)
    (tmp_path / "look.py").write_text(script, encoding="utf-8")
    (flow,) = results.cases.glob("flow-*")
    words = [sys.executable, "look.py", str(flow)]
    ended = subprocess.run(
        words, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert re.fullmatch(r"\d+ cells, fastest \d+\.\d+ m/s\n", ended.stdout)
    with Image.open(tmp_path / "flow.png") as picture:
        white = (np.asarray(picture.convert("RGB")) == 255).all(axis=2)
    # the first row of each column that is not air: the bed
    ground = np.where(white.any(axis=0), white.argmax(axis=0), len(white))
    is_pile = ground < ground.max() - 5
    assert np.ptp(ground) > 0.1 * len(white)
    assert is_pile.mean() > 0.3


def test_the_page_on_intervals_names_the_strips_that_were_tested() -> None:
    strips = pd.read_csv(beside.STRIPS)
    page = (ROOT / "docs" / "how-sure.md").read_text(encoding="utf-8")
    tested = {}
    for name in ("poured_depth", "width", "phi_deg", "mobile_layers", "fraction"):
        # the ends are a hundredth from what was tested
        (tested[name],) = set((strips[f"{name}_low"] + strips[f"{name}_high"]).div(2))
    assert f"`poured_depth = {tested['poured_depth']:g}`" in page
    assert f"`width = {tested['width']:g}`" in page
    assert f"φ = {tested['phi_deg']:g}°" in page
    (sigma,) = set(strips["sizes"].str.extract(r"sigma_g ([\d.]+),", expand=False))
    assert f"σ_g = {sigma}" in page
    assert tested["mobile_layers"] == pytest.approx(4)
    assert tested["fraction"] == pytest.approx(0.1)
    assert "four mobile layers" in page
    assert "n/N = 10 %" in page
    default = PileBed.model_fields["poured_depth"].default
    assert f"of the default {default:g} none was tested" in page


def test_the_page_on_stockpiles_has_every_material() -> None:
    page = (ROOT / "docs" / "stockpile.md").read_text(encoding="utf-8")
    words = " ".join(page.split())
    assert [name for name in erosion.USTAR_T if f"`{name}`" not in words] == []


def test_pages_say_what_is_not_answered() -> None:
    """The words that people look for; what stands there is read by a person."""
    for name, words in {
        "questions.md": ["bends", "bank slopes", "turbulence that structures"],
        "own-profile.md": ["A fence is solid", "porosity"],
        "paper.md": ["Figs. 15 and 16", "Eq. 10", "wall stress"],
    }.items():
        page = (ROOT / "docs" / name).read_text(encoding="utf-8")
        assert [word for word in words if word not in page] == []
