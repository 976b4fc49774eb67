"""Props: rigid bodies as objects with a skeleton of their own, tied to the hand that holds them.

A prop is held while a hand is near its surface. Its system measures its rotation better than the solve measures the
hand, so the rotation stays. Its place follows the hand: the grip, from the prop's origin to the hand in the prop's
axes, is constant while it is held. A hand that slides along (`SLIDES_M`) has a grip smoothed over a second instead.
Where a held prop is not seen for up to `UNSEEN_S`, it turns with the hand.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from studio.engine.base.quaternions import continuous_signs, inverse, multiply, normalized, rotate
from studio.engine.model.joints import OUTPUT_OF_CANONICAL
from studio.engine.model.poses import Poses
from studio.engine.model.rigid_body import RigidShape
from studio.engine.rigid_bodies.tracks import BodyTrack

HANDS = ("left_hand", "right_hand")
NEAR_M, FAR_M = 0.10, 0.16
"""Distance from the surface at which a hand takes a prop, and at which it releases it."""

LEAST_S, EASE_S, GRIP_S = 0.3, 0.15, 1.0
SLIDES_M = 0.06
"""A hand slides along the prop if its grip changes by more than this."""

UNSEEN_S = 1.0
_LEAST_LENGTH_M = 0.05


def prop_poses(
    name: str,
    track: BodyTrack,
    shape: RigidShape | None,
    performers: Sequence[Poses],
    hands: Sequence[str] = HANDS,
) -> Poses:
    """Return a prop as a skeleton of two joints, its origin and the end of its longest axis, at a solve's instants.

    Where it was not seen, it is interpolated, with confidence 0.

    Args:
        name: of the prop; its joints have this name, and this name with `_end`.
        track: its motion on the stage.
        shape: None = unknown.
        performers: poses of those who may hold it; the first one's instants are those of the prop.
        hands: canonical joints that may hold it.
    """
    time_s = performers[0].time_s
    positions, rotations = track.filled_at(time_s)
    seen = np.asarray(np.isfinite(track.at(time_s)[0]).all(axis=1))
    for poses in performers:
        for hand in hands:
            holder = _hand_at(poses, hand, time_s)
            if holder is not None:
                positions, rotations = held_by(time_s, holder, positions, rotations, shape, seen)
    edges = np.zeros(3) if shape is None else shape.edges_m
    along = np.zeros(3)
    along[int(edges.argmax()) if shape is not None else 2] = max(edges.max() / 2, _LEAST_LENGTH_M)
    ends = positions + rotate(rotations, np.broadcast_to(along, positions.shape))
    frames = len(time_s)
    return Poses(
        time_s=time_s,
        joint_names=(name, f"{name}_end"),
        parents=np.array([-1, 0]),
        positions_m=np.stack([positions, ends], axis=1),
        rotations_wxyz=np.stack([rotations, rotations], axis=1),
        confidence=np.repeat(seen[:, None].astype(np.float64), 2, axis=1),
        uncertainty_mm=np.full((frames, 2), np.nan),
        root_height_m=float(positions[0, 2]),
    )


def _hand_at(
    poses: Poses, hand: str, time_s: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return a hand's places and its rotations, those of its wrist, at other times; None where there is none."""
    place, turn = (OUTPUT_OF_CANONICAL[hand.replace("hand", end)] for end in ("hand", "wrist"))
    if place not in poses.joint_names or turn not in poses.joint_names:
        return None
    rotations = continuous_signs(poses.rotations_wxyz[:, poses.joint_names.index(turn)])
    return BodyTrack(poses.time_s, poses.positions_m[:, poses.joint_names.index(place)], rotations).filled_at(
        time_s
    )


