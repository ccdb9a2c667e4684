"""At which wind do grains of dune sand start to move, and does DEM agree with the closed form?"""

from pathlib import Path

import numpy as np

import orchestrator

STUDY = """
title = "Dune sand on a windward slope"
bed = { slope_deg = 10.0 }
protocol = { load_increment = 0.02 }
[axes]
"grain.diameter" = [2e-4, 3e-4, 5e-4]
"""

# at once, by the closed form
table = orchestrator.threshold(np.array([2e-4, 3e-4, 5e-4]), slope_deg=10.0)
print(table[["d_m", "ustar_m_s", "wind_10m_m_s", "valid"]].to_string(index=False))

# the same grains by DEM
Path("dune.toml").write_text(STUDY, encoding="utf-8")
study = orchestrator.run("dune.toml", out="dune")
print(study.answer)
rows = study.thresholds
print((rows["ustar_m_s"] / rows["ustar_closed_form_m_s"] - 1).describe())

# a figure
study.plot.shields().savefig("shields.svg")
