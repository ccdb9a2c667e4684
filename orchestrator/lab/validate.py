"""Validation: what the model says beside what was measured, with nothing fitted.

Each set of measurements is a table beside this file, in the folder ``measured``. Level
beds are answered on strips poured from a mixture of sand. Each set has the ratio of the
model's value to the measured one.
"""

from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.experiment import Experiment, ExperimentResults, Runs
from orchestrator.fidelity.decision import as_written
from orchestrator.flow.stress import WallStress, bubble
from orchestrator.lab import activity, followed
from orchestrator.lab.sphere import speed_of, sphere
from orchestrator.lab.strips import PERCENTILES, ROUGH, Strips
from orchestrator.physics import rolling
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.curves import of_medium
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import peak_over_mean
from orchestrator.physics.laws import CLIFT_GAUVIN, LAWS
from orchestrator.physics.measured import MEASURED_BEDS, kirchner_pivot
from orchestrator.physics.onset import Criteria, Onset, of_grains
from orchestrator.physics.threshold import LAWS_OF, PAPER
from orchestrator.report import style
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import IN_SENTENCES, Paragraphs, Section, Table
from orchestrator.report.style import Figure
from orchestrator.study.fidelities import Fields
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.surface import truth
from orchestrator.types import FloatArray

FOLDER = Path(__file__).with_name("measured")
"""The sets of measurements."""
TITLE = "The model against measurements"
INTENSITY = 0.4
"""Intensity of the wall stress under gusts: standard deviation over mean."""
EVENTS = 100
"""Of so many events the largest moves a grain."""
FREE = 5000.0
"""Particle Reynolds number of the spheres whose drag was measured, about."""
ENOUGH = 1.5
"""Factor over all sets within which a model would be made the default."""
NEAR, FAR = 1.5, 2.0
"""Factors within which rows are counted."""
LEVEL = 0.01
"""Slope below which a bed is drawn as a level one."""
SET = 0.66
"""Height of a set in a figure, inches."""
UNDER_NAME, BAND = 0.3, 0.78
"""Parts of it between which its models stand, below its name."""
ALIKE = 1e-9
"""Ratios that differ by less do not depend on the model."""
POINTS = "measured"
"""What the measured points are called in a legend."""
WINDWARD = (0.095, 0.605)
"""Part of the hump's chord on which its stress is compared.

It goes from the hump's steep front to its brink.
"""
IVERSEN_WHITE = "formula of Iversen and White"
"""Set of points that are no measurements: a formula that was fitted to wind tunnels."""
READ = "read"
"""Mark of a row whose numbers were read in their source; others are from memory."""


class Model(NamedTuple):
    """A model that is compared with measurements.

    Attributes
    ----------
    name
        Its name.
    fields
        The fields of a scene that it sets.
    gust
        Largest over mean stress of its gusts.
    is_sustained
        Whether grains must go on after the gust. Such a model has no strips,
        but one grain in closed form.
    is_entrained
        Whether grains must leave their pockets in the gust.
    formula
        What finds the Shields numbers of measured beds without strips or gusts; None of
        other models.
    """

    name: str
    fields: Fields
    gust: float = 1.0
    is_sustained: bool = False
    is_entrained: bool = True
    formula: Callable[[pd.DataFrame], FloatArray] | None = None

    @property
    def is_of_strips(self) -> bool:
        """Whether level beds are answered on strips, or by the paper's single grain."""
        return self.formula is None and not self.is_sustained


LONE = {"forces.exposure": "protrusion"}
"""Each grain feels the flow at its own height, as if it stood alone."""
BALANCED = {"forces.exposure": "protrusion", "forces.sheltering": "balanced"}
"""And the drags add up to the stress of the flow."""
GUST = peak_over_mean(INTENSITY, EVENTS)
"""Largest over mean stress of the gusts of the models that have gusts."""
GRAVEL = "bridged-gravel"
"""Force law of one grain, which holds for gravel as well."""
DEFAULT = "entrained and sustained"
"""Name of the model that `threshold` answers by in natural fluids."""
CONSTANTS = (0.05, 0.0123)
"""Shields numbers that are taken for all grains: in a liquid, and in a gas."""


def by_formulas(beds: pd.DataFrame) -> FloatArray:
    """Find what published formulas say, as one would without a model.

    Parameters
    ----------
    beds
        The grains and fluids, as `single` takes them.

    Returns
    -------
    FloatArray
        Shields numbers by Soulsby and Whitehouse in a liquid and by Shao and Lu in a
        gas, of shape (rows,), also beyond what they were fitted to.
    """
    return of_medium(measured_grains(beds))


