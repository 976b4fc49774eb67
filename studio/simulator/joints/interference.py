"""Interference of structured-light cameras in the skeletons of `noisy_joints`.

It applies the depth simulator's model to joints instead of pixels (`sensor.structured_light`; its shares follow the
thesis's figure 5.2: three cameras can be used, four cannot). With n cameras:

- the noise grows by a tenth for every other camera;
- patches of the image have no reading: a share `DISTURBED[n - 1] - DISTURBED[0]` at 2.5 m, growing with the square of
  the distance. A joint in a patch is a guess: its noise is four times as strong, like that of a hidden joint. Half of
  the guesses have a confidence of 0.2 to 0.5, the others keep theirs, a fault that the thesis describes
  (5.2). Patches last 2 to 12 frames;
- a frame with over half of the joints in patches has no skeleton.

So two cameras disturb each other little, three visibly, and four lose the skeleton most of the time.
"""

import numpy as np
from numpy.typing import NDArray

from studio.simulator.sensor.structured_light import DISTURBED

_MORE_NOISE = 0.1
_GUESSED_TIMES = 4.0
_SURE = 0.5
_SHORTEST, _LONGEST = 2, 12
_AT_M = 2.5
_AR = 0.8
_ALONG_PER_M, _ACROSS_M = 0.0016, 0.01
_MOST = 0.98


def disturb(
    positions_m: NDArray[np.float64], confidence: NDArray[np.float64], cameras: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return one camera's skeletons, disturbed by other structured-light cameras.

    Args:
        positions_m: joints in the camera frame [m], shape (F, 21, 3); NaN = unseen.
        confidence: shape (F, 21).
        cameras: number of cameras, this one included; one alone is not disturbed.
        rng: of this camera's disturbance.
    """
    if cameras < 2:
        return positions_m, confidence
    frames, joints = confidence.shape
    ranges = np.linalg.norm(positions_m, axis=2)
    middle = np.nanmedian(ranges, axis=1, keepdims=True)
    lost = DISTURBED[min(cameras, len(DISTURBED)) - 1] - DISTURBED[0]
    share = np.minimum(lost * (middle / _AT_M) ** 2, _MOST)
    patch = _bursts(np.broadcast_to(share, (frames, joints)), rng)
    level = 1.0 + _MORE_NOISE * (cameras - 1)
    added = np.where(patch, np.sqrt(_GUESSED_TIMES**2 - 1.0), np.sqrt(level**2 - 1.0))
    noise = _coloured(rng, (frames, joints, 3))
    ray = positions_m / ranges[..., None]
    size = np.stack([_ALONG_PER_M * ranges**2, np.full_like(ranges, _ACROSS_M)], axis=-1) * added[..., None]
    along = (noise * ray).sum(axis=-1, keepdims=True)
    shifted = positions_m + size[..., :1] * along * ray + size[..., 1:] * (noise - along * ray)
    unsure = patch & (rng.random(patch.shape) >= _SURE)
    sure = np.where(unsure, np.minimum(confidence, rng.uniform(0.2, 0.5, patch.shape)), confidence)
    gone = patch.mean(axis=1) > 0.5
    shifted[gone], sure[gone] = np.nan, 0.0
    return shifted, sure


def _bursts(share: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.bool_]:
    """Joint-frames in a patch, on average `share` of all, shape (F, J)."""
    mean = 0.5 * (_SHORTEST + _LONGEST)
    out = np.zeros(share.shape, dtype=bool)
    left = np.zeros(share.shape[1], dtype=np.int64)
    for f, now in enumerate(share):
        starts = rng.random(len(left)) < now / ((1.0 - now) * mean)
        lengths = rng.integers(_SHORTEST, _LONGEST + 1, len(left))
        left = np.maximum(left - 1, 0)
        left = np.where((left == 0) & starts, lengths, left)
        out[f] = left > 0
    return out


def _coloured(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Noise of SD 1 that is correlated between frames, like the tracker's own."""
    noise = rng.normal(size=shape)
    for f in range(1, shape[0]):
        noise[f] = _AR * noise[f - 1] + np.sqrt(1.0 - _AR**2) * noise[f]
    return noise
