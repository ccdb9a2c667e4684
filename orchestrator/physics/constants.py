"""Constants of the physics, each as the paper has it; SI units."""

GRAVITY = 9.81
"""Acceleration of gravity, m/s2."""
KARMAN = 0.41
"""von Karman's constant in Eq. 10 and in the flow."""
INVERSE_KARMAN = 2.5
"""The paper's 1/kappa in the velocity profile around a grain.

The text of the paper has kappa = 0.41.
"""
GAS_BELOW = 100.0
"""Density that tells gases from liquids, kg/m3: Venus has 65 at its ground."""
LIFT_COEFFICIENT = 1.615
"""Saffman's 6.46 for the radius, over 4 for the squared diameter."""