def by_constants(beds: pd.DataFrame) -> FloatArray:
    """Take one Shields number for all grains in liquids, and one for those in gases.

    Parameters
    ----------
    beds
        The grains and fluids, as `single` takes them.

    Returns
    -------
    FloatArray
        The `CONSTANTS`, of shape (rows,).
    """
    liquid, gas = CONSTANTS
    return np.where(beds["rho_f_kg_m3"] < GAS_BELOW, gas, liquid)


def in_steady_flow(beds: pd.DataFrame) -> FloatArray:
    """Find the stress at which a flow without gusts entrains one grain.

    Parameters
    ----------
    beds
        The grains and fluids, as `single` takes them.

    Returns
    -------
    FloatArray
        Shields numbers by the law for gravel, of shape (rows,).
    """
    return single(beds, GRAVEL).shields


MODELS = (
    Model("paper", {"forces.law": PAPER}),
    Model("sustained", {}, GUST, is_sustained=True, is_entrained=False),
    Model(DEFAULT, {}, GUST, is_sustained=True),
    Model("formulas", {}, formula=by_formulas),
    Model("constants", {}, formula=by_constants),
    Model("entrained, steady", {}, formula=in_steady_flow),
    Model("bridged", {}),
    Model("bridged, protrusion", LONE),
    Model("balanced", BALANCED),
    Model("balanced, gusts", BALANCED, GUST),
)


class Drawn(NamedTuple):
    """How a model of the figures looks.

    Attributes
    ----------
    colour
        Its colour.
    marker
        Its marker.
    dash
        Its line.
    """

    colour: str
    marker: str
    dash: Any


LOOKS = {
    DEFAULT: Drawn(style.ANSWER, "o", "-"),
    "sustained": Drawn("#cc79a7", "P", (0, (1, 1))),
    "formulas": Drawn(style.INK, "s", (0, (5, 2))),
    "constants": Drawn(style.NONE, "d", (0, (2, 2))),
    "paper": Drawn(style.FLOW, "^", (0, (6, 2, 1, 2))),
    "entrained, steady": Drawn("#56b4e9", "v", "-"),
    "bridged": Drawn("#009e73", "D", (0, (3, 1, 1, 1))),
}
"""The models of the figures: the default, what one would take without a model, the
paper's, and those in a steady flow; the tables have all."""
CURVES = ("formulas", "constants", "paper", "entrained, steady", "bridged", DEFAULT)
"""Models whose curves are drawn beside the measured points, the last above all."""


def by_paper(beds: pd.DataFrame) -> FloatArray:
    """Find the threshold of single grains by Eq. 2 or Eq. 4, where one holds.

    Parameters
    ----------
    beds
        The grains and fluids, as `single` takes them.

    Returns
    -------
    FloatArray
        Shields numbers, of shape (rows,); NaN in the transition.
    """
    answers = []
    for name in LAWS_OF["transition"]:
        at = single(beds, name)
        low, high = LAWS[name].reynolds
        holds = (at.reynolds >= low) & (at.reynolds < high)
        answers.append(np.where(holds, at.shields, np.nan))
    return np.asarray(np.fmax(*answers))


def single(
    beds: pd.DataFrame,
    law: str,
    beta_deg: float = 60,
    ratio: float = 30,
) -> Onset:
    """Find the thresholds of single grains on some measured beds.

    Parameters
    ----------
    beds
        A row for each bed: diameter, densities, viscosity, slope and cohesion.
    law
        Name of the force law.
    beta_deg
        Entrainment angle, degrees.
    ratio
        Diameter over roughness length, d/z0.

    Returns
    -------
    Onset
        Thresholds of leaving the pocket, of shape (rows,).
    """
    grain = measured_grains(beds, ratio).changed(entrainment_angle_deg=beta_deg)
    return of_grains(grain, law)


def over_hump(stress: WallStress) -> pd.DataFrame:
    """Compare the stress on the windward side of the hump with the measured one.

    Parameters
    ----------
    stress
        The computed stress along the bed.

    Returns
    -------
    DataFrame
        A row for each measured place: both stresses, each over its own mean.
    """
    hump = pd.read_csv(FOLDER / "hump_stress.csv")
    hump = hump[hump["x_over_chord"].between(*WINDWARD)]
    chord = pd.read_csv(FOLDER / "hump.csv")["x_m"].max()
    tau = np.interp(hump["x_over_chord"] * chord, stress.x_m, stress.tau_wall)
    return pd.DataFrame(
        {
            "measured": hump["cf"] / hump["cf"].mean(),
            "value": tau / tau.mean(),
            "set": "stress over a hump",
            "source": "Naughton, Viken and Greenblatt 2006",
            "sure": READ,
        }
    )


