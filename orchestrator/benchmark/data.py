"""What a study found, as small CSV files for those who compare another solver with it."""

from collections.abc import Mapping
from importlib import resources
from pathlib import Path

import pandas as pd

from orchestrator.errors import InputError
from orchestrator.files import write_durably
from orchestrator.tables import Tables

DIGITS = "%.7g"
"""Of every number: finer than any interval, and than the flow's single-precision fields."""
SCENES = {
    "scene_id": "scene_id",
    "bed": "bed",
    "regime": "regime",
    "closure": "closure",
    "alpha_deg": "alpha_deg",
    "beta_deg": "beta_deg",
    "phi_deg": "phi_deg",
    "d_m": "d_m",
    "rho_sol_kg_m3": "rho_sol",
    "rho_f_kg_m3": "rho_f",
    "nu_m2_s": "nu",
    "g_m_s2": "g",
    "z0_m": "z0_m",
    "z0_over_d": "z0_over_d",
    "h_m": "h_m",
    "packing": "packing",
    "disorder": "disorder",
    "seed": "seed",
    "mobile_layers": "mobile_layers",
    "stress": "stress",
    "alpha_s": "alpha_s",
    "stiffness": "stiffness",
    "damping": "damping",
    "step": "step",
    "quiet": "quiet",
    "marker": "marker",
    "timestep": "timestep",
    "until": "until",
    "solve_u_e_m_s": "solve_u_e",
    "solve_nu_m2_s": "solve_nu",
    "first_cell_m": "first_cell_m",
    "cells_per_face": "cells_per_face",
}
SINGLE_GRAIN = {
    "scene_id": "scene_id",
    "alpha_deg": "alpha_deg",
    "beta_deg": "beta_deg",
    "d_m": "d_m",
    "z0_over_d": "z0_over_d",
    "nu_m2_s": "nu",
    "closure": "closure",
    "reynolds_closed_form": "reynolds",
    "shields_closed_form": "shields_closed_form",
    "shields_dem": "shields_dem",
    "shields_dem_low": "shields_dem_low",
    "shields_dem_high": "shields_dem_high",
}
WALL_STRESS = {
    "alpha_deg": "alpha_deg",
    "z0_m": "z0_m",
    "s_over_h": "s_over_h",
    "ustar_over_ustar0_wall": "ustar_over_ustar0_wall",
    "ustar_over_ustar0_eq10": "ustar_over_ustar0_eq10",
}
PILE_CURVE = {
    "scene_id": "scene_id",
    "seed": "seed",
    "u_e_m_s": "u_e",
    "fraction_moved": "fraction_moved",
    "mean_tau_pa": "mean_tau_pa",
    "reynolds": "reynolds",
}
PILE_THRESHOLD = {
    "scene_id": "scene_id",
    "alpha_deg": "alpha_deg",
    "d_m": "d_m",
    "z0_over_d": "z0_over_d",
    "nu_m2_s": "nu",
    "closure": "closure",
    "packing": "packing",
    "fraction": "fraction",
    "shields": "shields",
    "reynolds": "reynolds",
    "shields_low": "shields_low",
    "shields_high": "shields_high",
    "ustar0_m_s": "ustar0",
    "highest_fraction": "highest_fraction",
}
FILES: dict[str, Mapping[str, str]] = {
    "scenes": SCENES,
    "single_grain": SINGLE_GRAIN,
    "wall_stress": WALL_STRESS,
    "pile_curve": PILE_CURVE,
    "pile_threshold": PILE_THRESHOLD,
}
"""Columns of each file: their name in the study's tables, and the one they get."""


def write(tables: Tables, versions: Mapping[str, str], folder: Path) -> None:
    """Write the benchmark's data of a study.

    Parameters
    ----------
    tables : dict of str to DataFrame
        Of a finished study.
    versions : mapping of str to str
        Programs that made them.
    folder : Path
        Where ``scenes.csv`` and its companions go, with a README.

    Raises
    ------
    InputError
        If the study lacks a table.
    """
    missing = [name for name in FILES if name not in tables]
    if missing:
        raise InputError(
            f"the study has no table {missing[0]}",
            where=str(folder),
            remedy="the benchmark's data need single grains and piles: run the study paper",
        )
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in _files(tables).items():
        text = table.to_csv(index=False, float_format=DIGITS)
        write_durably(folder / f"{name}.csv", text)
    write_durably(folder / "README.md", _readme(versions))


def _files(tables: Tables) -> dict[str, pd.DataFrame]:
    scenes = tables["scenes"].drop_duplicates("scene_id")
    seeds = scenes[["scene_id", "seed"]]
    sources = {
        **tables,
        "scenes": scenes,
        # one flow for each slope and roughness
        "wall_stress": tables["wall_stress"].drop_duplicates(["alpha_deg", "z0_m", "s_m"]),
        "pile_curve": tables["pile_curve"].merge(seeds, on="scene_id", validate="many_to_one"),
    }
    return {
        name: sources[name][list(columns)].rename(columns=dict(columns))
        for name, columns in FILES.items()
    }


def _readme(versions: Mapping[str, str]) -> str:
    text = resources.files("orchestrator.benchmark").joinpath("README.md.in").read_text("utf-8")
    listed = "\n".join(f"- {name} {version}" for name, version in sorted(versions.items()))
    return text.replace("@VERSIONS@", listed)
