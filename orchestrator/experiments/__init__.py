"""Experiments on the method: what a fidelity level costs, how far it is off, where it fails."""