def sustained_shields(
    beds: pd.DataFrame,
    gust: float,
    *,
    is_entrained: bool,
    ratio: float = 30,
) -> FloatArray:
    """Find the mean stress from which grains go on after a gust, on measured beds.

    In a liquid the bed's slope is that of the surface of an open uniform flow.

    Parameters
    ----------
    beds
        The grains and fluids, as `single` takes them.
    gust
        Largest over mean stress.
    is_entrained
        Whether a grain must also leave its pocket in the gust: that of `single` by the
        law for gravel, between neighbours at 60 degrees.
    ratio
        Diameter over roughness length, d/z0.

    Returns
    -------
    FloatArray
        Shields numbers of the mean flow, of shape (rows,).
    """
    grains = measured_grains(beds, ratio)
    if not is_entrained:
        return rolling.sustained(grains).initiation(gust)
    steady = single(beds, GRAVEL, 60, ratio).shields
    return Criteria(steady, grains, gust).shields


def measured_grains(beds: pd.DataFrame, ratio: float = 30) -> Grain:
    """Make the grains of measured beds.

    Parameters
    ----------
    beds
        The grains and fluids, as `single` takes them.
    ratio
        Diameter over roughness length, d/z0.

    Returns
    -------
    Grain
        The grains, of shape (rows,); in a liquid the surface of the flow falls with the
        bed.
    """
    slope = np.arctan(beds["slope"].to_numpy(float))
    is_liquid = beds["rho_f_kg_m3"] >= GAS_BELOW
    return Grain(
        diameter=beds["d_m"],
        density=beds["rho_sol_kg_m3"],
        fluid_density=beds["rho_f_kg_m3"],
        viscosity=beds["nu_m2_s"],
        # a bed that falls with the flow has a positive slope in the table
        slope_deg=-np.degrees(slope),
        roughness=beds["d_m"] / ratio,
        cohesion=beds["cohesion_n_m"],
        fall=np.where(is_liquid, np.sin(slope), 0.0),
    )


class _Answers(NamedTuple):
    """The answers of a model, at first without gusts.

    Shields numbers of a sphere that stands `clear` or is `level` with its neighbours,
    and of the measured `beds`, shape (rows,); the exponent of `hiding`.
    """

    clear: float
    level: float
    beds: FloatArray
    hiding: float

    def under(self, gust: float) -> "_Answers":
        """The answers under a gust, as mean stresses; hiding is alike."""
        mean = _Answers(self.clear / gust, self.level / gust, self.beds / gust, 0.0)
        return mean._replace(hiding=self.hiding)


def _answers(model: Model, strips: Strips, beds: pd.DataFrame) -> _Answers:
    """Answer the measured beds and spheres by a model, without its gusts."""
    clear = sphere(model.fields, ROUGH, clear=True)
    level = sphere(model.fields, ROUGH, clear=False)
    if model.name == PAPER:
        return _Answers(clear, level, by_paper(beds), hiding=np.nan)
    galileo = beds["galileo"].to_numpy()
    bond = beds["bond"].to_numpy()
    shields = strips.interpolated(model.fields)(galileo, beds["slope"].to_numpy())
    for place in np.flatnonzero(bond):
        cohesion = {"bond": bond[place]}
        shields[place] = strips.shields(model.fields, galileo[place], **cohesion)
    return _Answers(clear, level, shields, _hiding_of(model.name))


def stored_hiding() -> pd.DataFrame:
    """Read the exponents of hiding that ``tools/hiding.py`` has found.

    Returns
    -------
    DataFrame
        A row for each model without gusts and each end of the bracket: the exponent p
        of theta_i ~ (D_i/D_50)^p on forty strips, and its standard deviation.
    """
    return pd.read_csv(FOLDER / "hiding.csv")


def _hiding_of(model: str) -> float:
    """Exponent g = -p of hiding by a model, in the middle of the bracket."""
    rows = stored_hiding()
    return -float(rows.loc[rows["model"] == model, "exponent"].mean())


