"""Experiments on the method: what it costs, how far it is off, where it fails."""
