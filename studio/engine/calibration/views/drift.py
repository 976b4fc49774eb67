"""Clock drift of ordinary cameras over a take, the counterpart of `cameras.drift` for depth cameras.

In each window of the take, all calibrated cameras' rays are brought together, with one delay per camera. Each joint's
place is eliminated by itself (Schur's complement), so two cameras suffice. The drift is the slope of a robust line
through all windows (Theil-Sen). A prior on the drift of crystals draws it towards zero, because a window's delay is
known only to some milliseconds.
"""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.sentences import Said, say
from studio.engine.calibration.cameras.drift import LEAST_S, WINDOW_S, device_s, through, window_starts
from studio.engine.calibration.views.adjusting.rig import CameraRig, rig_of
from studio.engine.calibration.views.adjusting.sides import brought_together
from studio.engine.calibration.views.pictures import sees_no_depth, view_of
from studio.engine.calibration.views.seen.bodies import Array
from studio.engine.calibration.views.seen.tracks import Sample, ViewTrack, make_track
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame

USUAL_PPM = 50.0
"""Standard deviation of the drift between two ordinary clocks: crystals of phones and webcams have 20 to 50 ppm."""

JUMP_S, LONGEST_S = 0.04, 1.0
"""Smallest and largest jump of a clock that is found."""

_EDGE_S, _STEP_S = 0.5, 0.106
"""Time left out at both ends; step between instants, no multiple of frame periods, as in `starting.first`."""
_ROUNDS, _SETTLED_S, _MOST_STEP_S = 10, 0.001, 0.1
_LEAST_FRAMES, _LEAST_ROWS, _LEAST_WINDOWS = 20, 200, 4
_CAUCHY = 2.0
_SURE_S = 0.015
"""Largest standard deviation of a usable window's delay."""
_REPEATED = 5.0
"""Instants that count as one, because landmark errors are correlated."""


@dataclass(frozen=True)
class _Window:
    """Result of one window for a camera: its middle on the camera's clock since the clock's reference, the offset to
    add there, and the part of it that is new [s]."""

    device_s: float
    offset_s: float
    late_s: float


def follow_views(
    calibration: Calibration, frames: Mapping[str, Sequence[CameraFrame]], until_s: float | None
) -> Calibration:
    """Return the calibration with the clocks of cameras without depth corrected by the whole take.

    A clock that seems to have jumped is reported among its camera's reasons.

    Args:
        calibration: of these frames.
        frames: by camera, in device time order.
        until_s: the calibration was found from frames up to this time of the stage clock [s]; None = from all.
    """
    reference = calibration.reference
    names = [
        name
        for name, camera in calibration.cameras.items()
        if camera.verdict != "refused" and camera.lens is not None and sees_no_depth(frames.get(name, ()))
    ]
    if reference not in names or len(names) < 2:
        return calibration
    names = [reference, *(name for name in names if name != reference)]
    clock = calibration.cameras[reference].clock
    first_s, last_s = (clock.stage_ns(frames[reference][i].device_time_ns) * 1e-9 for i in (0, -1))
    if last_s - first_s < LEAST_S:
        return calibration
    right_s = 0.5 * (first_s + min(last_s, np.inf if until_s is None else until_s))
    known: dict[str, list[_Window]] = {name: [] for name in names[1:]}
    for start_s in window_starts(first_s, last_s):
        _add_window(calibration, frames, names, float(start_s), known)
    cameras = {
        name: _followed(calibration.cameras[name], windows, first_s, right_s)
        for name, windows in known.items()
    }
    return replace(calibration, cameras=calibration.cameras | cameras)