def compare_models(
    strips: Strips,
    hump: pd.DataFrame,
    lengths: Mapping[str, float],
) -> pd.DataFrame:
    """Compare all models with all measurements.

    Parameters
    ----------
    strips
        The strips that level beds are answered on.
    hump
        The stress over the hump, of `over_hump`; it is alike in all models.
    lengths
        Ends of reversed flows, h, by their names in the table of single values; they
        are alike in all models.

    Returns
    -------
    DataFrame
        A row for each measurement and model: set, source, measured value, that of the
        model, and their ratio.
    """
    beds = _measured_beds()
    others = pd.read_csv(FOLDER / "single.csv")
    pivots = pd.DataFrame(
        {
            "measured": kirchner_pivot(PERCENTILES),
            "value": strips.pivots_deg(),
            "set": "pivots of laid grains",
            "source": "Kirchner et al. 1990",
            "sure": READ,
        }
    )
    ends = pd.read_csv(FOLDER / "cessation.csv").rename(columns={"shields": "measured"})
    in_motion = measured_grains(ends)
    # motion ceases in the mean flow, whatever its gusts would turn over
    ceases = Criteria(np.zeros(len(ends)), in_motion, GUST).cessation
    without_gusts: dict[str, _Answers] = {}
    rows = []
    for model in MODELS:
        cessation = np.full(len(ends), np.nan)
        if model.is_sustained:
            shields = sustained_shields(
                beds, model.gust, is_entrained=model.is_entrained
            )
            answers = _Answers(np.nan, np.nan, shields, np.nan)
            cessation = ceases
        elif model.formula is not None:
            answers = _Answers(np.nan, np.nan, model.formula(beds), np.nan)
        else:
            # a model with gusts has a part of the same model's stresses without them
            key = str(model.fields)
            if key not in without_gusts:
                without_gusts[key] = _answers(model, strips, beds)
            answers = without_gusts[key].under(model.gust)
        values = {
            "saddle": speed_of(2500.0, 0.354),
            "top": speed_of(1430.0, 0.707),
            "drag": float(24 / FREE * CLIFT_GAUVIN.factor(np.array(FREE))),
            **lengths,
            "clear": answers.clear,
            "level": answers.level,
            "hiding": answers.hiding,
        }
        parts = [
            beds.drop(columns="bond").assign(value=answers.beds),
            ends.assign(value=cessation, sure=READ),
            others.assign(value=others["what"].map(values)),
            pivots,
            hump,
        ]
        rows += [part.assign(model=model.name) for part in parts]
    table = pd.concat(rows, ignore_index=True)
    return table.assign(ratio=table["value"] / table["measured"])


def _measured_beds() -> pd.DataFrame:
    """The measured beds, with Galileo number and pull of a contact over the weight."""
    beds = pd.read_csv(MEASURED_BEDS).rename(columns={"shields": "measured"})
    grains = measured_grains(beds)
    return beds.assign(
        galileo=grains.galileo,
        sure=READ,
        bond=grains.cohesion * grains.diameter / grains.weight,
    )


def scores(rows: pd.DataFrame) -> pd.DataFrame:
    """Score each model on each set; rows from memory count in no score.

    A factor is the ratio or its inverse, whichever is above 1.

    Parameters
    ----------
    rows
        The comparison, as of `compare_models`.

    Returns
    -------
    DataFrame
        A row for each set and model: number of rows, and of those answered; median
        ratio and its 10 to 90 %; factor in the median, and the worst.
    """
    read = rows[rows["sure"] == READ]
    # a value of the wrong sign has no factor
    positive = read["ratio"].where(read["ratio"] > 0)
    factor = np.exp(np.abs(np.log(positive)))
    groups = read.assign(factor=factor).groupby(["set", "model"], sort=False)
    ratio = groups["ratio"]
    return pd.DataFrame(
        {
            "rows": ratio.size(),
            "answered": ratio.count(),
            "ratio": ratio.median(),
            "ratio_10": ratio.quantile(0.1),
            "ratio_90": ratio.quantile(0.9),
            "factor": groups["factor"].median(),
            "worst": groups["factor"].max(),
        }
    ).reset_index()


