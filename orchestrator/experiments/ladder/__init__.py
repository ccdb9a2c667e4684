"""The ladder: what each fidelity level costs, and how far its thresholds are from the dearest."""
