"""Offset between two sounds of one scene: generalised cross-correlation of short pieces.

Each sound is whitened in time and frequency, so that neither a hum nor one loud moment decides (Knapp and Carter,
"The generalized correlation method for estimation of time delay", 1976). Pieces of one are searched in the other.
Those that agree give the offset, and over long files the drift of one clock against the other. If too few agree,
there is no result.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.take.video.sync.sound import RATE_HZ, Sound

_PIECE_S, _MOST_PIECES = 8.0, 16
_SHORTEST_S = 1.0
_WINDOW = 512
_BAND_HZ = (150.0, 3600.0)
_SLOW_S = 1.0
_QUIET, _NOISE = 0.2, 2.0
"""Quantile of a frequency's loudness over time, and the factor on it below which all counts as noise."""
_MOST_SEEDS = 6
_NEAR_S, _NEAR_CLEAR = 1.0, 6.0
"""Search distance [s] and minimum peak height (see `_CLEAR`) of other pieces once one piece was found."""
_CLEAR = 8.0
"""Minimum height of a piece's peak over the usual size of the correlation; chance gives 6 over an hour."""
_BESIDE_S, _SECOND = 0.02, 1.25
"""Distance within which other peaks belong to the peak [s], and its minimum ratio to all other peaks."""
_AGREE_S = 0.02
_LEAST_SHARE = 0.4
_DRIFT_FROM_S, _MOST_DRIFT = 60.0, 300e-6

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Delay:
    """Offset and drift between two sounds.

    Attributes:
        ahead_s: added to times of the second sound to give those of the first, at the second's time 0 [s].
        drift: how much faster the first clock runs, as a share; 0 unless another value is certain.
        share: of the pieces that agree.
        height: of their peaks over what chance gives.
    """

    ahead_s: float
    drift: float
    share: float
    height: float


def find_delay(first: Sound, second: Sound) -> Delay | None:
    """Return the offset and drift between two sounds; None if they are not clear."""
    shorter, longer = sorted((first, second), key=lambda sound: len(sound.samples))
    if len(shorter.samples) < _SHORTEST_S * RATE_HZ or shorter.silent or longer.silent:
        return None
    whole, pieces = _Whole(_whitened(longer.samples)), _pieces(_whitened(shorter.samples))
    for seed in _spread(len(pieces))[:_MOST_SEEDS]:
        start, piece = pieces[seed]
        best = whole.find(piece)
        if best is None:
            continue
        near = [whole.find(other, best[0] + (at - start) / RATE_HZ) for at, other in pieces]
        near[seed] = best
        found = [(at / RATE_HZ, *one) for (at, _), one in zip(pieces, near, strict=True) if one is not None]
        at, lag, height = np.array(found).T
        times, ahead = at + shorter.begins_s, lag - at + longer.begins_s - shorter.begins_s
        agree = _agreeing(times, ahead, height)
        if agree.sum() < max(1.0, _LEAST_SHARE * len(pieces)):
            continue
        offset, drift = _line(times[agree], ahead[agree])
        if shorter is first:  # the longer's time is offset + (1 + drift) times the shorter's: turn it round
            offset, drift = -offset / (1.0 + drift), 1.0 / (1.0 + drift) - 1.0
        return Delay(offset, drift, float(agree.mean()), float(np.median(height[agree])))
    return None


def _spread(count: int) -> list[int]:
    """Return the places of pieces, those in the middle first."""
    return sorted(range(count), key=lambda k: abs(k - (count - 1) / 2))


