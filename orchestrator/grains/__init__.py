"""The grains of a bed: their deck for LIGGGHTS, their motion, their threshold."""
