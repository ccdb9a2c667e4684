"""The figures hold what the tables say: the axes' data, not their pixels."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.container import ErrorbarContainer
from matplotlib.lines import Line2D

from orchestrator.report import shields, style
from orchestrator.report.figures import (
    accuracy,
    bed,
    beds,
    fractions,
    hiding,
    one_grain,
    stress,
)
from orchestrator.report.figures import shields as overview
from orchestrator.report.results import Results
from orchestrator.report.style import Figure
from orchestrator.study import study
from tests.report.conftest import axes_of, changed, copies, only

LINE, SOLID, OPEN = shields.RESULT
Points = set[tuple[float, float]]


def pile_figures(results: Results) -> Iterator[Figure]:
    for figure in fractions.FIGURE.draw(results):
        if figure.name.startswith("fractions-alpha"):
            yield figure
    yield from beds.FIGURE.draw(results)


def single_figures(results: Results) -> Iterator[Figure]:
    yield from one_grain.FIGURE.draw(results)
    yield from accuracy.FIGURE.draw(results)


def drawn(figures: Iterable[Figure]) -> dict[str, list[Axes]]:
    return {figure.name: axes_of(figure) for figure in figures}


def marked(ax: Axes, *marks: str) -> list[Line2D]:
    return [line for line in ax.lines if line.get_gid() in marks]


def points(lines: Iterable[Line2D]) -> Points:
    xy = [np.asarray(line.get_xydata(), float) for line in lines]
    return {(float(x), float(y)) for x, y in np.concatenate([np.empty((0, 2)), *xy])}


def rows(table: pd.DataFrame, x: str, y: str) -> Points:
    return set(zip(table[x].tolist(), table[y].tolist(), strict=True))


@pytest.fixture(scope="module")
def grains(results: Results) -> dict[str, list[Axes]]:
    return drawn(single_figures(results))


@pytest.fixture(scope="module")
def heaps(results: Results) -> dict[str, list[Axes]]:
    return drawn(pile_figures(results))


def test_study_has_the_figures_of_its_beds(results: Results) -> None:
    names = {"dem-horizontal", "dem-slope-beta60", "accuracy"}
    one = only(results, "grain")
    assert {figure.name for figure in single_figures(one)} == names
    assert [figure.name for figure in overview.draw(one)] == [overview.NAME]
    assert list(pile_figures(one)) == list(stress.FIGURE.draw(one)) == []
    heap = only(results, "pile")
    assert list(single_figures(heap)) == []
    assert [figure.name for figure in pile_figures(heap)] == [
        "fractions-alpha15", "extended-shields-d30",
    ]  # fmt: skip


def test_points_of_single_grains_are_those_of_the_table(
    results: Results, grains: dict[str, list[Axes]]
) -> None:
    table = results.tables["single_grain"]
    flat = table[table["alpha_deg"] == 0]
    panels = dict(zip((0.033333333, 0.1), grains["dem-horizontal"], strict=True))
    for ratio, ax in panels.items():
        own = flat[flat["z0_over_d"] == ratio]
        assert len(own) > 10
        found = points(marked(ax, SOLID, OPEN))
        assert found == rows(own, "reynolds", "shields_dem")


def test_markers_are_open_exactly_where_a_threshold_is_not_usable(
    results: Results, grains: dict[str, list[Axes]]
) -> None:
    table = results.tables["single_grain"]
    table = table[(table["alpha_deg"] == 0) & (table["z0_over_d"] == 0.1)]
    transition = table[table["regime"] == "transition"]
    assert 0 < len(transition) < len(table)
    ax = grains["dem-horizontal"][1]
    # between the laws of the paper, and where measurements are more than 2 times off
    assert not transition["usable"].any()
    assert transition["usable"].count() < (~table["usable"]).sum()
    unusable = table[~table["usable"]]
    assert points(marked(ax, OPEN)) == rows(unusable, "reynolds", "shields_dem")
    for line in marked(ax, SOLID, OPEN):
        is_white = to_hex(line.get_markerfacecolor()) == "#ffffff"
        assert is_white == (line.get_gid() == OPEN)


def test_closed_form_lines_stop_where_they_do_not_hold(
    grains: dict[str, list[Axes]],
) -> None:
    lines = [line for ax in grains["dem-horizontal"] for line in marked(ax, LINE)]
    solid = np.concatenate(
        [line.get_xdata() for line in lines if line.get_linestyle() == "-"]
    )
    solid = solid[np.isfinite(solid)]
    assert ((solid < 3) | (solid >= 30)).all()
    assert solid.min() < 0.1
    assert solid.max() > 100
    assert {line.get_linestyle() for line in lines} == {"-", ":"}


def test_diagram_shows_the_transition(grains: dict[str, list[Axes]]) -> None:
    for ax in grains["dem-horizontal"]:
        (span,) = [patch for patch in ax.patches if patch.get_gid() == "transition"]
        assert span.get_extents().transformed(
            ax.transData.inverted()
        ).intervalx.tolist() == (pytest.approx([3, 30]))
        assert "transition" in [text.get_text() for text in ax.texts]
        assert ax.get_xscale() == ax.get_yscale() == "log"


def test_fractions_are_those_of_the_holds(
    results: Results, heaps: dict[str, list[Axes]]
) -> None:
    table = results.joined("pile_curve")
    moved = table[table["moved"] > 0]
    (ax,) = heaps["fractions-alpha15"]
    assert points(marked(ax, *moved["scene_id"])) == rows(
        moved, "shields", "fraction_moved"
    )
    assert ax.get_ylim() == (0, 1)


def test_captions_of_fractions_say_what_is_drawn(results: Results) -> None:
    of_stress, of_reynolds = (
        next(one for one in fractions.FIGURE.draw(results) if one.name.startswith(name))
        for name in ("fractions-alpha", "fractions-reynolds")
    )
    for figure, x in ((of_stress, "τ"), (of_reynolds, "Re*")):
        said = " ".join(figure.caption.split())
        assert f"n/N against {x} of the mean wall stress" in said
        # no range of these panels is shaded
        assert not [ax for ax in axes_of(figure) if ax.patches]
        assert "shaded" not in said
        assert "Between the two neither holds" in said


@pytest.mark.parametrize("others", [[], [{"stress": "wall", "d_m": 7e-4}]])
def test_piles_by_eq10_have_figures_of_their_own(
    results: Results, others: list[dict[str, object]]
) -> None:
    """Figs. 14 to 16 are by Eq. 10; those of the wall stress say that they are not."""
    both = copies(results, {"stress": "eq10"}, *others)
    table = both.tables["pile_threshold"]
    figures = [*pile_figures(both), *fractions.FIGURE.draw(both)]
    found = {figure.name: figure for figure in figures}
    stems = ["fractions-alpha15", "extended-shields-d30", "fractions-reynolds-alpha15"]
    names = [f"{stem}-eq10" for stem in stems]
    assert set(found) >= set(names)
    assert ({*stems} <= set(found)) == bool(others)
    for number, (stem, name) in enumerate(zip(stems, names, strict=True)):
        own = found[name]
        assert "stress of Eq. 10" in own.title
        assert "mean stress of Eq. 10" in " ".join(own.caption.split())
        assert own.follows == ["Fig. 14, right", "Fig. 16", "Fig. 14, left"][number]
        if others:
            assert "wall stress" in found[stem].title
            assert "mean wall stress" in " ".join(found[stem].caption.split())
            assert found[stem].follows == f"{own.follows}, by the wall stress"
    for name, scene in ((names[1], "copy 0"), (stems[1], "copy 1"))[: 1 + len(others)]:
        (ax,) = axes_of(found[name])
        own_rows = table[table["scene_id"] == scene]
        expected = rows(own_rows, "reynolds", "shields")
        assert points(marked(ax, SOLID, OPEN)) == expected


def test_extended_diagram_shows_each_fraction_that_was_reached(
    results: Results, heaps: dict[str, list[Axes]]
) -> None:
    table = results.tables["pile_threshold"]
    assert len(table) == 4
    (ax,) = heaps["extended-shields-d30"]
    assert points(marked(ax, SOLID)) == rows(table, "reynolds", "shields")
    assert marked(ax, LINE)
    lost = table.assign(shields=table["shields"].where(table["fraction"] < 0.5))
    (_, figure) = pile_figures(
        replace(results, tables={**results.tables, "pile_threshold": lost})
    )
    (ax,) = drawn([figure])["extended-shields-d30"]
    assert points(marked(ax, SOLID)) == rows(
        lost.dropna(subset=["shields"]), "reynolds", "shields"
    )


def test_friction_velocity_is_that_of_the_flow(results: Results) -> None:
    table = results.tables["wall_stress"]
    top, below = drawn(stress.FIGURE.draw(results))["wall-stress"]
    for name in stress.ESTIMATES:
        (line,) = marked(top, name)
        assert (
            np.asarray(line.get_ydata()).tolist()
            == table[f"ustar_over_ustar0_{name}"].tolist()
        )
        assert line.get_xdata() == pytest.approx(table["x_m"] / 0.01)
    (line,) = marked(below, "bed")
    assert np.max(line.get_ydata()) == pytest.approx(1, abs=0.05)
    assert [c for c in top.collections if c.get_gid() == "reversed flow"]


def test_closed_form_is_drawn_before_there_are_results(results: Results) -> None:
    none = {name: pd.DataFrame() for name in results.tables}
    asked = {name: results.tables[name] for name in ("scenes", "methods")}
    empty = replace(results, tables={**none, **asked})
    names = {"closed-form-horizontal", "closed-form-slope-beta60"}
    assert {figure.name for figure in single_figures(empty)} == names
    assert (
        list(pile_figures(empty))
        == list(stress.FIGURE.draw(empty))
        == list(bed.FIGURE.draw(empty))
        == []
    )


def test_figures_have_few_panels_and_numbers_under_the_lowest(
    results: Results,
) -> None:
    several = copies(results, *({"averaging_length": i + 1.0} for i in range(7)))
    figures = [*pile_figures(several)]
    assert [figure.place for figure in figures] == ["folded"] * 4
    against_flow = [
        figure.place
        for figure in fractions.FIGURE.draw(several)
        if figure.name.startswith("fractions-flow")
    ]
    assert against_flow == ["", "folded"]
    for figure in figures:
        axes = axes_of(figure)
        assert 0 < len(axes) <= style.PANELS
        numbered = {}
        for ax in axes:
            place = ax.get_subplotspec()
            assert place is not None
            numbered[place.colspan.start] = any(
                t.get_visible() for t in ax.get_xticklabels()
            )
        assert all(numbered.values())
    assert sum(len(axes_of(figure)) for figure in figures[2:]) == 7


@pytest.mark.parametrize("value", [0.0, -0.01, np.nan, np.inf])
@pytest.mark.parametrize("rows", [1, 4])
def test_a_threshold_without_a_place_on_a_logarithmic_axis_costs_no_figure(
    results: Results, value: float, rows: int
) -> None:
    own, curve = (
        results.tables["pile_threshold"].copy(),
        results.tables["pile_curve"].copy(),
    )
    own.loc[
        own.index[:rows], ["shields", "shields_low", "shields_high", "reynolds"]
    ] = value
    curve.loc[curve.index[: 3 if rows == 1 else None], ["shields", "reynolds"]] = value
    heap = only(changed(results, pile_threshold=own, pile_curve=curve), "pile")
    assert len(drawn([*overview.draw(heap), *pile_figures(heap)])) == (
        3 if rows == 1 else 1
    )


def test_flows_by_two_models_have_a_panel_each(results: Results) -> None:
    two = copies(results, {}, {"turbulence_model": "RNGkEpsilon"})
    pile = two.plan.piles["copy 0"]
    model = {"method.flow.turbulence_model": "RNGkEpsilon"}
    other = replace(pile, scene=study.changed(pile.scene, model))
    own = two.tables["wall_stress"]
    theirs = own.assign(flow_case=other.flow.name)
    both = changed(two, wall_stress=pd.concat([own, theirs], ignore_index=True))
    plan = replace(two.plan, piles={"copy 0": pile, "copy 1": other})
    (figure,) = stress.FIGURE.draw(replace(both, plan=plan))
    titles = [ax.get_title(loc="left") for ax in axes_of(figure)]
    models = [title.rpartition(", ")[2] for title in titles if title]
    assert models == ["RNG k-ε", "k-ε"]
    assert len(figure.cases) == 2


def test_a_class_whose_interval_ends_at_its_threshold_is_drawn() -> None:
    # by a logarithm and back a value may come out larger in its last digit
    values = np.linspace(30.0, 31.0, 100)
    value = values[np.exp(np.log(values)) > values][0]
    rows = pd.DataFrame(
        {
            "size_over_d": [1.83400809],
            "hiding": [value],
            "hiding_low": [np.nan],
            "hiding_high": [value],
            "few": [True],
        }
    )
    with style.settings():
        ax = plt.figure().subplots()
        hiding._draw_classes(ax, rows, "C0")
    (bars,) = ax.containers
    assert isinstance(bars, ErrorbarContainer)
    assert bars.has_yerr


def test_points_of_one_style_have_it_once_and_none_is_lost() -> None:
    drawn = style.canvas(2.0)
    ax = drawn.subplots()
    count = 40
    places = np.arange(count, dtype=float)
    ax.plot(places, places, "s", color="#123456", gid="line")
    ax.scatter(places, places[::-1], c=places, gid="dots")
    ax.scatter(places, places + 1, color="#654321", alpha=0.5, gid="pale")
    text = style.svg(drawn).decode()
    for name in ("line", "dots", "pale"):
        group = text[text.index(f'id="{name}"') :]
        group = group[: group.index('<g id="')]
        assert len(re.findall("<use [^>]*/>", group)) == count
    line = text[text.index('id="line"') :]
    assert line[: line.index('<g id="')].count("#123456") <= 3
    # the opacity of a group is not that of each point in it; that of a fill is
    assert "fill-opacity: 0.5" in text
    assert re.search('<g style="(?:[^"]*[^-])?opacity', text) is None
