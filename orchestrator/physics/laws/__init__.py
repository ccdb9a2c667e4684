"""The force laws by name."""

import difflib

from orchestrator.errors import InputError
from orchestrator.physics.force_law import ForceLaw
from orchestrator.physics.laws.bridged import Bridged, BridgedGravel
from orchestrator.physics.laws.claudin_andreotti import ClaudinAndreotti
from orchestrator.physics.laws.high import High
from orchestrator.physics.laws.low import Low
from orchestrator.physics.laws.profile import Profile
from orchestrator.physics.laws.zeng import Zeng, ZengTorque

KINDS: tuple[type[ForceLaw], ...] = (
    Low,
    High,
    Bridged,
    BridgedGravel,
    Profile,
    ClaudinAndreotti,
    Zeng,
    ZengTorque,
)

LAWS: dict[str, ForceLaw] = {kind.name: kind() for kind in KINDS}
"""Every law; a new one is a file of this package and a line above."""


def law(name: str) -> ForceLaw:
    """The law of a name.

    Raises
    ------
    InputError
        If no law has that name; it lists those that there are.
    """
    if name in LAWS:
        return LAWS[name]
    close = difflib.get_close_matches(name, LAWS, n=1)
    hint = f"did you mean {close[0]}? " if close else ""
    raise InputError(f"unknown force law {name!r}", remedy=f"{hint}known laws: {', '.join(LAWS)}")
