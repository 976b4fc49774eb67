"""A view as the adjustment uses it: rays times a focal length, and the size of the body, by frame.

Landmarks of a camera with a known lens are undistorted here, once. For other cameras the focal length is guessed.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.views.seen.view import COLUMNS, OTHER_SIDE, View
from studio.engine.model.cameras.joint_noise import LANDMARK_M
from studio.engine.model.cameras.lens import usual_lens

SMOOTH_S = 0.03
"""Standard deviation of the smoothing kernel for landmarks. It is the same for all cameras, so that they still agree
on joints in fast motion."""
SPEED_S = 0.08
"""The same for speeds. Speeds from few frames are uncertain, and their noise makes clock offsets too small."""
_SMOOTH_STEPS, _NEAR_STEPS = 0.9, 1.3
"""For slow cameras, in steps between frames: `SMOOTH_S`, and the largest distance of a frame that counts."""
_WINDOW = 13
_NEAR_S = 0.06
_LOW_CONFIDENCE = 0.5


@dataclass(frozen=True)
class ViewTrack:
    """Landmarks of a view, of `view.JOINTS`.

    Attributes:
        time_s: on the camera's own clock [s], shape (frame_count,).
        points: [pixel] from the picture's middle, undistorted if the lens is known, shape (frame_count, 17, 2).
        seen: shape (frame_count, 17).
        sigma: usual error [pixel], shape (frame_count, 17).
        world_m: the network's guess of the joints relative to the hips [m], shape (frame_count, 17, 3).
        focal: known or first focal length [pixel].
        known: whether the lens is known; its focal length may still have a deviation, `focal_share`.
        focal_share: see `View`.
        clock_within_s: see `View`.
    """

    time_s: NDArray[np.float64]
    points: NDArray[np.float64]
    seen: NDArray[np.bool_]
    sigma: NDArray[np.float64]
    world_m: NDArray[np.float64]
    focal: float
    known: bool
    focal_share: float = 0.0
    clock_within_s: float | None = None

    @property
    def step_s(self) -> float:
        """Return the usual time between two frames [s]."""
        return float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else 0.0

    @property
    def near_s(self) -> float:
        """Return the largest time from an instant to a frame that counts for it [s]."""
        return max(_NEAR_S, _NEAR_STEPS * self.step_s)

    def exchanged(self, swapped: NDArray[np.bool_]) -> "ViewTrack":
        """Return the track with left and right exchanged where `swapped`, shape (frame_count, 17), is True."""
        out = {}
        for name in ("points", "seen", "sigma", "world_m"):
            value = getattr(self, name)
            mask = swapped.reshape(swapped.shape + (1,) * (value.ndim - 2))
            out[name] = np.where(mask, value[:, OTHER_SIDE], value)
        return replace(self, **out)


@dataclass(frozen=True)
class Sample:
    """Landmarks of one camera at common instants.

    Attributes:
        points: [pixel], shape (instant_count, 17, 2); 0 where unseen.
        speed: [pixel/s], same shape.
        weight: inverse of the squared usual error [1/pixel^2], shape (instant_count, 17); 0 where unseen.
    """

    points: NDArray[np.float64]
    speed: NDArray[np.float64]
    weight: NDArray[np.float64]


def make_track(view: View) -> ViewTrack:
    """Return the view's landmarks relative to the picture's middle, with their usual errors."""
    seen, pixels = view.seen[:, COLUMNS], view.pixels[:, COLUMNS]
    pixels = np.where(seen[..., None], pixels, 0.0)
    world = np.where(seen[..., None], view.world_m[:, COLUMNS], 0.0)
    if view.lens is None:
        usual = usual_lens(view.width, view.height)
        focal, points = usual.fx, pixels - [usual.cx, usual.cy]
    else:
        focal = (view.lens.fx + view.lens.fy) / 2
        points = view.lens.rays_of(pixels) * focal
        seen = seen & np.isfinite(points).all(axis=2)
    sigma = LANDMARK_M * _pixels_per_metre(points, world, seen)[:, None] * np.ones(seen.shape)
    sigma = np.where(view.confidence[:, COLUMNS] < _LOW_CONFIDENCE, 2.5 * sigma, sigma)
    points = np.where(seen[..., None], points, 0.0)
    known = view.lens is not None
    return ViewTrack(
        view.time_s, points, seen, sigma, world, focal, known, view.focal_share, view.clock_within_s
    )


def apart_within_s(a: ViewTrack, b: ViewTrack) -> float:
    """Return the largest difference between two cameras' clocks [s]; infinite if unknown."""
    if a.clock_within_s is None or b.clock_within_s is None:
        return np.inf
    return a.clock_within_s + b.clock_within_s