FLUMES = ("flumes, fixed intensity", "flumes, reference transport", "flumes, visual")
"""Sets of level beds in flumes."""
STEEP = ("steep flumes", "steep flumes, large elements")
"""Sets of flumes that run down a slope."""
RIVERS, SITES = "rivers, gravel", "wind, field"
"""Sets of beds outside of laboratories."""
GROUPS = {
    "flumes and field sites": (*FLUMES, *STEEP, SITES),
    "level flumes": FLUMES,
    "steep flumes": STEEP,
    "field sites in wind": (SITES,),
    "rivers": (RIVERS,),
}
"""Rows that are scored together, each as much as any other, by what they are called."""


def by_rows(rows: pd.DataFrame) -> pd.DataFrame:
    """Score each model on the measured rows of beds, each row as much as any other.

    Parameters
    ----------
    rows
        The comparison, as of `compare_models`.

    Returns
    -------
    DataFrame
        A row for each of the `GROUPS` and each model that answers it: number of rows,
        and of those answered; median ratio; factor in the median and at 90 % of the
        answered rows; the share of these within 1.5 and 2. A formula is no measured
        row.
    """
    made = []
    for name, sets in GROUPS.items():
        for model, part in rows[rows["set"].isin(sets)].groupby("model", sort=False):
            ratio = part["ratio"].dropna()
            if ratio.empty:
                continue
            factor = np.exp(np.abs(np.log(ratio)))
            made.append(
                {
                    "group": name,
                    "model": model,
                    "rows": len(part),
                    "answered": len(ratio),
                    "ratio": ratio.median(),
                    "factor": factor.median(),
                    "factor_90": factor.quantile(0.9),
                    "within_1.5": (factor <= NEAR).mean(),
                    "within_2": (factor <= FAR).mean(),
                }
            )
    return pd.DataFrame(made)


class ScoredPart(NamedTuple):
    """Rows of some sets in a range of a number.

    Attributes
    ----------
    name
        The name of the number, in words.
    sets
        The names of the sets.
    number
        The column of the number.
    low, high
        The ends of the range; the upper one is in it.
    """

    name: str
    sets: tuple[str, ...]
    number: str
    low: float
    high: float


GALILEO = (0.0, 3.0, 10.0, 30.0, 60.0, 300.0, 2000.0, np.inf)
"""Galileo numbers between which the rows by eye are scored."""
VISUAL = ("flumes, visual",)
PARTS = (
    *(
        ScoredPart("Galileo number", VISUAL, "galileo", *two)
        for two in pairwise(GALILEO)
    ),
    *(
        ScoredPart("Re*", VISUAL, "reynolds", *two)
        for two in pairwise((0.0, 1.0, 400.0, np.inf))
    ),
    *(
        ScoredPart("slope", ("steep flumes",), "slope", *two)
        for two in pairwise((0.0, 0.12, np.inf))
    ),
)
"""Parts of sets in which models are scored: the Re* are those of the measurements."""


def by_parts(rows: pd.DataFrame) -> pd.DataFrame:
    """Score each model on the `PARTS` of sets.

    Parameters
    ----------
    rows
        The comparison, as of `compare_models`.

    Returns
    -------
    DataFrame
        A row for each part and each model that answers it: what it is by, its range,
        the sets, number of answered rows, median ratio, factor in the median and the
        worst, and the share within 2.
    """
    rows = rows.assign(reynolds=np.sqrt(rows["measured"]) * rows["galileo"])
    made = []
    for part in PARTS:
        here = rows["set"].isin(part.sets) & (rows[part.number] > part.low)
        here &= rows[part.number] <= part.high
        for model, of_model in rows[here].groupby("model", sort=False):
            ratio = of_model["ratio"].dropna()
            if ratio.empty:
                continue
            factor = np.exp(np.abs(np.log(ratio)))
            made.append(
                {
                    "by": part.name,
                    "low": part.low,
                    "high": part.high,
                    "sets": "; ".join(part.sets),
                    "model": model,
                    "rows": len(ratio),
                    "ratio": ratio.median(),
                    "factor": factor.median(),
                    "worst": factor.max(),
                    "within_2": (factor <= FAR).mean(),
                }
            )
    return pd.DataFrame(made)


