"""The registry of figures: the files of a folder, and those of a guest."""

from dataclasses import replace
from pathlib import Path
from pkgutil import iter_modules

import pandas as pd
import pytest

from orchestrator.report import figures
from orchestrator.report.results import Results
from orchestrator.study import study

FILE = """
from orchestrator.report import style
from orchestrator.report.figures import FigureKind
from orchestrator.report.style import Figure

def draw(results):
    yield Figure("mine", "Mine", "A caption.", (), style.canvas(1.0))

FIGURE = FigureKind(order=-1, draws=draw, needs=("of_a_guest",))
"""


def test_every_file_of_the_folder_is_a_figure_with_a_place_of_its_own() -> None:
    found = figures.kinds()
    names = [module.name for module in iter_modules(figures.__path__)]
    assert len(found) == len(names) > 10
    orders = [kind.order for kind in found]
    assert orders == sorted(set(orders))


def test_a_file_of_a_guest_is_a_figure_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "figures_of_a_guest"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "mine.py").write_text(FILE)
    monkeypatch.syspath_prepend(tmp_path)
    first, *others = figures.kinds([package.name])
    assert others == figures.kinds()
    asked = study.parse("grain.diameter = 1e-3", name="one", where="test")
    results = Results(asked, None, {}, tmp_path)  # type: ignore[arg-type]
    assert list(first.draw(results)) == []
    table = pd.DataFrame({"value": [1.0]})
    (figure,) = first.draw(replace(results, tables={"of_a_guest": table}))
    assert (figure.name, figure.tables) == ("mine", ("of_a_guest",))