def _followed(
    camera: CameraCalibration, windows: list[_Window], first_s: float, right_s: float
) -> CameraCalibration:
    """Return a camera with its drift, or with the reason why it has none.

    Args:
        first_s: the take's beginning on the stage clock [s].
        right_s: stage time at which its clock is already correct [s].
    """
    if len(windows) < _LEAST_WINDOWS:
        return camera
    jump = _jump(windows)
    if jump is not None:
        at_s, by_s = jump
        stage_s = camera.clock.stage_ns(round(at_s * 1e9) + camera.clock.reference_ns) * 1e-9
        reason = _jumped(by_s, stage_s - first_s)
        return replace(camera, verdict="usable", reasons=(*camera.reasons, reason))
    drift, sd = _line(windows)
    if not np.isfinite(sd):
        return camera
    usual = USUAL_PPM * 1e-6
    return replace(camera, clock=through(camera.clock, right_s, drift * usual**2 / (usual**2 + sd**2)))


def _jumped(by_s: float, at_s: float) -> Said:
    return say(
        "views.clock_jumped",
        "its clock jumped by {ms:.0f} ms at about {s:.0f} s of the take: use the part before or after it alone",
        ms=-1e3 * by_s,
        s=at_s,
    )


def _line(windows: list[_Window]) -> tuple[float, float]:
    """Return the drift from all windows and its standard deviation."""
    from scipy.stats import theilslopes  # takes most of a second to load

    at, off = np.array([(w.device_s, w.offset_s) for w in windows]).T
    drift = float(theilslopes(off, at)[0])
    rest = off - drift * at
    spread = 1.4826 * float(np.median(np.abs(rest - np.median(rest)))) + 1e-4
    return drift, spread / max(float(np.sqrt(((at - at.mean()) ** 2).sum())), 1e-9)


def _jump(windows: list[_Window]) -> tuple[float, float] | None:
    """Return the time of a clock's jump (on that clock, since its reference) and its size [s]; None = no jump."""
    at, late = np.array([(w.device_s, w.late_s) for w in windows]).T
    best = None
    for k in range(2, len(at) - 1):
        before, after = late[:k], late[k:]
        by = float(np.median(after) - np.median(before))
        rest = np.concatenate([before - np.median(before), after - np.median(after)])
        spread = float(np.median(np.abs(rest)))
        if best is None or spread < best[0]:
            best = spread, 0.5 * float(at[k - 1] + at[k]), by
    if best is None or abs(best[2]) < max(JUMP_S, 6.0 * best[0]):
        return None
    drift, _ = _line(windows)
    along = np.array([w.offset_s for w in windows]) - drift * at
    smooth = float(np.median(np.abs(along - np.median(along))))
    return best[1:] if best[0] < 0.5 * smooth else None


def _add_window(
    calibration: Calibration,
    frames: Mapping[str, Sequence[CameraFrame]],
    names: list[str],
    start_s: float,
    known: dict[str, list[_Window]],
) -> None:
    """Add the result for each camera's clock from the window that begins at a stage time [s]."""
    found = {name: _track(name, frames[name], calibration.cameras[name], start_s) for name in names}
    tracks = {name: track for name, track in found.items() if track is not None}
    if names[0] not in tracks or len(tracks) < 2:
        return
    cameras = [calibration.cameras[name] for name in tracks]
    rig = rig_of(cameras, [track.focal for track in tracks.values()])
    late, sure = _late_s(rig, [*tracks.values()])
    middle_s = start_s + 0.5 * WINDOW_S
    for name, late_s, sd_s in zip(tracks, late.tolist(), sure.tolist(), strict=True):
        if name in known and sd_s <= _SURE_S:
            clock = calibration.cameras[name].clock
            at_s = float(device_s(clock, middle_s - late_s, clock.reference_ns))
            known[name].append(_Window(at_s, middle_s - at_s, late_s))


def _track(
    name: str, frames: Sequence[CameraFrame], camera: CameraCalibration, start_s: float
) -> ViewTrack | None:
    """Return a camera's landmarks in a window, on the stage clock since its beginning [s]; None = too few."""
    clock = camera.clock
    ends = (
        bisect_left(frames, round(at_s * 1e9), key=lambda frame: clock.stage_ns(frame.device_time_ns))
        for at_s in (start_s - LONGEST_S, start_s + WINDOW_S + LONGEST_S)
    )
    mine = frames[slice(*ends)]
    if not mine:
        return None
    start_ns = mine[0].device_time_ns
    view = view_of(name, mine, start_ns, np.inf)
    lens = None if camera.lens is None else camera.lens.sized(view.width, view.height)
    if lens is None or len(view.time_s) < _LEAST_FRAMES:
        return None
    time_s = clock.stage_ns(start_ns) * 1e-9 - start_s + view.time_s * (1.0 + clock.drift_ppm * 1e-6)
    return make_track(replace(view, time_s=time_s, lens=lens))


