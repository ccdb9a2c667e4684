"""Bars of the factors over the naive route."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from orchestrator.experiments.ladder import gains


def test_bars_are_the_factors_gained() -> None:
    routes = pd.DataFrame(
        [("naive", 86400.0, True), ("soft", 864.0, False), ("lost", np.nan, False)],
        columns=["route", "core_s", "extrapolated"],
    )
    (ax,) = gains.draw(routes).axes
    naive, soft = (bar for bar in ax.patches if isinstance(bar, Rectangle))
    assert soft.get_x() + soft.get_width() == pytest.approx(100)
    assert naive.get_width() == pytest.approx(0)
    assert [bar.get_hatch() is not None for bar in (naive, soft)] == [True, False]
    assert [text.get_text().strip() for text in ax.texts] == [
        "1 × (24 h)", "100 × (14 min)", "not measured",
    ]  # fmt: skip
    assert [label.get_text() for label in ax.get_yticklabels()] == ["naive", "soft", "lost"]
    (ax,) = gains.draw(routes.assign(core_s=np.nan)).axes
    assert {text.get_text().strip() for text in ax.texts} == {"not measured"}


@pytest.mark.parametrize(
    ("seconds", "written"),
    [(0.123, "0.12 s"), (89, "89 s"), (5400, "1.5 h"), (2e5, "2.3 days"), (4.1e8, "13 years")],
)
def test_a_duration_has_the_unit_that_suits_it(seconds: float, written: str) -> None:
    assert gains.duration(seconds) == written
