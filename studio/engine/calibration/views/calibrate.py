"""Calibrates ordinary cameras from one performer's landmarks while he walks: no board, no depth.

The steps: `tracks` (rays and their errors) -> `clocks` (first offsets) -> `start` and `first` (first places by the
guessed bodies) -> `early` (cameras that cannot be placed) -> `place`: `sides` (left and right) and `adjust` (all at
once), three times, then `stage` (vertical, floor, size), `figures` and `verdict`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from studio.engine.base.errors import CalibrationError
from studio.engine.base.sentences import Said, say
from studio.engine.calibration.quality.verdict import check_height
from studio.engine.calibration.views.judging.early import refused_early
from studio.engine.calibration.views.judging.result import NOWHERE, PlacedView, ViewsResult
from studio.engine.calibration.views.place import place
from studio.engine.calibration.views.seen.bodies import USUAL_HEIGHT_M
from studio.engine.calibration.views.seen.tracks import ViewTrack, make_track
from studio.engine.calibration.views.seen.view import View
from studio.engine.calibration.views.stage import to_stage
from studio.engine.calibration.views.starting.first import chain, first_pairs
from studio.engine.calibration.views.starting.start import bodies
from studio.engine.model.cameras.lens import usual_lens

_FIRST_SHARE = 0.4


def calibrate_views(
    views: Sequence[View],
    *,
    height_m: float | None = None,
    shared_focal: bool = False,
    progress: Callable[[float], None] | None = None,
) -> ViewsResult:
    """Return the cameras on the stage; bad ones have the verdict `refused` and reasons.

    Cameras whose pictures do not suffice are refused at once, and the others are placed without them. The stage clock
    is that of the first remaining camera. The stage's origin is the floor under the hips in the T-pose, else under
    the middle of the walk.

    Args:
        views: at least one, with different names.
        height_m: the performer's, which gives the size; None = 1.75 m, and `scale_known` is False.
        shared_focal: all cameras whose lens is unknown have the same focal length.
        progress: called with the share that is done, 0..1.

    Raises:
        CalibrationError: no view, or two of one name.
        SettingsError: a height that no performer has.
    """
    told = progress or _untold
    names = [view.name for view in views]
    if not names or len({*names}) < len(names):
        raise CalibrationError(
            "views.names",
            "calibration needs cameras of different names; got {names}",
            names=names or ["none"],
        )
    check_height(height_m)
    tracks = [make_track(view) for view in views]
    pairs = first_pairs(tracks, USUAL_HEIGHT_M, lambda share: told(_FIRST_SHARE * share))
    refused = refused_early(views, tracks, pairs)
    kept = [c for c, reasons in enumerate(refused) if not reasons]
    result = None
    if len(kept) == 1:
        result = _alone(views[kept[0]], tracks[kept[0]], height_m)
    elif kept:
        known = {(a, b): pairs[kept[a], kept[b]] for b in range(len(kept)) for a in range(b)}
        mine = [tracks[c] for c in kept]
        rig = chain(known, mine)
        if rig is None:
            for c in kept:
                refused[c].append(_nothing_together())
        else:
            result = place(
                [views[c] for c in kept], mine, known, rig, height_m, shared_focal,
                lambda share: told(_FIRST_SHARE + (1.0 - _FIRST_SHARE) * share),
            )  # fmt: skip
    told(1.0)
    return _with_refused(views, refused, result, height_m)


def _untold(share: float) -> None:
    pass


def _alone(view: View, track: ViewTrack, height_m: float | None) -> ViewsResult:
    """Return the only camera, placed by the network's guesses of the body."""
    T, _, joints, performer = to_stage(track.time_s, bodies(track), height_m)
    reason = say(
        "views.alone",
        "one camera alone sees no depth: the performer is placed by a guess, 20 to 40 cm off; add a second camera",
    )
    camera = PlacedView(
        T, view.lens or usual_lens(view.width, view.height), verdict="usable", reasons=(reason,)
    )
    return ViewsResult({view.name: camera}, track.time_s, joints, {}, performer, height_m is not None)


def _nothing_together() -> Said:
    return say(
        "views.nothing_together",
        "no other camera saw the performer at the same time: walk where two cameras see you",
    )


def _with_refused(
    views: Sequence[View], refused: list[list[Said]], placed: ViewsResult | None, height_m: float | None
) -> ViewsResult:
    """Return all cameras in the given order, both those placed and those refused at once."""
    if placed is None:
        placed = ViewsResult({}, np.zeros(0), np.zeros((0, 21, 3)), {}, None, height_m is not None)
    cameras = {}
    for view, reasons in zip(views, refused, strict=True):
        lens = view.lens or usual_lens(view.width, view.height)
        cameras[view.name] = placed.cameras.get(view.name) or PlacedView(
            NOWHERE, lens, verdict="refused", reasons=tuple(reasons)
        )
    return replace(placed, cameras=cameras)
