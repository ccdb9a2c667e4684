"""Piles on a bed that changes beside the same on the frozen one, grain by grain."""

from collections.abc import Iterator, Sequence
from math import ceil

import numpy as np
import pandas as pd

from orchestrator.fidelity.levels import changed
from orchestrator.fidelity.limits import FROZEN_BED
from orchestrator.grains import threshold
from orchestrator.tables.piles import Answer, shields
from orchestrator.tables.scenes import point


def tables(ready: Sequence[Answer]) -> Iterator[pd.DataFrame]:
    """For each pile whose bed changes and that has a twin on the frozen bed: a row for each n."""
    frozen = {one.scene_id: one for one in ready if not one.pile.scene.protocol.update}
    for one in ready:
        asked = one.decision.asked
        if asked.protocol.update:
            twin = frozen.get(changed(asked, {"protocol.update": 0.0}).id)
            if twin:
                yield compared(one, twin)


def compared(changing: Answer, frozen: Answer) -> pd.DataFrame:
    """The thresholds of a pile at each n, up to the last fraction, on both beds."""
    scene, count = changing.pile.scene, changing.motion.count
    moved = np.arange(1, ceil(max(scene.protocol.fractions) * count - 1e-9) + 1)
    own, other = (
        [
            threshold.of_pile(one.motion, one.face.speed, n / count, scene.fluid.density)
            for n in moved.tolist()
        ]
        for one in (changing, frozen)
    )
    here, there = (np.array([one.tau for one in found]) for found in (own, other))
    flows = (np.array([one.ustar0 for one in found]) for found in (own, other))
    change = here / there - 1
    beyond = moved[np.abs(change) > FROZEN_BED] / count
    return pd.DataFrame(
        {
            "scene_id": changing.scene_id,
            **point(scene),
            "packing": changing.pile.bed.packing,
            "count": count,
            "moved": moved,
            "fraction_moved": moved / count,
            "shields": shields(scene, here),
            "shields_frozen": shields(scene, there),
            "change": change,
            "change_ustar0": np.divide(*flows) - 1,
            "holds_until": beyond[0] if len(beyond) else np.nan,
        }
    )
