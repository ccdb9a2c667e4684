"""The check of answers without DEM: it is the answer of the same scene by DEM."""

from pathlib import Path

import pandas as pd
import pytest

from orchestrator.tables.check import KEYS
from tests import small_study

PILE = """
tolerance = 0.2
grain = {{ diameter = 1e-3, density = {density} }}
bed = {{ kind = "pile", slope_deg = 15.0, height = 0.01 }}
method.grains = {{ load_increment = 0.03, waiting_time = 6.0 }}
{fluid}
[[group]]
[group.axes]
"bed.height" = [0.01, 0.012, 0.014]
"""
"""A pile alone is not checked: that would cost more than the answer saves."""
FLUIDS = {
    "the paper's": "",
    "water": 'fluid.kind = "water"',
    "air": 'fluid.kind = "air"',
    "water, grains that leave": """
fluid.kind = "water"
threshold.criterion = "entrained"
""",
}


@pytest.mark.parametrize("fluid", FLUIDS.values(), ids=FLUIDS)
def test_the_check_is_the_answer_of_the_same_scene_by_dem(
    tmp_path: Path, fluid: str
) -> None:
    """To the digit: it has the same criterion, and is read from the same case."""
    # numerical errors were measured on grains of 2,500 times the density of that gas
    text = PILE.format(fluid=fluid, density=2650.0 if fluid else 2500.0)
    checked = small_study.run(tmp_path, text).tables
    check = checked["check"].set_index("fraction")
    assert check["scene_id"].nunique() == 1
    asked = text.replace("tolerance = 0.2", 'method.kind = "dem"')
    by_dem = small_study.run(tmp_path, asked).tables["pile_threshold"]
    by_dem = by_dem[by_dem["case"].isin(check["case"])].set_index("fraction")
    same = {"shields_dem": "shields", "case": "case"}
    for name, of_answer in same.items():
        pd.testing.assert_series_equal(
            check[name], by_dem[of_answer], check_exact=True, check_names=False
        )
    # what is checked is the answer of the study, and both agree on such a pile
    answers = checked["pile_threshold"]
    answers = answers[answers["scene_id"].isin(check["scene_id"])].reset_index()
    pd.testing.assert_frame_equal(
        check.reset_index()[[*KEYS, "shields"]], answers[[*KEYS, "shields"]]
    )
    assert check["agree"].all()
    assert answers["usable"].all()