def held_by(
    time_s: NDArray[np.float64],
    hand: tuple[NDArray[np.float64], NDArray[np.float64]],
    positions_m: NDArray[np.float64],
    rotations_wxyz: NDArray[np.float64],
    shape: RigidShape | None,
    seen: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the places, shape (n, 3), and rotations, shape (n, 4), of a prop, tied to a hand while it holds it.

    Args:
        time_s: of the frames [s], shape (n,).
        hand: on the stage: places [m], shape (n, 3), and rotations wxyz, shape (n, 4).
        positions_m, rotations_wxyz: the prop on the stage, shapes (n, 3), (n, 4).
        shape: None = a point.
        seen: whether the prop was seen, shape (n,).
    """
    hand_m, hand_wxyz = hand
    grip = rotate(inverse(rotations_wxyz), hand_m - positions_m)
    half = np.zeros(3) if shape is None else shape.edges_m / 2
    away = np.linalg.norm(np.maximum(np.abs(grip) - half, 0.0), axis=1)
    places, turns = positions_m.copy(), rotations_wxyz.copy()
    dt = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 1.0 / 60
    for first, last in held_spans(away, seen, max(1, round(LEAST_S / dt)), max(1, round(UNSEEN_S / dt))):
        rows = slice(first, last)
        turns[rows] = _with_hand(hand_wxyz[rows], turns[rows], seen[rows])
        held = _held_grip(grip[rows], seen[rows], max(1, round(GRIP_S / dt)))
        tied = hand_m[rows] - rotate(turns[rows], held)
        to_edge = np.minimum(time_s[rows] - time_s[first], time_s[last - 1] - time_s[rows])
        share = np.clip(to_edge / EASE_S, 0.0, 1.0)[:, None]
        places[rows] += share * (tied - places[rows])
    return places, turns


def _held_grip(grip: NDArray[np.float64], seen: NDArray[np.bool_], second: int) -> NDArray[np.float64]:
    """Return the grip over a span with some frames in which the prop was seen: constant, or slowly changing."""
    steady = np.median(grip[seen], axis=0)
    numbers = np.arange(len(grip))
    filled = np.stack([np.interp(numbers, numbers[seen], column[seen]) for column in grip.T], axis=1)
    slow = uniform_filter1d(filled, second, axis=0, mode="nearest")
    slides = np.percentile(np.linalg.norm(slow - steady, axis=1), 95) > SLIDES_M
    return slow if slides else np.broadcast_to(steady, grip.shape)


def _with_hand(
    hand_wxyz: NDArray[np.float64], turns_wxyz: NDArray[np.float64], seen: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return a prop's rotations; in frames in which it was not seen, from those of the hand that holds it."""
    if seen.all():
        return turns_wxyz
    numbers = np.arange(len(seen))
    on_hand = continuous_signs(multiply(inverse(hand_wxyz[seen]), turns_wxyz[seen]))
    between = np.stack([np.interp(numbers, numbers[seen], column) for column in on_hand.T], axis=1)
    turned = multiply(hand_wxyz, normalized(between))
    return continuous_signs(np.where(seen[:, None], turns_wxyz, turned))


def held_spans(
    away_m: NDArray[np.float64], seen: NDArray[np.bool_], least: int, unseen: int
) -> list[tuple[int, int]]:
    """Return the spans of frames, first and one past the last, in which a hand holds a prop.

    Args:
        away_m: distance of the hand from the surface [m], shape (n,).
        seen: whether the prop was seen, shape (n,).
        least: shortest span [frames].
        unseen: most frames for which it stays held unseen, if the hand still holds it afterwards.
    """
    spans, begun, held = [], -1, -1
    for k, (away, there) in enumerate(zip(away_m.tolist(), seen.tolist(), strict=True)):
        if begun < 0:
            if there and away < NEAR_M:
                begun = held = k
        elif there and away <= FAR_M and k - held <= unseen:
            held = k
        elif there or k - held > unseen:
            spans.append((begun, held + 1))
            begun = k if there and away < NEAR_M else -1
            held = begun
    if begun >= 0:
        spans.append((begun, held + 1))
    return [(first, last) for first, last in spans if last - first >= least]
