"""A picture of spheres in one plane, seen across it and lit from the eye."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

AMBIENT, DIFFUSE = 0.45, 0.6
"""Light that leaves a colour close to the one in the colour bar."""


def picture(
    centres: FloatArray,
    colours: FloatArray,
    window: tuple[float, float, float, float],
    columns: int,
) -> NDArray[np.uint8]:
    """Draw spheres one unit wide on a transparent ground.

    Parameters
    ----------
    centres : ndarray, shape (n, 2)
        Places in the plane; spheres may touch, not overlap.
    colours : ndarray, shape (n, 3)
        Red, green and blue, 0 … 1.
    window : tuple of float
        Left, right, bottom and top of the picture.
    columns : int
        Its width, pixels.

    Returns
    -------
    ndarray, shape (rows, columns, 4)
        Red, green, blue and opacity, 0 … 255; the first row is the top.
    """
    left, right, bottom, top = window
    scale = columns / (right - left)
    rows = round(scale * (top - bottom))
    grain, place, across = _pixels((centres - [left, top]) * [scale, -scale], scale, rows, columns)
    cover = np.clip(0.5 + scale / 2 * (1 - across), 0, 1)
    facing = np.sqrt(np.clip(1 - across**2, 0, None))
    shade = colours[grain] * np.minimum(AMBIENT + DIFFUSE * facing, 1)[:, None]

    def summed(weights: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(place, weights, rows * columns), float)

    opacity = summed(cover)
    inks = [summed(cover * ink) / np.maximum(opacity, 1e-9) for ink in shade.T]
    image = np.rint(255 * np.stack([*inks, np.minimum(opacity, 1)], axis=-1))
    return np.asarray(image, np.uint8).reshape(rows, columns, 4)


def _pixels(
    middles: FloatArray, scale: float, rows: int, columns: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Pixels that spheres cover: which sphere, which pixel, how far from its middle in radii."""
    reach = int(scale / 2) + 2
    near = np.arange(-reach, reach + 1)
    first = np.floor(middles).astype(np.int64)
    column = first[:, 0, None, None] + near
    row = first[:, 1, None, None] + near[:, None]
    x, y = middles.T[:, :, None, None]
    across = np.hypot(column + 0.5 - x, row + 0.5 - y) * 2 / scale
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    seen = inside & (across < 1 + 1 / scale)
    return np.nonzero(seen)[0], (row * columns + column)[seen], across[seen]
