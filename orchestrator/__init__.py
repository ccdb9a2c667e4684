"""When does a sediment grain, or a whole bedform of grains, start to move?

A study file goes in; OpenFOAM and LIGGGHTS cases, tables, figures and a page come out.
Three functions are public: `threshold`, `run` and `open`.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from orchestrator.face import open, run, threshold

__version__ = "0.1.0"
__all__ = ["open", "run", "threshold"]


def __dir__() -> list[str]:
    return ["__version__", *__all__]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from orchestrator import face  # only now: it takes the time of pandas

    return getattr(face, name)
