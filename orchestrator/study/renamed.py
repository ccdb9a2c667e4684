"""Former names of a study file's keys, which are refused with the present one named."""

RENAMED = {
    "flow.closure": "forces.law",
    "flow.lift_coefficient": "forces.lift_coefficient",
    "flow.stress": "forces.stress",
    "flow.average": "forces.averaging_length",
    "flow.forced": "forces.loaded_grains",
    "flow.growth": "flow.expansion_ratio",
    "flow.correctors": "flow.non_orthogonal_correctors",
    "flow.turbulence": "flow.turbulence_model",
    "flow.convection": "flow.convection_scheme",
    "protocol.step": "protocol.load_increment",
    "protocol.quiet": "protocol.waiting_time",
    "protocol.marker": "protocol.displacement_criterion",
    "protocol.until": "protocol.final_fraction",
    "protocol.timestep": "protocol.time_step",
}
