"""How well a scene is answered: levels with known errors, checks by DEM, limits of the methods."""
