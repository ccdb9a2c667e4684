"""What an answer costs where no solver runs for it."""

import time
from pathlib import Path

from orchestrator.grains.loads import forget_loads
from orchestrator.grains.pile import Pile


def time_alone_s(pile: Pile, cases: Path) -> float:
    """Measure the time in which the grains of a pile move without a run of DEM.

    It is the time of this pile alone: a packing or a threshold that another pile needed
    before is found again.

    Parameters
    ----------
    pile
        The pile.
    cases
        The directory of the finished runs.

    Returns
    -------
    float
        Time of one core, s.
    """
    forget_loads()
    alone = Pile(pile.scene, pile.cases)
    started = time.process_time()
    alone.motion(cases)
    return time.process_time() - started
