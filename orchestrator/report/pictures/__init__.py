"""Pictures of single runs: the flow and its mesh, grains at an instant, the crest in motion."""