class Validation(Experiment):
    """What was measured, answered on the strips, the hill and the hump of a study.

    Parameters
    ----------
    study
        The study, such as the preset ``validate``.
    out
        Directory of its runs.

    Raises
    ------
    InputError
        If the study lacks strips, a hill of RUSHIL or a profile.
    """

    name = "validate"
    title = TITLE

    def __init__(self, study: Study, out: Path) -> None:
        self.strips = [scene for scene in study.scenes if scene.is_poured]
        hills = [scene for scene in study.scenes if _is_hill(scene)]
        humps = [scene for scene in study.scenes if getattr(scene.bed, "profile", None)]
        if not self.strips or len(hills) != 1 or len(humps) != 1:
            what = (
                "it needs poured strips, one hill of RUSHIL and one profile, the hump"
            )
            raise InputError(what, study.name, "start from the preset validate")
        (self.hill,) = hills
        (self.hump,) = humps
        asked = {scene.id: as_written(scene) for scene in study.scenes}
        super().__init__(plan.of(asked, cases=out.absolute() / "cases"), study)

    def results(self, runs: Runs) -> ExperimentResults | None:
        """Compare every model with every measurement, once all runs are done."""
        piles = self.planned.piles
        if not runs.are_done(*piles):
            return None
        lengths = {
            **_reversed_flow("hill", self.hill, runs),
            **_reversed_flow("hump", self.hump, runs),
        }
        over = over_hump(piles[self.hump.id].stress(runs.cases))
        rows = compare_models(Strips(self.strips, runs.cases), over, lengths)
        scored = scores(rows)
        tables = {
            "measured": rows,
            "scores": scored,
            "rows": by_rows(rows),
            "parts": by_parts(rows),
            "activity": activity.compare_activity(),
            "followed": followed.compare_strips(followed.stored_strips()),
            "hiding": stored_hiding(),
        }
        return ExperimentResults(tables, _sections(tables))


def _is_hill(scene: Scene) -> bool:
    """Whether the bed of a scene is a hill of RUSHIL."""
    return isinstance(scene.bed, PileBed) and scene.bed.form.has_measured_flow


def _reversed_flow(name: str, scene: Scene, runs: Runs) -> dict[str, float]:
    """Ends of the reversed flow behind a form, h, by their names in the table."""
    pile = runs.planned.piles[scene.id]
    ends = bubble(pile.stress(runs.cases), pile.model.line.h)
    start, end = ends or (np.nan, np.nan)
    return {f"{name}, separation": start, f"{name}, reattachment": end}


SETS_TEXT = """\
Each row is a set of measurements, with the number of its rows. Nothing is fitted to \
these sets. The first table has for each model the median over the sets of beds on \
which motion starts; the second has each set. The stress over the hump is compared \
over its windward side, each over its own mean, since the boundary layer of the \
experiment is thinner."""
FACTORS_TEXT = """\
A mark at 1 meets the measurement. Median ratio of the model to each set, and 10 to \
90 % of its rows. Grey: a factor of 1.5. Star: a set that no model changes. The \
tables have the other models."""
ROWS_TEXT = """\
The factor by which a model differs from the measured thresholds: its median over the \
rows and its 90th percentile, and the fraction of the rows within 1.5 and 2. \
“Formulas” (Soulsby and Whitehouse 1997 in liquids, Shao and Lu 2000 in gases) and \
“constants” (0.05 in liquids, 0.0123 in gases) need no model."""
THRESHOLDS_TEXT = """\
Level beds are answered on three poured strips of sand; the threshold is that at \
which a tenth of the exposed grains has moved, each out of its own pocket. “Bridged” \
takes the drag and lift of a lone grain, all grains at one height; “protrusion” takes \
each grain at its own height; “balanced” lets the drags on a patch add up to the \
stress of the flow. Gusts are the largest of 100 independent log-normal stresses of \
intensity 0.4. “Sustained” is the lowest mean stress at which an entrained grain \
continues to roll and hop after such a gust; “entrained and sustained” requires \
dislodgement by the gust, too."""
SHIELDS_TEXT = """\
Measured thresholds of level beds beside those of the models. The Galileo number \
contains no threshold, so that both axes are independent. “Bridged” and “entrained, \
steady” are without gusts."""
HIDING_TEXT = """\
Exponent p of θᵢ ~ (Dᵢ/d50)ᵖ over the size classes of forty poured strips of sand, \
with its standard deviation. The threshold of a class is read where the fraction 0.03 \
(Dᵢ/d50)⁻ᵐ of its grains has moved, and for no class above 0.06, where the first \
balance of the drags holds. The exponent m is 1 for steps of one length and 2 for \
steps in proportion to the diameter; which of the two applies is not known, so that \
both are a bracket. Measured exponents are −0.67 to −0.98."""
MEMORY_TEXT = """\
Numbers that are quoted from memory count in no score. They are listed here beside the \
last model."""


