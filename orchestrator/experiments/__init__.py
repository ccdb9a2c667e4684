"""Experiments on the method: what a level costs, how far it is off, where a method fails."""
