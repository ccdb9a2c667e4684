"""The command `threshold`: closed-form thresholds of single grains, for one or for ranges."""
