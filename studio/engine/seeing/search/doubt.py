"""Detection of a tracked body that no longer fits, and the headings at which it is restarted."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_EXPLAINED_SHARE, _LOST_SHARE = 0.80, 0.5
_BAD_LIMB_M2 = 1.0
_UNSURE = 0.5
"""Mean confidence of the limbs below which a frame does not fit."""
_DOUBT = 8
"""Number of frames without a fit after which other headings are tried, one per frame."""
_TURNS = np.radians([0.0, 180.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0])
_NONE = _TURNS[:0]
_PAUSE = 40
"""Frames before the headings are tried again."""
_JUMPED, _NEW = 0.5, 0.1
"""A body has jumped if its mean confidence falls below this share of the usual one; all headings are then tried at
once. The second number is a frame's weight in the usual confidence.
"""


class Doubt:
    """Quality of a body's fit over time.

    Attributes:
        lost: the body has explained few points for so long that a new search is needed.
    """

    def __init__(self) -> None:
        self.lost = False
        self._frames = 0
        self._tried = 0
        self._turn = 0
        self._usually = 1.0

    def turned(self) -> None:
        """Register that the body was turned round; headings are tried from the first again."""
        self._turn = 0

    def turns(self, explained: float, worst_limb_m2: float, sure: float, *, turning: bool) -> Array:
        """Return the turns of restarted bodies to try in this frame [rad], shape (n,).

        Args:
            explained: share of the points near the body.
            worst_limb_m2: largest residual of a limb [m2].
            sure: mean confidence of the limbs in the frame before.
            turning: whether the body may be lost in a turn; then one heading is tried.
        """
        bad = explained < _EXPLAINED_SHARE or worst_limb_m2 > _BAD_LIMB_M2 or sure < _UNSURE
        self._frames = self._frames + 1 if bad else max(self._frames - 2, 0)
        jumped = sure < _JUMPED * self._usually
        self._usually = sure if jumped else self._usually + _NEW * (sure - self._usually)
        if jumped:
            return _TURNS
        if self._frames >= _DOUBT:
            return self._in_doubt(explained)
        if not turning:
            return _NONE
        self._turn += 1
        return _TURNS[[(self._turn - 1) % len(_TURNS)]]

    def _in_doubt(self, explained: float) -> Array:
        self.lost = explained < _LOST_SHARE and self._frames > 10 * _DOUBT
        turn = self._tried % (len(_TURNS) + _PAUSE)
        self._tried += 1
        return _NONE if self.lost else _TURNS[turn : turn + 1]
