"""How values are written in figures and on the page."""

import math
from collections.abc import Mapping

import pandas as pd

RE_AXIS = r"$Re^\star = u^\star d/\nu$"
TAU_AXIS = r"$\tau = \tau_c^\star/\left((\rho_{sol}-\rho_f)\,g\,d\right)$"

NAMES: Mapping[str, str] = {
    "alpha_deg": r"$\alpha$ = {:g}°",
    "beta_deg": r"$\beta$ = {:g}°",
    "phi_deg": r"$\varphi$ = {:g}°",
    "alpha_s": r"$\alpha_s$ = {:g}",
    "fraction": "$n/N$ = {:.0%}",
    "packing": "{} packing",
    "stress": "stress: {}",
}


def written(column: str, value: object) -> str:
    """A value with its symbol, as panels and legends say it."""
    if column == "z0_over_d":
        return f"$z_0$ = {ratio_of_d(float(str(value)))}"
    if column in ("d_m", "h_m"):
        return f"${column[0]}$ = {millimetres(float(str(value)))}"
    if column == "nu_m2_s":
        return rf"$\nu$ = {power_of_ten(float(str(value)))} m²/s"
    return NAMES[column].format(value)


def ratio_of_d(ratio: float) -> str:
    """A length over d, such as ``d/30``."""
    part = 1 / ratio
    whole = round(part)
    return f"d/{whole}" if abs(part - whole) < 1e-3 * part else f"{ratio:.3g} d"


def millimetres(metres: float) -> str:
    """A length, such as ``0.7 mm``."""
    return f"{metres * 1e3:.6g} mm"


def power_of_ten(value: float) -> str:
    """A number for mathematics, such as ``$10^{-5}$``."""
    exponent = math.floor(math.log10(value) + 1e-12)
    factor = f"{value / 10**exponent:.4g}"
    head = "" if factor == "1" else rf"{factor}\times "
    return f"${head}10^{{{exponent}}}$"


def panel(row: pd.Series, columns: tuple[str, ...]) -> str:
    """A panel's title: what all that it shows agrees in."""
    return ", ".join(written(column, row[column]) for column in columns)


def plain(column: str, value: float) -> str:
    """A value with its symbol where there is no mathematics."""
    return {"alpha_deg": "α = {:g}°", "beta_deg": "β = {:g}°"}[column].format(value)
