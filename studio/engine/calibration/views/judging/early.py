"""Refusals, before any adjustment, of cameras whose pictures do not suffice to place them."""

from collections.abc import Sequence

import numpy as np

from studio.engine.base.sentences import Said, say
from studio.engine.calibration.views.adjusting.sides import at_instants
from studio.engine.calibration.views.judging.verdict import (
    LEAST_ALIKE,
    LEAST_KNEES,
    LEAST_LIMBS_M,
    LEAST_TRAVEL_M,
    knees_unseen,
    motion_differs,
    same_picture,
    still,
)
from studio.engine.calibration.views.seen.bodies import Array
from studio.engine.calibration.views.seen.tracks import ViewTrack
from studio.engine.calibration.views.seen.view import NUMBER, View
from studio.engine.calibration.views.starting.first import ViewPair
from studio.engine.model.cameras.joint_noise import LANDMARK_M
from studio.engine.model.joints import INDEX

LEAST_FRAMES = 45
"""Minimum number of a camera's pictures with a body: a second and a half."""
_LEAST_JOINTS = 8
_SURE = 0.5
_STEADY = 8
_SAME = 0.15
"""Largest median distance of the landmarks of two streams of one camera, in usual errors."""


def refused_early(
    views: Sequence[View], tracks: Sequence[ViewTrack], pairs: dict[tuple[int, int], ViewPair]
) -> list[list[Said]]:
    """Return, by camera, why it cannot be placed; empty if it can."""
    out: list[list[Said]] = [[] for _ in views]
    for c, (view, track) in enumerate(zip(views, tracks, strict=True)):
        frames = int((track.seen.sum(axis=1) >= _LEAST_JOINTS).sum())
        if frames < LEAST_FRAMES:
            out[c].append(
                say(
                    "views.few_frames",
                    "a whole body is in {frames} of its pictures only, {least} are needed: walk for longer, in "
                    "view of the camera",
                    frames=frames,
                    least=LEAST_FRAMES,
                )
            )
        elif (knees := knees_seen(view, track)) < LEAST_KNEES:
            out[c].append(knees_unseen(knees))
        elif hardly_moves(track):
            out[c].append(still())
    for c in range(len(views)):
        mine = [pair for key, pair in pairs.items() if c in key]
        if mine and not out[c] and max(pair.together.correlation for pair in mine) < LEAST_ALIKE:
            out[c].append(motion_differs())
    for (i, j), pair in pairs.items():
        if _same(tracks[i], tracks[j], pair):
            out[j].append(same_picture(views[i].name))
    return out


def knees_seen(view: View, track: ViewTrack) -> float:
    """Return the share of the frames with a body in which a knee is surely seen; the mean of both knees."""
    body = track.seen.sum(axis=1) >= _LEAST_JOINTS
    if not body.any():
        return 0.0
    sides = ("left_knee", "right_knee")
    seen = track.seen[:, [NUMBER[s] for s in sides]] & (view.confidence[:, [INDEX[s] for s in sides]] > _SURE)
    return float(seen[body].mean())


def hardly_moves(track: ViewTrack) -> bool:
    """Whether the limbs of the guessed body and its place in the picture hardly change, apart from jitter."""
    limbs = [
        track.world_m[:, NUMBER[f"{side}_{name}"]]
        for side in ("left", "right")
        for name in ("wrist", "ankle")
    ]
    seen = [
        track.seen[:, NUMBER[f"{side}_{name}"]] for side in ("left", "right") for name in ("wrist", "ankle")
    ]
    moved = max(_spread(limb[sure]) for limb, sure in zip(limbs, seen, strict=True))
    body = track.seen.sum(axis=1) >= _LEAST_JOINTS
    middle = np.array(
        [np.median(p[s], axis=0) for p, s in zip(track.points[body], track.seen[body], strict=True)]
    )
    metre = float(np.median(track.sigma[body])) / LANDMARK_M
    return moved < LEAST_LIMBS_M and _spread(middle / metre) < LEAST_TRAVEL_M / 3


def _spread(points: Array) -> float:
    """Return the mean distance of running means over `_STEADY` frames from their common middle."""
    if len(points) < _STEADY:
        return 0.0
    total = np.cumsum(np.concatenate([np.zeros((1, points.shape[1])), points]), axis=0)
    means = (total[_STEADY:] - total[:-_STEADY]) / _STEADY
    return float(np.linalg.norm(means - np.median(means, axis=0), axis=1).mean())


def _same(a: ViewTrack, b: ViewTrack, pair: ViewPair) -> bool:
    """Whether two streams show the same landmarks, even in pictures of different sizes."""
    if pair.together.frames == 0:
        return False
    grid = a.time_s[:: max(len(a.time_s) // 100, 1)]
    points, weight = at_instants([0.0, pair.together.ahead_s], [a, b], grid)
    both = (weight > 0).all(axis=0)
    if not both.any():
        return False
    size = float(np.median(points[0][both].std(axis=0) / np.maximum(points[1][both].std(axis=0), 1e-9)))
    apart = np.linalg.norm(points[0] - size * points[1], axis=-1)[both]
    return float(np.median(apart * np.sqrt(weight[0][both]))) < _SAME
