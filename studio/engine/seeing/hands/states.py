"""Hand states of one camera over time: both methods, smoothed, with a probability."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.frames import HandSeen
from studio.engine.model.joints import INDEX
from studio.engine.seeing.hands.circles import UNKNOWN, circles_state
from studio.engine.seeing.hands.shape import shape_networks
from studio.engine.seeing.hands.window import hand_window
from studio.engine.seeing.images.convolution import Committee

_CHANGES_PER_S = 0.4
"""Rate at which a hand opens or closes."""

_LARGEST_LOG_ODDS = 6.0
"""Largest log-odds of one image. Chosen on tuning performers, as is `_CHANGES_PER_S`."""

_LENGTHS = 90
_PALM_M = 0.08
_SIDES = ("left", "right")


class HandStates:
    """Follows both hands of the performer in one camera's images.

    Args:
        camera: of the images.
        networks: of the method `shape`; the built-in ones where None.
    """

    def __init__(self, camera: DepthCamera, networks: Committee | None = None) -> None:
        self._camera = camera
        self._networks = shape_networks() if networks is None else networks
        self._lengths: dict[str, deque[float]] = {side: deque(maxlen=_LENGTHS) for side in _SIDES}
        self._open: dict[str, float] = dict.fromkeys(_SIDES, 0.5)
        self._time_ns: int | None = None

    def update(
        self,
        depth_mm: NDArray[np.uint16],
        positions: NDArray[np.float64],
        confidence: NDArray[np.float64],
        time_ns: int,
    ) -> tuple[HandSeen, ...]:
        """Return the states of the hands whose wrist and elbow are known; 0.5 = unknown.

        Args:
            depth_mm: the image, shape (H, W).
            positions: canonical joints in the camera frame [m], shape (21, 3).
            confidence: shape (21,).
            time_ns: of the image; images come in order of time.
        """
        dt = 0.0 if self._time_ns is None else max(time_ns - self._time_ns, 0) * 1e-9
        self._time_ns = time_ns
        seen: list[HandSeen] = []
        for side in _SIDES:
            self._open[side] = _forgotten(self._open[side], dt)
            wrist, elbow = (positions[INDEX[f"{side}_{joint}"]] for joint in ("wrist", "elbow"))
            sure = min(confidence[INDEX[f"{side}_{joint}"]] for joint in ("wrist", "elbow"))
            if sure <= 0.0 or not np.isfinite([*wrist, *elbow]).all():
                continue
            self._lengths[side].append(float(np.linalg.norm(wrist - elbow)))
            self._shape(side, depth_mm, wrist, elbow)
            way = (wrist - elbow) / max(float(np.linalg.norm(wrist - elbow)), 1e-6)
            circles = circles_state(self._camera, depth_mm, wrist + _PALM_M * way)
            seen.append(HandSeen(side, "shape", self._open[side]))
            seen.append(HandSeen(side, "circles", circles))
        return tuple(seen)

    def _shape(
        self, side: str, depth_mm: NDArray[np.uint16], wrist: NDArray[np.float64], elbow: NDArray[np.float64]
    ) -> None:
        """Update the probability of being open with an image's evidence (Bayes' rule on a two-state chain)."""
        forearm_m = float(np.median(self._lengths[side]))
        window = hand_window(self._camera, depth_mm, wrist, elbow, forearm_m, mirrored=side == "right")
        if window is None:
            return
        log_odds = float(self._networks(window.samples[None], window.about[None])[0, 0])
        log_odds = min(max(log_odds, -_LARGEST_LOG_ODDS), _LARGEST_LOG_ODDS)
        before = self._open[side]
        self._open[side] = 1.0 / (1.0 + (1.0 - before) / max(before, 1e-6) * math.exp(-log_odds))


def _forgotten(open_probability: float, dt: float) -> float:
    """Return the probability after a time without evidence; it approaches one half."""
    kept = math.exp(-2.0 * _CHANGES_PER_S * dt)
    return UNKNOWN + kept * (open_probability - UNKNOWN)
