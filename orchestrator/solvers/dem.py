"""The code of the discrete element method that moves grains here: what is asked of it.

All that is the code's own stands in one module: how it is started, what its end means,
and how its files are written and read. Another code is another such module, with its
templates. It has:

- ``PROGRAM``, ``ENVIRONMENT``: its program, and the variables that this runs with
- ``TEMPLATES``: the folder of its templates, with a deck ``bed`` and a deck ``poured``
- ``version``, ``programs``: its version, and all programs of a run on some processes
- ``ranks``: how many processes share the grains of a deck
- ``command``: the command that runs one deck and prints its words as they come
- ``check_log``: a `SolverError` where a run has not come to its own end
- ``write_parameters``, ``write_numbers``, ``write_sets``, ``write_grains``: the files
  of a deck: named numbers with their meaning, one number after another, values of some
  grains at each load step, and the grains themselves
- ``read_frames``: where grains were at some time steps
"""

from orchestrator.solvers import liggghts

ENGINE = liggghts
"""The code."""
