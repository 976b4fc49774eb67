"""Places ordinary cameras that see the same performer: adjustment, stage, figures and verdicts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from studio.engine.calibration.views.adjusting.adjust import Adjustment, FittedRig, Freedom
from studio.engine.calibration.views.adjusting.rig import CameraRig
from studio.engine.calibration.views.adjusting.sides import brought_together
from studio.engine.calibration.views.judging.early import knees_seen
from studio.engine.calibration.views.judging.figures import (
    motion_of,
    parallax_deg,
    rests_of,
    twins,
    uncertain_of,
)
from studio.engine.calibration.views.judging.result import PlacedView, ViewsResult
from studio.engine.calibration.views.judging.verdict import ViewFacts, verdict
from studio.engine.calibration.views.seen.bodies import BONE_NAMES, USUAL_HEIGHT_M, Array, limbs_m
from studio.engine.calibration.views.seen.tracks import ViewTrack, apart_within_s
from studio.engine.calibration.views.seen.view import NUMBER, View
from studio.engine.calibration.views.stage import camera_on_stage, to_stage
from studio.engine.calibration.views.starting.first import ViewPair, adjust_places, common_instants
from studio.engine.model.cameras.lens import Lens, usual_lens

MOST_INSTANTS = 240
"""Maximum number of instants in an adjustment; a longer walk is sampled evenly."""
_STAGES = ((False, 2.0, 1e-3), (True, 1.0, 1e-4), *((True, 1.0, 3e-5),) * 6)
"""Settings of the adjustments: whether distortion and principal points are unknowns, factor of the errors, and least
relative reduction of the cost in a step. The last ones stop once the clocks have settled."""
_LEAST_STAGES, _SETTLED_S = 3, 0.001
_STEPS = 25
_PLACE_STEPS = 15


def place(
    views: Sequence[View],
    tracks: list[ViewTrack],
    pairs: Mapping[tuple[int, int], ViewPair],
    rig: CameraRig,
    height_m: float | None,
    shared_focal: bool,
    told: Callable[[float], None],
) -> ViewsResult:
    """Return the cameras on the stage.

    Args:
        views: at least two; tracks: of the views; pairs: by two of their indices.
        rig: their first places.
        height_m, shared_focal: as for `calibrate_views`.
        told: called with the share that is done, 0..1.
    """
    times = common_instants(tracks, rig.ahead_s, MOST_INSTANTS)
    fit, adjustment, swapped = _adjust(rig, tracks, times, shared_focal, told)
    T, size, joints, performer = to_stage(times, fit.joints, height_m)
    facts = _facts(views, tracks, pairs, fit, adjustment, T, size)
    cameras = {}
    for c, view in enumerate(views):
        word, reasons = verdict(facts[c])
        cameras[view.name] = PlacedView(
            camera_on_stage(T, size, fit.rig.turns[c], fit.rig.shifts[c]),
            _lens(view, fit.rig, c),
            float(fit.rig.ahead_s[c] - fit.rig.ahead_s[0]),
            facts[c].rests,
            facts[c].uncertain,
            float(swapped[c].any(axis=1).mean()),
            float((adjustment.weight[c] > 0).any(axis=1).mean()),
            word,
            reasons,
        )
    bones = dict(zip(BONE_NAMES, (fit.bones * size).tolist(), strict=True))
    return ViewsResult(cameras, times, joints, bones, performer, height_m is not None)


def _adjust(
    rig: CameraRig, tracks: list[ViewTrack], times: Array, shared_focal: bool, told: Callable[[float], None]
) -> tuple[FittedRig, Adjustment, list[np.ndarray]]:
    """Return the adjusted cameras and joints, the last adjustment and the exchanges in each frame."""
    usual, limbs = rig, limbs_m(USUAL_HEIGHT_M)
    fit = adjust_places(rig, tracks, times, USUAL_HEIGHT_M, _PLACE_STEPS)
    free = [not track.known for track in tracks]
    focals, shares = _sought(tracks, shared_focal), tuple(track.focal_share for track in tracks)
    adjustment, swapped, before_s = None, [], rig.ahead_s
    within_s = np.array([apart_within_s(tracks[0], track) for track in tracks])
    for k, (lenses, loose, small) in enumerate(_STAGES):
        rig = fit.rig
        if k >= _LEAST_STAGES and np.abs(rig.ahead_s - before_s).max() < _SETTLED_S:
            break
        told((k + 1) / (len(_STAGES) + 1))
        before_s = rig.ahead_s
        swapped, samples, joints = brought_together(rig, tracks, times)
        freedom = Freedom(focals, shares, tuple(lenses and one for one in free), True)
        near = replace(usual, ahead_s=rig.ahead_s)
        adjustment = Adjustment(samples, times, near, freedom, limbs, loose)
        fit = adjustment.run(FittedRig(rig, joints, fit.bones), _STEPS, small)
        ahead_s = np.clip(fit.rig.ahead_s, -within_s, within_s)
        fit = replace(fit, rig=replace(fit.rig, ahead_s=ahead_s))
    assert adjustment is not None
    return fit, adjustment, swapped


def _sought(tracks: list[ViewTrack], shared_focal: bool) -> tuple[int, ...]:
    """Return by camera the index of its unknown focal length, -1 = known exactly."""
    numbers, shared, used = [], -1, 0
    for track in tracks:
        if track.known and not track.focal_share:
            numbers.append(-1)
        elif shared_focal and not track.known and shared >= 0:
            numbers.append(shared)
        else:
            shared = shared if track.known else used
            numbers.append(used)
            used += 1
    return tuple(numbers)


def _facts(
    views: Sequence[View],
    tracks: list[ViewTrack],
    pairs: Mapping[tuple[int, int], ViewPair],
    fit: FittedRig,
    adjustment: Adjustment,
    T: Array,
    size: float,
) -> list[ViewFacts]:
    """Return the input of each camera's verdict."""
    motion = motion_of(fit.joints * size, T[2, :3])
    centres = fit.rig.optical_centres
    hips = (fit.joints[:, NUMBER["left_hip"]] + fit.joints[:, NUMBER["right_hip"]]) / 2
    angles = parallax_deg(centres, hips)
    same = twins(fit.rig)
    rests, uncertain = adjustment.rests(fit), uncertain_of(fit)
    depths = fit.rig.seen_from(fit.joints)[..., 2] * size
    return [
        ViewFacts(
            rests_of(rests[c], adjustment.weight[c], depths[c], float(fit.rig.focals[c])),
            replace(uncertain[c], place_m=uncertain[c].place_m * size),
            view.lens is None or view.focal_share > 0,
            knees_seen(view, tracks[c]),
            max(pair.together.correlation for key, pair in pairs.items() if c in key),
            float(angles[c].max()),
            motion,
            len(views),
            None if (twin := same[c]) is None else views[twin].name,
        )
        for c, view in enumerate(views)
    ]


def _lens(view: View, rig: CameraRig, c: int) -> Lens:
    if view.lens is not None:
        by = float(rig.focals[c]) * 2 / (view.lens.fx + view.lens.fy)
        return (
            replace(view.lens, fx=view.lens.fx * by, fy=view.lens.fy * by) if view.focal_share else view.lens
        )
    usual = usual_lens(view.width, view.height)
    focal, (x, y) = float(rig.focals[c]), rig.centres[c].tolist()
    return replace(
        usual,
        fx=focal,
        fy=focal,
        cx=usual.cx + x,
        cy=usual.cy + y,
        distortion=(float(rig.bends[c]), 0.0, 0.0, 0.0),
    )