def _late_s(rig: CameraRig, tracks: list[ViewTrack]) -> tuple[Array, Array]:
    """Return the time to add to each camera's clock [s], 0 for the first, and its standard deviation [s]; infinite =
    unknown."""
    times_s = np.arange(_EDGE_S, WINDOW_S - _EDGE_S, _STEP_S)
    for _ in range(_ROUNDS):
        _, samples, joints = brought_together(rig, tracks, times_s)
        step, sd = _step(rig, samples, joints)
        moved = np.clip(np.where(np.isfinite(sd), step, 0.0), -_MOST_STEP_S, _MOST_STEP_S)
        rig = replace(rig, ahead_s=np.clip(rig.ahead_s + moved, -LONGEST_S, LONGEST_S))
        if np.abs(moved).max() < _SETTLED_S:
            return rig.ahead_s, sd
    return rig.ahead_s, np.full(len(tracks), np.inf)


def _step(rig: CameraRig, samples: list[Sample], joints: Array) -> tuple[Array, Array]:
    """Return the step of each camera's delay [s], 0 for the first, and its standard deviation."""
    count = len(samples)
    known = np.isfinite(joints[..., 0])
    places = np.where(known[..., None], joints, 0.0)
    own, right = np.zeros((*known.shape, 3, 3)), np.zeros((*known.shape, 3))
    cross = np.zeros((count, *known.shape, 3))
    shared, pull, rows = np.zeros((count, count)), np.zeros(count), np.zeros(count)
    for c, seen in enumerate(samples):
        shown, by_point, _ = rig.changes(c, places, seen.speed)
        weight = np.where(known, seen.weight, 0.0)
        rest = _about_mean(shown - seen.points, weight)
        speed = _about_mean(seen.speed, weight)
        weight = weight / (1.0 + (rest**2).sum(axis=-1) * weight / _CAUCHY**2)
        weighed = by_point * weight[..., None, None]
        own += np.swapaxes(weighed, -1, -2) @ by_point
        right -= (weighed * rest[..., None]).sum(axis=-2)
        cross[c] = (weighed * speed[..., None]).sum(axis=-2)
        shared[c, c] = (weight * (speed**2).sum(axis=-1)).sum()
        pull[c] = -(weight * (speed * rest).sum(axis=-1)).sum()
        rows[c] = (weight > 0).sum()
    trace = np.trace(own, axis1=-2, axis2=-1)[..., None, None]
    solved = np.linalg.solve(
        own + (1e-6 * trace + 1e-9) * np.eye(3),
        np.concatenate([np.moveaxis(cross, 0, -1), right[..., None]], -1),
    )
    shared -= np.einsum("cfja,fjad->cd", cross, solved[..., :count])
    pull -= np.einsum("cfja,fja->c", cross, solved[..., count])
    free = np.flatnonzero((rows >= _LEAST_ROWS) & (np.arange(count) > 0))
    step, sd = np.zeros(count), np.full(count, np.inf)
    if len(free) and rows[0] >= _LEAST_ROWS:
        covariance = np.linalg.pinv(shared[np.ix_(free, free)], hermitian=True)
        step[free] = covariance @ pull[free]
        sd[free] = np.sqrt(np.maximum(_REPEATED * np.diag(covariance), 0.0))
    return step, sd


def _about_mean(values: Array, weight: Array) -> NDArray[np.float64]:
    """Return values, shape (instant_count, 17, 2), minus each joint's weighted mean; constant errors are no delay."""
    w = weight[..., None]
    return values - (values * w).sum(axis=0) / np.maximum(w.sum(axis=0), 1e-12)
