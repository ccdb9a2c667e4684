"""Experiments on the method: what a fidelity level costs, how far it is off, where it fails.

Each is a package whose module ``run`` calls the others: what is to be run, what is made of it, the
figures, the page.
"""
