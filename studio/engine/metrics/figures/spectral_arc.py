"""Smoothness as the spectral arc length: the negative length of a speed's amplitude spectrum as a curve.

Source: Balasubramanian, Melendez-Calderon, Roby-Brami, Burdet, "On the analysis of movement smoothness", Journal of
NeuroEngineering and Rehabilitation 2015: spectra padded to 16 times the next power of two, cut off at 10 Hz and where
the amplitude last is 0.05 of that at 0 Hz. The method is made for single movements of some seconds, so a take is cut
into pieces of 4 s. Pieces in which the reference's joint is slower than 5 cm/s on average are left out.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.reference.matching import Matched

CUT_OFF_HZ = 10.0
LEAST_AMPLITUDE = 0.05
PAD_LEVEL = 4
PIECE_S = 4.0
SLOWEST_M_S = 0.05
_JOINTS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle")


def spectral_arc_lengths(matched: Matched) -> tuple[float | None, float | None]:
    """Return the mean spectral arc length of wrists and ankles: the solve's and the reference's; None without any."""
    names = [name for name in _JOINTS if matched.has(name)]
    frames = max(4, round(PIECE_S * matched.rate_hz))
    step = np.diff(matched.time_s)[:, None]
    speeds = [np.linalg.norm(np.diff(x, axis=0), axis=2) / step for x in matched.pick(names)]
    found: tuple[list[float], list[float]] = ([], [])
    for first in range(0, len(step) - min(frames, len(step)) + 1, frames):
        pieces = [speed[first : first + frames] for speed in speeds]
        for joint in range(len(names)):
            solve, reference = (piece[:, joint] for piece in pieces)
            if np.isfinite(solve + reference).all() and reference.mean() > SLOWEST_M_S:
                found[0].append(spectral_arc_length(solve, matched.rate_hz))
                found[1].append(spectral_arc_length(reference, matched.rate_hz))
    return (float(np.mean(found[0])), float(np.mean(found[1]))) if found[0] else (None, None)


def spectral_arc_length(speed: NDArray[np.float64], rate_hz: float) -> float:
    """Return the spectral arc length of a speed [any unit], shape (sample_count,); negative, near 0 = smooth."""
    count = 2 ** (int(np.ceil(np.log2(len(speed)))) + PAD_LEVEL)
    amplitude = np.abs(np.fft.rfft(speed, count))
    frequency = np.arange(len(amplitude)) * rate_hz / count
    peak = amplitude.max()
    if peak <= 0:
        return 0.0
    amplitude = (amplitude / peak)[frequency <= CUT_OFF_HZ]
    loud = np.flatnonzero(amplitude >= LEAST_AMPLITUDE)
    amplitude = amplitude[loud[0] : loud[-1] + 1]
    if len(amplitude) < 2:
        return 0.0
    along = 1.0 / (len(amplitude) - 1)  # the remaining band counts as 1 wide
    return float(-np.hypot(along, np.diff(amplitude)).sum())
