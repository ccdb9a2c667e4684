"""Experiments on the method: what a fidelity level costs, how far it is off, where it fails.

Each is a module with a function `run`, and one with its figures.
"""
