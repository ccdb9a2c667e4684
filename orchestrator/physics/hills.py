"""Hills in a wind tunnel over which the flow was measured: RUSHIL.

L. H. Khurshudyan, W. H. Snyder and I. V. Nekrasov, EPA-600/4-81-067, 1981: three hills of one
height and of half lengths 3, 5 and 8 times that, across a rough boundary layer. ERCOFTAC's case 69.
"""

from dataclasses import dataclass

NEAR = 0.02
"""Share by which a hill, or ten times by which z0, may differ and still be the experiment's."""
HEIGHT_OVER_ROUGHNESS = 0.117 / 1.57e-4
"""Height of the hills over z0: ERCOFTAC's data begin at 0.157 mm, the z0 of the wall."""


@dataclass(frozen=True)
class MeasuredHill:
    """Measurements behind a hill.

    Attributes
    ----------
    aspect : float
        Half length over height.
    reattachment : float
        Where reversed flow ends behind the top, heights; 0: there was none in the mean.
    source : str
        Where the number is from.
    verified : bool
        Whether the number was read in its source; others are shown as unverified.
    """

    aspect: float
    reattachment: float
    source: str
    verified: bool = True


_SUMMARY = "separated behind the steepest hill alone: EPA-600/S4-81-067"
RUSHIL = (
    MeasuredHill(3.0, 6.5, f"{_SUMMARY}; the length is unverified", verified=False),
    MeasuredHill(5.0, 0.0, _SUMMARY),
    MeasuredHill(8.0, 0.0, _SUMMARY),
)


def measured(aspect: float, height_over_roughness: float) -> MeasuredHill | None:
    """The hill of the experiment that a hill of this half length and roughness is, if any."""
    if abs(height_over_roughness / HEIGHT_OVER_ROUGHNESS - 1) > 10 * NEAR:
        return None
    return next((one for one in RUSHIL if abs(aspect / one.aspect - 1) < NEAR), None)
