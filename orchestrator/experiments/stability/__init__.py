"""Maps of where each method fails; every cell is a run."""
