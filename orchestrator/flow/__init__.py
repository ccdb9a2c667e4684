"""Flow models, the flow runs by OpenFOAM that some need, and the stress on the bed."""