def _count(samples: int) -> int:
    return int(np.clip(samples // (_PIECE_S * RATE_HZ), 1, _MOST_PIECES))


def _pieces(sound: Array) -> list[tuple[int, Array]]:
    """Return evenly spread pieces of a sound with the indices at which they begin."""
    count, length = _count(len(sound)), min(int(_PIECE_S * RATE_HZ), len(sound))
    starts = np.linspace(0, len(sound) - length, count).round().astype(int)
    return [(int(start), sound[start : start + length]) for start in starts]


def _whitened(samples: NDArray[np.float32]) -> Array:
    """Return a sound in which every part of the band and every second is about equally loud."""
    from scipy.ndimage import uniform_filter1d
    from scipy.signal import istft, stft

    hop_s = _WINDOW / 2 / RATE_HZ
    frequencies, _, spectrum = stft(samples.astype(np.float64), RATE_HZ, nperseg=_WINDOW)
    size = np.abs(spectrum)
    usual = uniform_filter1d(size, max(3, round(_SLOW_S / hop_s)), axis=1, mode="nearest")
    floor = 1e-3 * float(usual.max()) + 1e-12
    noise = _NOISE * np.quantile(size, _QUIET, axis=1, keepdims=True)
    heard = np.maximum(1.0 - (noise / (size + floor)) ** 2, 0.0)
    even = heard * spectrum / (np.sqrt(size * usual) + floor)
    even[(frequencies < _BAND_HZ[0]) | (frequencies > _BAND_HZ[1])] = 0.0
    _, sound = istft(even, RATE_HZ, nperseg=_WINDOW)
    return sound[: len(samples)]


class _Whole:
    """A sound in which pieces are searched."""

    def __init__(self, sound: Array) -> None:
        from scipy.fft import next_fast_len, rfft

        self._sound, self._count = sound, len(sound)
        self._margin = min(int(_PIECE_S * RATE_HZ), self._count)
        self._size = next_fast_len(self._count + self._margin, real=True)
        self._spectrum = rfft(sound, self._size)
        energy = np.concatenate([[0.0], np.cumsum(sound**2)])
        self._energy = energy

    def find(self, piece: Array, near_s: float | None = None) -> tuple[float, float] | None:
        """Return a piece's start in the sound [s], maybe before its first sample, and the height of its peak.

        None if no place is clearly the best.

        Args:
            near_s: search only near that time [s]; None = everywhere.
        """
        if not float((piece**2).sum()) > 0:
            return None
        first, last = -len(piece) + 1, self._count
        if near_s is not None:
            middle, reach = round(near_s * RATE_HZ), round(_NEAR_S * RATE_HZ)
            first, last = max(first, middle - reach), min(last, middle + reach)
        if last - first < 3:
            return None
        lags = np.arange(first, last)
        values = self._correlation(piece, near_s is None, lags)
        begin, end = np.clip(lags, 0, self._count), np.clip(lags + len(piece), 0, self._count)
        heard = self._energy[end] - self._energy[begin]
        values = values / np.sqrt(heard + 0.1 * float(heard.max()) + 1e-12)
        usual = 1.4826 * float(np.median(np.abs(values))) + 1e-12
        best = int(values.argmax())
        beside = round(_BESIDE_S * RATE_HZ)
        others = np.concatenate([values[: max(best - beside, 0)], values[best + beside :]])
        height = float(values[best]) / usual
        if height < (_CLEAR if near_s is None else _NEAR_CLEAR):
            return None
        if len(others) and values[best] < _SECOND * others.max():
            return None
        return (lags[best] + _top(values, best)) / RATE_HZ, height

    def _correlation(self, piece: Array, everywhere: bool, lags: NDArray[np.int64]) -> Array:
        from scipy.fft import irfft, rfft
        from scipy.signal import correlate

        if everywhere:
            product = self._spectrum * np.conj(rfft(piece, self._size))
            return irfft(product, self._size)[lags]  # negative lags stand at the end
        first, end = int(lags[0]), int(lags[-1]) + len(piece)
        part = np.zeros(end - first)
        inside = slice(max(first, 0), min(end, self._count))
        part[inside.start - first : inside.stop - first] = self._sound[inside]
        return correlate(part, piece, mode="valid", method="fft")


def _top(values: Array, i: int) -> float:
    """Return the offset of the top of the parabola through a highest value and its neighbours, -0.5..0.5."""
    if not 0 < i < len(values) - 1:
        return 0.0
    left, middle, right = values[i - 1 : i + 2]
    curve = left - 2 * middle + right
    return float(np.clip(0.5 * (left - right) / curve, -0.5, 0.5)) if curve < 0 else 0.0


def _agreeing(times: Array, ahead: Array, height: Array) -> NDArray[np.bool_]:
    """Return which pieces agree with most of the others, allowing for a drift, shape (piece_count,)."""
    apart = np.abs(ahead[:, None] - ahead) < _AGREE_S + _MOST_DRIFT * np.abs(times[:, None] - times)
    return apart[int((apart * height).sum(axis=1).argmax())]


def _line(times: Array, ahead: Array) -> tuple[float, float]:
    """Return offset at time 0 and drift of a line through pieces; drift 0 if they do not show one."""
    if float(np.ptp(times)) < _DRIFT_FROM_S or len(times) < 4:
        return float(np.median(ahead)), 0.0
    count, third = len(times), max(1, len(times) // 3)
    order = np.argsort(times)
    first, last = order[:third], order[count - third :]
    span = float(np.median(times[last]) - np.median(times[first]))
    drift = float(np.median(ahead[last]) - np.median(ahead[first])) / span
    rest = ahead - drift * times
    offset = float(np.median(rest))
    noise = float(np.median(np.abs(rest - offset)))
    if abs(drift) * span < 3.0 * noise + 0.5e-3:
        return float(np.median(ahead)), 0.0
    return offset, drift
