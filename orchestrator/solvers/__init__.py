"""The external programs: how each is run, which version it is, and what its end means."""
