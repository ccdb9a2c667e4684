"""The page over several studies."""

from pathlib import Path

import pytest

import orchestrator
from orchestrator import gallery, tables
from orchestrator.errors import OrchestratorError
from orchestrator.runs.files import Folder

GRAIN = "grain = { diameter = 1e-3 }\nprotocol = { method = 'pivot' }\n"


@pytest.fixture
def studies(tmp_path: Path) -> Path:
    """A directory with two finished studies."""
    for name in ("one", "two"):
        (tmp_path / "study.toml").write_text(f"title = '{name}'\n{GRAIN}")
        orchestrator.run(tmp_path / "study.toml", out=tmp_path / "all" / name)
    return tmp_path / "all"


def test_a_page_of_the_users_is_kept(studies: Path) -> None:
    (studies / gallery.NAME).write_text("mine")
    with pytest.warns(UserWarning, match=f"kept as kept/{gallery.NAME}"):
        gallery.write(studies)
    assert (studies / "kept" / gallery.NAME).read_text() == "mine"
    before = (studies / gallery.NAME).read_bytes()
    gallery.write(studies)
    assert (studies / gallery.NAME).read_bytes() == before
    assert [path.name for path in (studies / "kept").iterdir()] == [gallery.NAME]


@pytest.mark.parametrize("column", ["usable", "alpha_deg", "answered_method"])
def test_a_study_of_another_version_costs_its_own_sentences(studies: Path, column: str) -> None:
    found = orchestrator.open(studies / "one").tables
    older = {name: table.drop(columns=column, errors="ignore") for name, table in found.items()}
    tables.write(older, Folder(studies / "one"), "tables")
    with pytest.raises(OrchestratorError, match="another version of this program"):
        _ = orchestrator.open(studies / "one").answer
    html = gallery.write(studies).read_text(encoding="utf-8")
    assert html.count("<article>") == 2
    assert html.count("another version of this program wrote them") == 1
    assert html.count("One grain of 1 mm on 0° starts to move at u* ") == 1
