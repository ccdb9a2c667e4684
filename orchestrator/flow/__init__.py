"""The flow over the pile: its mesh, its OpenFOAM case, and the stress on the bed."""
