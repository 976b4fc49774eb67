"""Colours of performers, wherever several are drawn."""

PERFORMER_COLOURS: tuple[tuple[int, int, int], ...] = (
    (122, 164, 212),
    (224, 136, 112),
    (142, 188, 124),
    (178, 146, 214),
    (216, 184, 92),
    (96, 186, 186),
    (216, 140, 180),
    (170, 156, 136),
)
"""Colours of several performers, by number; they repeat when there are more."""


def performer_colour(number: int) -> tuple[int, int, int]:
    """Return the colour of a performer among several, RGB 0..255, by their number from 1."""
    return PERFORMER_COLOURS[(number - 1) % len(PERFORMER_COLOURS)]
