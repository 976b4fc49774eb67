"""Claps in a sound: onsets that are sharp, loud and short."""

import numpy as np
from numpy.typing import NDArray

from studio.take.video.sync.sound import RATE_HZ, Sound

_STEP_S = 0.002
_BEFORE_S, _AFTER_S = 0.1, 0.3
_LOW_HZ = 400.0
_RISE, _FALL = 10.0, 4.0
"""Minimum ratios of a clap's amplitude to that of the tenth of a second before, and to that 0.3 s later."""
_LOUD = 0.35
"""Minimum amplitude of another clap, as a share of the loudest clap's."""
_APART_S = 0.25
_EDGE = 0.25


def find_claps(sound: Sound) -> list[float]:
    """Return the times at which claps begin, on the clock of the video's pictures [s], in order."""
    from scipy.ndimage import maximum_filter1d
    from scipy.signal import butter, sosfilt

    step = round(_STEP_S * RATE_HZ)
    count = len(sound.samples) // step
    if count * _STEP_S < _BEFORE_S + _AFTER_S:
        return []
    sos = butter(2, _LOW_HZ, "highpass", fs=RATE_HZ, output="sos")
    filtered = np.abs(sosfilt(sos, sound.samples.astype(np.float64)))
    loud = filtered[: count * step].reshape(count, step).max(axis=1)
    before, after = round(_BEFORE_S / _STEP_S), round(_AFTER_S / _STEP_S)
    quiet = _loudest(loud, -before, -2)
    later = _usual(loud, after, 2 * after)
    peak = maximum_filter1d(loud, 5)  # the attack may take a few steps
    sharp = (peak > _RISE * np.maximum(quiet, 1e-4)) & (peak > _FALL * later)
    found = [int(k) for k in np.flatnonzero(sharp)]
    groups: list[list[int]] = []
    for k in found:
        if groups and k - groups[-1][-1] < _APART_S / _STEP_S:
            groups[-1].append(k)
        else:
            groups.append([k])
    heights = [float(loud[group[0] : group[-1] + 5].max()) for group in groups]
    loudest = max(heights, default=0.0)
    return [
        sound.begins_s + _edge(filtered, group[0] * step, height) / RATE_HZ
        for group, height in zip(groups, heights, strict=True)
        if height > _LOUD * loudest
    ]


def _loudest(loud: NDArray[np.float64], begin: int, end: int) -> NDArray[np.float64]:
    """Return the loudest of the steps from `begin` to `end` relative to each; nothing was before the beginning."""
    from scipy.ndimage import maximum_filter1d

    size = end - begin + 1
    padded = np.concatenate(
        [np.full(-begin, np.inf), loud]
    )  # a sound that begins with noise has no onset there
    whole = maximum_filter1d(padded, size, origin=size // 2, mode="nearest")
    return whole[-begin + end : len(loud) - begin + end]


def _usual(loud: NDArray[np.float64], begin: int, end: int) -> NDArray[np.float64]:
    """Return the mean loudness of the steps from `begin` to `end` after each."""
    total = np.concatenate([[0.0], np.cumsum(loud)])
    first = np.clip(np.arange(len(loud)) + begin, 0, len(loud))
    last = np.clip(np.arange(len(loud)) + end, 0, len(loud))
    return (total[last] - total[first]) / np.maximum(last - first, 1)


def _edge(samples: NDArray[np.float64], start: int, height: float) -> int:
    """Return the first sample from about `start` on that is as loud as a share of the clap."""
    begin = max(start - round(0.006 * RATE_HZ), 0)
    part = samples[begin : begin + round(0.03 * RATE_HZ)]
    return begin + int(np.argmax(part > _EDGE * height))
