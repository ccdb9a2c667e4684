"""Pictures with fields of colours, whose colours a dark page does not turn."""

FIELDS = (b"<image", b"Quad", b"linearGradient", b'class="grains"')
"""What the SVG of a field of colours, or of grains, has."""


def is_field(image: bytes) -> bool:
    """Say whether a picture has a field of colours, such as a map of speeds.

    Parameters
    ----------
    image
        An SVG file.

    Returns
    -------
    bool
        Whether it has.
    """
    return any(mark in image for mark in FIELDS)
