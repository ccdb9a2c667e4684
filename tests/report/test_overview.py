"""The one diagram of a study and the answer in words."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.report import shields, words
from orchestrator.report.results import Results
from tests.report.conftest import only


def test_every_point_says_its_scene_interval_and_case(results: Results) -> None:
    (figure,) = shields.draw(results)
    assert figure.canvas is not None
    (ax,) = figure.canvas.axes
    drawn = {line.get_gid(): line for line in ax.lines}
    said = [text for group in figure.data.values() for text in group]
    piles, grains = results.tables["pile_threshold"], results.tables["single_grain"]
    flat = grains[grains["alpha_deg"] == 0]
    assert len(said) == len(piles) + len(flat)
    for gid, group in figure.data.items():
        assert len(np.asarray(drawn[gid].get_xdata())) == len(group)
    for row in piles.to_dict("records"):
        value = f"τ_c = {row['shields']:.4g} ({row['shields_low']:.4g} … {row['shields_high']:.4g})"
        (text,) = [one for one in said if one[1].startswith(value)]
        assert text[0].startswith("α = 15°, d = 1 mm, z₀ = d/30")
        assert text[2:] == [row["why_not"], row["case"]]


def test_of_many_piles_one_fraction_is_drawn(results: Results) -> None:
    heap = only(results, "pile")
    scenes, found = heap.tables["scenes"], heap.tables["pile_threshold"]
    many = range(shields.FEW + 1)
    tables = {
        "scenes": pd.concat([scenes.assign(scene_id=f"{i}") for i in many]),
        "pile_threshold": pd.concat([found.assign(scene_id=f"{i}") for i in many]),
    }
    shown = shields.shown_piles(replace(results, tables={**heap.tables, **tables}))
    assert set(shown["fraction"]) == {0.3}
    assert len(shown) == len(many)
    assert len(shields.shown_piles(heap)) == len(found)


def test_a_study_of_single_grains_has_an_answer_too(results: Results) -> None:
    grains = only(results, "grain")
    said = words.sentences(grains)
    assert said[0].startswith("One grain of 0.05 mm on 0° starts to move at u* ")
    assert words.short(grains) is not None
    without = grains.tables["single_grain"].assign(answered_method="pivot", ustar_m_s=np.nan)
    exact = replace(grains, tables={**grains.tables, "single_grain": without})
    sheet = words.short(exact)
    assert sheet is not None
    (method,) = set(sheet["by"])
    assert method == "closed form"
    assert "One grain" in words.sentences(exact)[0]


def test_a_threshold_that_is_not_usable_says_so(results: Results) -> None:
    bad = results.tables["pile_threshold"].assign(usable=False, why_not="Re* 2 is below 30")
    changed = replace(results, tables={**results.tables, "pile_threshold": bad})
    first, *others = words.sentences(changed)
    assert first.endswith("(not usable: Re* 2 is below 30).")
    assert others[0] == "Usable: 0 of 4 thresholds."
    sheet = words.short(changed)
    assert sheet is not None
    assert set(sheet["usable"]) == {"no: Re* 2 is below 30"}


BROWSER = shutil.which("chromium")
PROBE = """<script>addEventListener("load", () => {
  const slider = document.querySelector("input[type=range]");
  slider.value = slider.max; slider.dispatchEvent(new Event("input"));
  const use = document.querySelector("#shields-0 use"), svg = use.ownerSVGElement;
  const at = new DOMPoint(+use.getAttribute("x"), +use.getAttribute("y"))
    .matrixTransform(svg.getScreenCTM());
  svg.dispatchEvent(new PointerEvent("pointermove", {clientX: at.x, clientY: at.y}));
  const figure = document.querySelector("figure svg").getBoundingClientRect();
  document.documentElement.dataset.top = Math.round(figure.top);
  document.documentElement.dataset.height = document.documentElement.scrollHeight;
  const folds = () => document.querySelectorAll("figcaption > details:not([open])").length;
  const closed = folds();
  dispatchEvent(new Event("beforeprint"));
  document.documentElement.dataset.printed = `${closed} ${folds()}`;
  dispatchEvent(new Event("afterprint"));
  document.documentElement.dataset.after = folds() === closed;
});</script>"""


@pytest.mark.skipif(not BROWSER, reason="no chromium here")
def test_in_a_browser_the_slider_moves_grains_and_a_point_answers(
    page: Path, results: Results, tmp_path: Path
) -> None:
    html = page.read_text(encoding="utf-8")
    # the policy lets no other script run: the probe comes without it
    start, end = html.index("<meta http-equiv"), html.index('<meta name="viewport"')
    (tmp_path / "page.html").write_text(html[:start] + PROBE + html[end:], encoding="utf-8")
    command = [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
               "--window-size=1280,900", f"--user-data-dir={tmp_path / 'profile'}",
               (tmp_path / "page.html").as_uri()]  # fmt: skip
    dom = subprocess.run(command, capture_output=True, text=True, timeout=120).stdout
    steps, moved = (results.tables["pile_curve"][name].max() for name in ("load_step", "moved"))
    assert f"load step {steps} of {steps}: " in dom
    assert f"n/N = {moved}/" in dom
    tip = dom[dom.index('<div class="tip"') :]
    assert "τ_c = " in tip[: tip.index("<script")]
    assert "hidden" not in tip[: tip.index(">")]
    closed, printed = map(int, dom.split('data-printed="')[1].split('"')[0].split())
    assert closed == html.count("<figcaption>")
    assert printed == 0
    assert 'data-after="true"' in dom
    top = int(dom.split('data-top="')[1].split('"')[0])
    assert top < 900
