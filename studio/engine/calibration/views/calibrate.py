"""Calibrates ordinary cameras from one performer's landmarks while he walks: no board, no depth.

The steps: `tracks` (rays and errors) -> `clocks` (first offsets) -> `start` and `first` (first places by the guessed
bodies) -> `sides` (left and right) and `adjust` (all at once), three times -> `stage` (vertical, floor, size) ->
`figures` and `verdict`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from studio.engine.base.errors import CalibrationError
from studio.engine.base.sentences import Said, say
from studio.engine.calibration.views.adjust import Adjustment, Fit, Freedom
from studio.engine.calibration.views.bodies import BONE_NAMES, USUAL_HEIGHT_M, Array, limbs_m
from studio.engine.calibration.views.early import knees_seen, refused_early
from studio.engine.calibration.views.figures import motion_of, parallax_deg, rests_of, uncertain_of
from studio.engine.calibration.views.first import Pair, adjust_places, chain, common_instants, first_pairs
from studio.engine.calibration.views.result import PlacedView, ViewsResult
from studio.engine.calibration.views.rig import Rig
from studio.engine.calibration.views.sides import find_swaps
from studio.engine.calibration.views.stage import camera_on_stage, to_stage
from studio.engine.calibration.views.start import bodies
from studio.engine.calibration.views.tracks import Track, first_focal, make_track, sample
from studio.engine.calibration.views.triangulate import triangulate
from studio.engine.calibration.views.verdict import Facts, verdict
from studio.engine.calibration.views.view import NUMBER, View
from studio.engine.model.lens import Lens

MOST_INSTANTS = 300
"""Instants that are adjusted; a longer walk is taken at evenly spread ones."""
_STAGES = ((False, 2.0, 20), (True, 1.0, 20), (True, 1.0, 20))
"""Of the rounds: whether distortion and principal points are sought, factor of the errors, steps at most."""
_PLACE_STEPS = 15


def _untold(share: float) -> None:
    pass


def calibrate_views(
    views: Sequence[View],
    *,
    height_m: float | None = None,
    shared_focal: bool = False,
    progress: Callable[[float], None] | None = None,
) -> ViewsResult:
    """Return the cameras on the stage; bad ones have the verdict `refused` and reasons.

    The stage clock is the first camera's. The stage's origin is the floor under the hips in the T-pose, else under
    the middle of the walk.

    Args:
        views: at least one, with different names.
        height_m: the performer's, which gives the size; None = 1.75 m, and `scale_known` is False.
        shared_focal: all cameras whose lens is not known have the same focal length.
        progress: called with the share that is done, 0..1.

    Raises:
        CalibrationError: no view, or two of one name.
    """
    told = progress or _untold
    names = [view.name for view in views]
    if not names or len({*names}) < len(names):
        raise CalibrationError(
            "views.names", "calibration needs cameras of different names; got {names}", names=names or ["none"]
        )
    tracks = [make_track(view) for view in views]
    pairs = first_pairs(tracks, USUAL_HEIGHT_M, lambda share: told(0.4 * share))
    early = refused_early(views, tracks, pairs)
    if any(early) or len(views) == 1:
        return _unplaced(views, tracks, early, height_m)
    rig = chain(pairs, tracks)
    if rig is None:
        return _unplaced(views, tracks, [[_apart()] for _ in views], height_m)
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
            word,
            reasons,
        )
    told(1.0)
    bones = dict(zip(BONE_NAMES, (fit.bones * size).tolist(), strict=True))
    return ViewsResult(cameras, times, joints, bones, performer, height_m is not None)


def _facts(
    views: Sequence[View],
    tracks: list[Track],
    pairs: dict[tuple[int, int], Pair],
    fit: Fit,
    adjustment: Adjustment,
    T: Array,
    size: float,
) -> list[Facts]:
    """Return what the verdict on each camera is made of."""
    motion = motion_of(fit.joints * size, T[2, :3])
    centres = -np.einsum("cba,cb->ca", fit.rig.turns, fit.rig.shifts)
    hips = (fit.joints[:, NUMBER["left_hip"]] + fit.joints[:, NUMBER["right_hip"]]) / 2
    angles = parallax_deg(centres, hips)
    rests, uncertain = adjustment.rests(fit), uncertain_of(fit)
    return [
        Facts(
            rests_of(rests[c], adjustment.weight[c], float(fit.rig.focals[c])),
            replace(uncertain[c], place_m=uncertain[c].place_m * size),
            view.lens is None,
            knees_seen(view, tracks[c]),
            max(pair.together.correlation for key, pair in pairs.items() if c in key),
            float(angles[c].max()),
            motion,
            len(views),
        )
        for c, view in enumerate(views)
    ]


def _unplaced(
    views: Sequence[View], tracks: list[Track], refused: list[list[Said]], height_m: float | None
) -> ViewsResult:
    """Return cameras that cannot be placed by each other: one alone is placed by the guessed bodies."""
    alone = len(views) == 1 and not refused[0]
    joints = bodies(tracks[0])
    T, size, joints, performer = to_stage(tracks[0].time_s, joints, height_m)
    if alone:
        refused = [
            [
                say(
                    "views.alone",
                    "one camera alone sees no depth: the performer is placed by a guess, 10 to 20 cm off; add a second "
                    "camera",
                )
            ]
        ]
    cameras = {
        view.name: PlacedView(
            T,
            view.lens or _usual_lens(view),
            verdict="usable" if alone else "refused" if reasons else "usable",
            reasons=tuple(reasons),
        )
        for view, reasons in zip(views, refused, strict=True)
    }
    return ViewsResult(cameras, tracks[0].time_s, joints, {}, performer, height_m is not None)


def _apart() -> Said:
    return say(
        "views.nothing_together",
        "no other camera saw the performer at the same time: walk where two cameras see you",
    )


def _adjust(
    rig: Rig, tracks: list[Track], times: Array, shared_focal: bool, told: Callable[[float], None]
) -> tuple[Fit, Adjustment, list[np.ndarray]]:
    """Return the adjusted cameras and joints, the last adjustment and what was exchanged in each frame."""
    usual, limbs = rig, limbs_m(USUAL_HEIGHT_M)
    fit = adjust_places(rig, tracks, times, USUAL_HEIGHT_M, _PLACE_STEPS)
    free = [not track.known for track in tracks]
    numbers = np.where(free, 0 if shared_focal else np.cumsum(free) - 1, -1)
    adjustment, swapped = None, []
    for k, (lenses, loose, steps) in enumerate(_STAGES):
        told(0.5 + 0.15 * k)
        rig = fit.rig
        swapped = find_swaps(rig, tracks, times)
        exchanged = [track.exchanged(swap) for track, swap in zip(tracks, swapped, strict=True)]
        samples = [sample(track, times - ahead) for track, ahead in zip(exchanged, rig.ahead_s, strict=True)]
        joints = triangulate(rig, np.stack([s.points for s in samples]), np.stack([s.weight for s in samples]))
        freedom = Freedom(tuple(numbers.tolist()), tuple(lenses and one for one in free), True)
        near = replace(usual, ahead_s=rig.ahead_s)
        adjustment = Adjustment(samples, times, near, freedom, limbs, loose)
        fit = adjustment.run(Fit(rig, joints, fit.bones), steps)
    assert adjustment is not None
    return fit, adjustment, swapped


def _lens(view: View, rig: Rig, c: int) -> Lens:
    if view.lens is not None:
        return view.lens
    usual = _usual_lens(view)
    focal, (x, y) = float(rig.focals[c]), rig.centres[c].tolist()
    return replace(
        usual,
        fx=focal,
        fy=focal,
        cx=usual.cx + x,
        cy=usual.cy + y,
        distortion=(float(rig.bends[c]), 0.0, 0.0, 0.0),
    )


def _usual_lens(view: View) -> Lens:
    focal = first_focal(view)
    return Lens(focal, focal, (view.width - 1) / 2, (view.height - 1) / 2, view.width, view.height)
