"""Case directories and how they are run: nothing here knows of grains, flows or studies."""
