"""The budget: how far the choices that all fidelity levels share move a threshold."""