def _pixels_per_metre(
    points: NDArray[np.float64], world: NDArray[np.float64], seen: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the body's size in the picture, shape (frame_count,): its spread divided by that of the guess."""
    count = np.maximum(seen.sum(axis=1), 1)[:, None]
    w = seen[..., None]
    a = (points - (points * w).sum(axis=1, keepdims=True) / count[..., None]) * w
    b = (world[..., :2] - (world[..., :2] * w).sum(axis=1, keepdims=True) / count[..., None]) * w
    size = np.sqrt((a**2).sum(axis=(1, 2)) / np.maximum((b**2).sum(axis=(1, 2)), 1e-6))
    usual = float(np.median(size[seen.sum(axis=1) >= 6])) if (seen.sum(axis=1) >= 6).any() else 1.0
    return np.clip(np.nan_to_num(size, nan=usual), usual / 4, usual * 4)


def sample(track: ViewTrack, times_s: NDArray[np.float64]) -> Sample:
    """Return landmarks and their speeds at times of the camera's own clock, by lines fitted around each time.

    Speeds come from longer lines.
    """
    count = len(track.time_s)
    first = np.searchsorted(track.time_s, times_s) - _WINDOW // 2
    rows = np.clip(first[:, None] + np.arange(_WINDOW), 0, count - 1)
    fresh = first[:, None] + np.arange(_WINDOW) == rows
    dt = track.time_s[rows] - times_s[:, None]
    smooth_s, near_s = max(SMOOTH_S, _SMOOTH_STEPS * track.step_s), track.near_s
    seen, pixels = fresh[..., None] * track.seen[rows], track.points[rows]
    w = _kernel(dt, smooth_s)[..., None] * seen
    before = (w * (dt <= 1e-9)[..., None] * (dt > -near_s)[..., None]).any(axis=1)
    after = (w * (dt >= -1e-9)[..., None] * (dt < near_s)[..., None]).any(axis=1)
    points, _, certain = _line(pixels, w, dt)
    _, speed, _ = _line(pixels, _kernel(dt, max(SPEED_S, 2.0 * smooth_s))[..., None] * seen, dt)
    s0, sure = w.sum(axis=1), before & after & certain
    variance = np.einsum("fkj,fkj->fj", w, track.sigma[rows] ** 2) / np.where(s0 > 0, s0, 1.0)
    weight = np.where(sure & (variance > 0), 1.0 / np.where(variance > 0, variance, 1.0), 0.0)
    return Sample(np.where(sure[..., None], points, 0.0), np.where(sure[..., None], speed, 0.0), weight)


def _kernel(dt: NDArray[np.float64], deviation_s: float) -> NDArray[np.float64]:
    return np.exp(-0.5 * (dt / deviation_s) ** 2) * (np.abs(dt) < 3 * deviation_s)


def _line(
    pixels: NDArray[np.float64], w: NDArray[np.float64], dt: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return the value and the slope of weighted lines at time 0, shape (F, 17, 2), and whether they are certain.

    Args:
        pixels: shape (F, frame_count, 17, 2); w: shape (F, frame_count, 17); dt: shape (F, frame_count).
    """
    s0, s1, s2 = (np.einsum("fkj,fk->fj", w, dt**n) for n in range(3))
    p0, p1 = (np.einsum("fkj,fk,fkjc->fjc", w, dt**n, pixels) for n in range(2))
    flat = s0 * s2 - s1**2
    certain = flat > 1e-9
    s0, s1, s2, flat = (one[..., None] for one in (s0, s1, s2, np.where(certain, flat, 1.0)))
    return (s2 * p0 - s1 * p1) / flat, (s0 * p1 - s1 * p0) / flat, certain


def nearest(track: ViewTrack, times_s: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the frame nearest to each time on the camera's own clock, and whether it is near enough to be used."""
    rows, away_s = nearest_time(track.time_s, times_s)
    return rows, away_s < track.near_s


def nearest_time(
    times_s: NDArray[np.float64], wanted_s: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the index of the time nearest to each wanted one, and the difference between the two [s]."""
    right = np.clip(np.searchsorted(times_s, wanted_s), 1, len(times_s) - 1)
    left = right - 1
    rows = np.where(wanted_s - times_s[left] < times_s[right] - wanted_s, left, right)
    return rows, np.abs(times_s[rows] - wanted_s)
