"""When does a sediment grain, or a whole bedform of grains, start to move?

A study file goes in; OpenFOAM and LIGGGHTS cases, tables, figures and a page come out.
"""

__version__ = "0.1.0"
