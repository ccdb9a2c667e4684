"""Experiments on the method itself: what a rung costs and how far it is off, and where it fails."""