def _sections(tables: Mapping[str, pd.DataFrame]) -> list[Section]:
    """The page: the nearest model, sets, rows, thresholds, gusts, and from memory."""
    rows, scored = tables["measured"], tables["scores"]
    nearest = median_factors(scored)
    title = "Model over measurement"
    draw = partial(factors, scored)
    ratio = "Ratio of the model to each set of measurements"
    chart = Figure.of_both_widths("factors", ratio, FACTORS_TEXT, draw)
    of_points = "Thresholds of level beds"
    draw = partial(validation_diagram, rows)
    points = Figure.of_both_widths("shields", of_points, SHIELDS_TEXT, draw)
    wide = scored.pivot(index="set", columns="model", values="factor")
    wide = wide.loc[scored["set"].unique(), [model.name for model in MODELS]]
    wide = wide.reset_index()
    is_from_memory = (rows["sure"] != READ) & (rows["model"] == MODELS[-1].name)
    memory = rows.loc[is_from_memory, ["set", "source", "measured", "value", "ratio"]]
    told = Paragraphs(_nearest_in_words(nearest), fold=IN_SENTENCES)
    medians = [Table.of(nearest.reset_index()), Table.of(wide)]
    of_beds = Paragraphs(THRESHOLDS_TEXT, "lead")
    return [
        Section("", [_card(nearest), told]),
        Section(title, [chart, Paragraphs(SETS_TEXT, "lead"), *medians]),
        Section(
            "Row by row", [Paragraphs(ROWS_TEXT, "lead"), Table.of(tables["rows"])]
        ),
        Section("Thresholds", [points, of_beds, Table.of(scored)]),
        Section(
            "Hiding", [Paragraphs(HIDING_TEXT, "lead"), Table.of(tables["hiding"])]
        ),
        followed.strips_section(tables["followed"]),
        activity.activity_section(tables["activity"]),
        Section("From memory", [Paragraphs(MEMORY_TEXT, "lead"), Table.of(memory)]),
        truth.truth_section(truth.stored()),
    ]


def median_factors(scored: pd.DataFrame) -> "pd.Series[float]":
    """Find the factor of each model in the median of the sets of measured beds.

    Parameters
    ----------
    scored
        The scores, as of `scores`.

    Returns
    -------
    Series
        The factors by model. All models answer these sets, each of which weighs alike;
        a formula is none of them.
    """
    beds = {name for sets in GROUPS.values() for name in sets}
    of_beds = scored[scored["set"].isin(beds)]
    median = of_beds.groupby("model", sort=False)["factor"].median()
    return median.rename("median of the sets of measured beds")


def _card(median: "pd.Series[float]") -> Card:
    """The answer card: the default model, the paper's, and how many are near."""
    near = int((median <= ENOUGH).sum())
    least = float(median.min())
    beds = "median over the sets of level and steep beds, of the median of each"
    numbers = (
        _misfit(float(median[DEFAULT]), f"default model, “{DEFAULT}”", beds),
        _misfit(float(median[PAPER]), "the article’s laws", beds),
        _misfit(
            float(median["formulas"]),
            "published formulas, no model",
            f"{near} of {len(median)} models are within a factor of {ENOUGH:g}; the "
            f"smallest misfit is a factor of {least:.2f}, of “{median.idxmin()}”",
        ),
    )
    worth = Worth(
        "good",
        "usable",
        f"The default is within a factor of {ENOUGH:g} of the measurements in the "
        "median; the sets differ by more.",
    )
    if median[DEFAULT] > ENOUGH:
        worth = Worth(
            "care",
            "usable, with a correction",
            f"The default is not within a factor of {ENOUGH:g} of the measurements.",
        )
    return Card(
        "How far is the default model from measured thresholds?",
        f"{len(median)} models beside flumes, wind tunnels and field sites; nothing is "
        "fitted to them.",
        numbers,
        "All sets were measured by others; each stands below with its source. A factor "
        "of 1 meets the measurement.",
        worth,
    )


def _misfit(value: float, meaning: str, note: str) -> Number:
    """A median misfit as a number of the card."""
    return Number(
        value,
        "median misfit",
        meaning,
        note,
        is_ratio=True,
        decimals=2,
    )


def _nearest_in_words(median: "pd.Series[float]") -> str:
    """Which model is nearest to the measurements."""
    least = float(median.min())
    said = (
        f"Of {len(median)} models “{median.idxmin()}” has the smallest median misfit "
        f"to the measured thresholds, a factor of {least:.2f}. A default should be "
        f"within a factor of {ENOUGH:g}. "
    )
    if least > ENOUGH:
        said += "No model is; the default is kept."
    return said


