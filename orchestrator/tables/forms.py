"""The forms of a train: how much each shelters the next, and the flow at which its grains go."""

from collections.abc import Iterator

import numpy as np

from orchestrator.grains import threshold
from orchestrator.tables.piles import Answer
from orchestrator.tables.scenes import Row


def rows(answer: Answer) -> Iterator[Row]:
    """A row for each form and each fraction of its own counted grains."""
    pile = answer.pile
    bed, face = pile.bed, answer.face
    if bed.forms == 1 or bed.profile:
        return
    line = pile.model.line
    period = bed.spacing or (line.x[-2] - line.x[1]) / bed.forms
    form = np.clip(np.floor(face.x / period).astype(int), 0, bed.forms - 1)
    flow = threshold.of_grains(answer.motion).value
    for fraction in pile.scene.protocol.fractions:
        first = np.nan
        for number in range(bed.forms):
            own = form == number
            needed = max(int(np.ceil(fraction * own.sum() - 1e-9)), 1)
            sorted_ = np.sort(np.nan_to_num(flow[own], nan=np.inf))
            reached = float(sorted_[needed - 1]) if own.any() else np.nan
            first = reached if number == 0 else first
            # loose grains of the first form move in still fluid: nothing is a multiple of that
            ratio = reached / first if first > 0 else np.nan
            yield {
                "scene_id": answer.scene_id,
                "form": number + 1,
                "count": int(own.sum()),
                "fraction": fraction,
                "mean_ustar_over_ustar0": float(face.speed[own].mean()) if own.any() else np.nan,
                "ustar0_m_s": reached if np.isfinite(reached) else np.nan,
                "over_first_form": ratio if np.isfinite(ratio) else np.nan,
            }
