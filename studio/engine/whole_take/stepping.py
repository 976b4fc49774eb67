"""Steps of finishing over a take, window by window."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.whole_take.finish.contact.contacts import Contacts
from studio.engine.whole_take.finish.contact.others import OtherPerformer
from studio.engine.whole_take.finish.known import Known
from studio.engine.whole_take.finish.readings import Readings
from studio.engine.whole_take.finish.smoother import Smoother
from studio.engine.whole_take.finish.windows import MARGIN, WINDOW

HELD = 2
"""Fixed frames at the far end of a margin; an acceleration spans two further frames."""

MIN_FRAMES = 6
"""Shorter pieces between gaps are not refined."""


class Passes:
    """Reports progress of work with several passes over the take."""

    def __init__(self, progress: Callable[[float], None], count: int) -> None:
        """Prepare to report the share done of `count` passes to `progress`."""
        self._progress, self._count = progress, count
        self.done = 0

    def tell(self, share: float) -> None:
        """Report progress; `share`: of the present pass, 0..1."""
        self._progress((self.done + share) / self._count)


class Steps:
    """Steps over a take.

    Attributes:
        known: knowledge of an operator.
    """

    def __init__(
        self, readings: Readings, known: Known, passes: Passes, fixed: NDArray[np.bool_] | None = None
    ) -> None:
        """Prepare; `fixed`: frames that do not move, shape (frame_count,); None = none."""
        self.known = known
        self._readings, self._passes, self._fixed = readings, passes, fixed

    def step(
        self,
        q: NDArray[np.float64],
        pieces: list[tuple[int, int]],
        contacts: Contacts | None,
        smoother: Smoother,
        others: Sequence[OtherPerformer] = (),
    ) -> None:
        """Apply one Gauss-Newton step to the take, in place.

        With `others`, windows in which none of them is near do not change.
        """
        pinned = self.known.pinned
        for first, last in pieces:
            if last - first < MIN_FRAMES:
                continue
            kept = q[:0]
            for begin in range(first, last, WINDOW):
                end = min(begin + WINDOW, last)
                low, high = max(begin - MARGIN, first), min(end + MARGIN, last)
                here = [
                    part for other in others if (part := other.part(slice(low, high))).is_near(q[low:high])
                ]
                if others and not here and not self.known.is_held(slice(low, high)):
                    kept = q[max(end - MARGIN, first) : end].copy()
                    continue
                window = np.concatenate([kept[len(kept) - (begin - low) :], q[begin:high]])
                kept = q[max(end - MARGIN, first) : end].copy()
                stepped = smoother.stepped(
                    window,
                    self._readings.of(low, high),
                    None if contacts is None else contacts.part(slice(low, high)),
                    held=(
                        HELD if low > first or self._is_fixed(low) else 0,
                        HELD if high < last or self._is_fixed(high - 1) else 0,
                    ),
                    others=here,
                    pinned=None if pinned is None else pinned.part(slice(low, high)),
                )[begin - low : end - low]
                if self._fixed is not None:
                    stepped = np.where(self._fixed[begin:end, None], q[begin:end], stepped)
                q[begin:end] = stepped
                self._passes.tell(end / len(q))
        self._passes.done += 1

    def _is_fixed(self, frame: int) -> bool:
        return self._fixed is not None and bool(self._fixed[frame])
