"""Quick estimate of the cameras' agreement during a walk for calibration."""

from collections.abc import Mapping, Sequence

import numpy as np

from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.calibration.cameras.pairs import LocalClock, Track, grid, make_track, sample
from studio.engine.calibration.cameras.refine import BIAS_PRIOR_M, PlacedCamera
from studio.engine.calibration.cameras.rigid import fit_robust, middle_points
from studio.engine.calibration.cameras.time_offset import find_shift
from studio.engine.calibration.quality.residuals import Residuals, residuals
from studio.engine.model.frames import CameraFrame

_INSTANTS = 240
"""Number of instants used, spread over the walk: some milliseconds of work."""

_MIN_INSTANTS = 30
_NOTHING = Residuals(None, None, None, 0)


def estimate_residuals(
    frames: Mapping[str, Sequence[CameraFrame]], starts_ns: Mapping[str, int], reference: str
) -> dict[str, Residuals]:
    """Return each camera's residuals against the reference camera, fitted and scored on the same few instants.

    One rigid fit of the trunk and the limbs' middles per camera, after a clock shift from the motion.
    Depth bias and swaps are not corrected, so the figures are somewhat larger than a calibration's.

    Args:
        frames: by camera, in device time order, each on its own clock.
        starts_ns: time of each camera's first frame on one common clock [ns].
        reference: the reference camera; it is not among the results.
    """
    tracks = {name: make_track(mine) for name, mine in frames.items()}
    main = tracks.get(reference)
    if main is None:
        return {}
    times = grid(main)
    times = times[:: max(len(times) // _INSTANTS, 1)]
    seen = sample(main, times)[0]
    out = {}
    for name, track in tracks.items():
        if name == reference:
            continue
        near_s = (starts_ns[name] - starts_ns[reference]) * 1e-9
        out[name] = _residuals(track, main, near_s, times, seen)
    return out


def _residuals(
    track: Track, reference: Track, near_s: float, times_s: np.ndarray, seen: np.ndarray
) -> Residuals:
    """Return one camera's residuals at these instants; `seen`: the reference's joints [m]."""
    if len(track.times_s) < 2 or len(times_s) < _MIN_INSTANTS:
        return _NOTHING
    shift = find_shift(track, reference, near_s=near_s)
    clock = LocalClock(shift.offset_s if shift.found else near_s)
    here = sample(track, clock.device_s(times_s))[0]
    source, target = (middle_points(unbiased(points, BIAS_PRIOR_M)) for points in (here, seen))
    both = np.all(np.isfinite(source), axis=2) & np.all(np.isfinite(target), axis=2)
    if both.any(axis=1).sum() < _MIN_INSTANTS:
        return _NOTHING
    fit = fit_robust(source[both], target[both])
    cameras = (PlacedCamera(np.eye(4), LocalClock()), PlacedCamera(fit.T, clock))
    nowhere = np.zeros(len(times_s), dtype=bool)
    return residuals((reference, track), cameras, times_s, nowhere, BIAS_PRIOR_M)
