"""The parts of a scene: fluid, grain, bed, flow and protocol; frozen, validated, SI.

Each field is declared here once: its name and default are the study file's, its `Info` and the
text under it are what tables, figures and the reference of study files say of it. Angles are in
degrees and say so in their names; all else is in SI units or in the unit that is declared.
"""

from orchestrator.study.part import Part, UnfitError
from orchestrator.study.parts.bed import Bed, GrainBed, Obstacle, Packing, PileBed, Range
from orchestrator.study.parts.flow import Convection, Flow, Turbulence
from orchestrator.study.parts.grain import Fluid, Forces, Grain, Protocol

__all__ = [
    "Bed",
    "Convection",
    "Flow",
    "Fluid",
    "Forces",
    "Grain",
    "GrainBed",
    "Obstacle",
    "Packing",
    "Part",
    "PileBed",
    "Protocol",
    "Range",
    "Turbulence",
    "UnfitError",
]
