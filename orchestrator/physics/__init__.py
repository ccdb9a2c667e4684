"""Forces on a grain, thresholds in closed form, published curves: no scenes, no files."""
