"""Known places of joints that touch the floor or another joint, for as long as they touch.

A joint on the floor stays where it came down. A joint on another one is at the distance of both radii, on the side on
which it is; there it may slide. Radii are those of the tracker's surface (`seeing.fitting.cones`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import ContactEdit
from studio.engine.edits.touches import Touch
from studio.engine.model.frames import Pinned
from studio.engine.model.joints import CANONICAL, INDEX, OUTPUT_OF_CANONICAL
from studio.engine.model.poses import Poses
from studio.engine.seeing.fitting.cones import CONES

Array = NDArray[np.float64]


def _thick(joint: str) -> float:
    """Radius of the body about a canonical joint, as a share of stature."""
    name = OUTPUT_OF_CANONICAL[joint]
    if joint.endswith("_hand"):
        return min(cone.end_radius for cone in CONES if cone.body == name.removesuffix("Middle1"))
    return min(cone.start_radius for cone in CONES if cone.body == name)


THICK = np.array([_thick(joint) for joint in CANONICAL])
"""Radius of the body about each canonical joint, as a share of stature, shape (21,)."""


@dataclass(frozen=True)
class HeldJoint:
    """A canonical joint that is held at known places.

    Attributes:
        joint: its index.
        place_m: its place in each frame [m], shape (frame_count, 3).
        information: inverse variance [1/m2], shape (frame_count,); 0 = free.
    """

    joint: int
    place_m: Array
    information: Array


def thick_m(joint: int, height_m: float) -> float:
    """Return the radius of a body of this stature about a canonical joint [m]."""
    return float(THICK[joint]) * height_m


def apart_m(touch: Touch, height_m: float) -> float:
    """Return the distance of a joint from the floor, or from the joint, that it touches [m]."""
    touched = 0.0 if touch.touched is None else thick_m(touch.touched, height_m)
    return thick_m(touch.joint, height_m) + touched


def with_touches(
    pinned: Pinned | None,
    touches: Sequence[Touch],
    sites: Array,
    lies_at: Sequence[Array],
    *,
    floor_m: float,
    height_m: float,
) -> Pinned:
    """Return known places of joints, with those of joints that touch; pins count for more.

    Args:
        pinned: joints at known places in the same frames; None = none.
        touches: in these frames.
        sites: the joints now [m], shape (frame_count, 21, 3).
        lies_at: for each touch, where it lies on the floor [m], shape (frame_count, 2); read only for the floor.
        floor_m: height of the floor.
        height_m: the performer's stature.
    """
    held = []
    for touch, floor in zip(touches, lies_at, strict=True):
        apart = apart_m(touch, height_m)
        if touch.touched is None:
            there = np.concatenate([floor, np.full((len(floor), 1), floor_m + apart)], axis=1)
        else:
            away = sites[:, touch.joint] - sites[:, touch.touched]
            unit = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
            there = sites[:, touch.touched] + apart * unit
        held.append(HeldJoint(touch.joint, there, touch.information))
    return with_held(pinned, held, *sites.shape[:2])


def with_held(
    pinned: Pinned | None, held: Sequence[HeldJoint], frame_count: int, joint_count: int = len(CANONICAL)
) -> Pinned:
    """Return known places of joints, with those of held joints; `pinned` counts for more."""
    shape = frame_count, joint_count
    if pinned is None:
        pinned = Pinned(np.zeros((*shape, 3)), np.zeros(shape), np.zeros(shape), np.full(shape[1], np.inf))
    place, radius, told = pinned.place_m.copy(), pinned.radius_m.copy(), pinned.information.copy()
    for one in held:
        rows = (pinned.information[:, one.joint] == 0.0) & (one.information > 0.0)
        place[rows, one.joint] = one.place_m[rows]
        radius[rows, one.joint] = 0.0
        told[rows, one.joint] = one.information[rows]
    return Pinned(place, radius, told, pinned.reach_m)


def missed_touch_m(
    edit: ContactEdit, poses: Poses, height_m: float, other: tuple[Poses, float] | None = None
) -> float:
    """Return the median distance by which a contact of a joint is missed, over the time that it holds [m].

    Args:
        edit: a `Touch`.
        poses: of the output skeleton.
        height_m: the performer's stature.
        other: poses and stature of the performer whose joint it touches; None = their own.
    """
    theirs, their_height_m = other or (poses, height_m)
    inside = (poses.time_s >= edit.start_s) & (poses.time_s <= edit.end_s)
    if not inside.any():
        inside[np.abs(poses.time_s - edit.start_s).argmin()] = True
    times_s = poses.time_s[inside]
    apart = thick_m(INDEX[edit.joint], height_m)

    def places(of: Poses, joint: str) -> Array:
        path = of.positions_m[:, of.joint_names.index(OUTPUT_OF_CANONICAL[joint])]
        return np.stack([np.interp(times_s, of.time_s, path[:, axis]) for axis in range(3)], axis=1)

    joint = places(poses, edit.joint)
    if edit.touches == "floor":
        away = joint[:, 2]
    else:
        away = np.linalg.norm(joint - places(theirs, edit.touches), axis=1)
        apart += thick_m(INDEX[edit.touches], their_height_m)
    return float(np.median(np.abs(away - apart)))


class TouchingNow:
    """The touches of a performer frame by frame: a joint on the floor lies where it came down."""

    def __init__(self, height_m: float) -> None:
        """Start without touches; `height_m`: the performer's stature."""
        self._height_m = height_m
        self._lies_at: dict[int, Array] = {}

    def known(
        self,
        pinned: Pinned | None,
        touches: Sequence[tuple[int, int | None, float]],
        sites: Array,
        floor_m: float,
    ) -> Pinned:
        """Return known places of joints in one frame, as `with_touches` does for several.

        Args:
            pinned: without an axis of frames.
            touches: as `FrameSet.touches` has them.
            sites: the joints now [m], shape (21, 3).
            floor_m: height of the floor.
        """
        lying = {joint for joint, touched, _ in touches if touched is None}
        self._lies_at = {joint: self._lies_at.get(joint, sites[joint, :2].copy()) for joint in lying}
        every = [Touch(joint, touched, np.array([told])) for joint, touched, told in touches]
        places = [self._lies_at.get(one.joint, np.zeros(2))[None] for one in every]
        known = with_touches(
            None if pinned is None else pinned.of_frames(),
            every,
            sites[None],
            places,
            floor_m=floor_m,
            height_m=self._height_m,
        )
        return known.at(0)
