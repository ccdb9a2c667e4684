"""When does a sediment grain, or a whole bedform of grains, start to move?

A study file goes in; OpenFOAM and LIGGGHTS cases, tables, figures and a page come out. Three
functions are public: `threshold`, `run` and `open`.
"""

import os
import re
from typing import TYPE_CHECKING, Any

# of builds; but libraries read it when they are imported, and fail where it is no time
if not re.fullmatch("[0-9]{1,11}", os.environ.get("SOURCE_DATE_EPOCH", "0")):
    del os.environ["SOURCE_DATE_EPOCH"]

if TYPE_CHECKING:
    from orchestrator.face import open, run, threshold

__version__ = "0.1.0"
__all__ = ["open", "run", "threshold"]


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


def __getattr__(name: str) -> Any:
    # importing the package alone must not take the time of pandas
    if name in __all__:
        from orchestrator import face

        return getattr(face, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
