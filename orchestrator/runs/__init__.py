"""Case directories and how they are run: nothing here knows of grains or studies."""
