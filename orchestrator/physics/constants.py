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
SAND_GRAIN = 30.0
"""Nikuradse's equivalent sand-grain roughness over z0."""
GRAIN_COLUMNS = {
    "diameter": "d_m",
    "roughness": "z0_m",
    "fluid_density": "rho_f_kg_m3",
    "viscosity": "nu_m2_s",
    "lift_coefficient": "alpha_s",
    "density": "rho_sol_kg_m3",
    "slope_deg": "alpha_deg",
    "entrainment_angle_deg": "beta_deg",
    "gravity": "g_m_s2",
    "cohesion": "cohesion_n_m",
}
"""Columns of tables with the quantities of `Grain`, by its attributes."""
CHANNEL = "z0_channel_m"
"""Column of the roughness length of the channel or the ground, from which the speeds of
a flow follow, where it is another than that of the grain's pocket."""
SLOPE = "bed_slope"
"""Column of the slope at which a channel falls, whose depth follows from the flow."""