def factors(scored: pd.DataFrame, width: float) -> Canvas:
    """Draw the ratio of some models to each set.

    Parameters
    ----------
    scored
        The scores, as of `scores`.
    width
        Width of the drawing, inches.

    Returns
    -------
    Canvas
        Median, and 10 to 90 % of the rows, in a row for each set; one mark where the
        set does not depend on the model.
    """
    sets = list(dict.fromkeys(scored["set"]))
    canvas = style.canvas(SET * len(sets) + 1.6, width)
    ax = canvas.subplots()
    counts = scored.groupby("set")["rows"].first()
    for place, name in enumerate(sets):
        _of_set(ax, place, scored[scored["set"] == name])
        words = f"{name} ({counts[name]})"
        ax.text(0.01, place, words, transform=ax.get_yaxis_transform(), va="center")
        ax.axhline(place - 0.5 * UNDER_NAME, color="0.85", lw=0.6)
    ax.axvline(1.0, color="0.2", lw=0.8)
    ax.axvspan(1 / ENOUGH, ENOUGH, color="0.93", zorder=0)
    ax.set_xscale("log")
    ax.margins(x=0.05)
    style.plain_ticks(ax.xaxis)
    ax.set_yticks([])
    ax.set_ylim(len(sets) - 0.5 * UNDER_NAME, -0.5 * UNDER_NAME)
    ax.set_xlabel("model over measurement")
    samples = []
    for name, look in LOOKS.items():
        mark = Line2D([], [], marker=look.marker, color=look.colour, label=name)
        samples.append(mark)
    style.legends_below(canvas, samples, [])
    return canvas


def _of_set(ax: Axes, place: int, rows: pd.DataFrame) -> None:
    """Draw the ratios of one set, below its name."""
    rows = rows[rows["ratio"].notna()]
    shown = rows[rows["model"].isin(LOOKS)]
    is_alike = len(rows) > 1 and np.ptp(rows["ratio"]) < ALIKE
    for row in (shown[:1] if is_alike else shown).to_dict("records"):
        name = row["model"]
        look = LOOKS[name]
        if is_alike:
            look = Drawn(style.INK, "*", "-")
        order = 0.5 if is_alike else [*LOOKS].index(name) / (len(LOOKS) - 1)
        y = place + UNDER_NAME + (BAND - UNDER_NAME) * order
        ends = (row["ratio_10"], row["ratio_90"])
        ax.hlines(y, *ends, color=look.colour, lw=1.6, alpha=0.6)
        gid = "every model" if is_alike else name
        ax.plot(row["ratio"], y, look.marker, ms=5, color=look.colour, gid=gid)


def validation_diagram(rows: pd.DataFrame, width: float) -> Canvas:
    """Draw thresholds of level beds over the Galileo number.

    Parameters
    ----------
    rows
        The comparison, as of `compare_models`.
    width
        Width of the drawing, inches.

    Returns
    -------
    Canvas
        The measured thresholds and some models' curves, in liquids and in gases.
    """
    is_bed = rows["galileo"].notna() & (rows["cohesion_n_m"] == 0)
    level = rows[is_bed & (rows["slope"] < LEVEL)]
    measured = level[level["model"] == MODELS[0].name]
    columns = 2 if width >= style.WIDE else 1
    titles = ("in liquids", "in gases")
    axes_of = ("Galileo number", "critical Shields number θ_c")
    canvas, panels = style.grid(titles, 2.9, *axes_of, columns, width=width)
    is_gas = level["rho_f_kg_m3"] < GAS_BELOW
    for ax, is_here in zip(panels, (~is_gas, is_gas), strict=True):
        points = measured[is_here.loc[measured.index]]
        ax.plot(
            points["galileo"], points["measured"], "o", ms=3, color="0.65", label=POINTS
        )
        for name in CURVES:
            part = level[is_here & (level["model"] == name)].sort_values("galileo")
            look = LOOKS[name]
            ax.plot(
                part["galileo"],
                part["value"],
                color=look.colour,
                ls=look.dash,
                lw=2.0 if name == DEFAULT else 1.2,
                label=name,
            )
        ax.set(xscale="log", yscale="log")
        style.plain_ticks(ax.yaxis)
    style.legends_below(canvas, [], style.samples(panels))
    return canvas
