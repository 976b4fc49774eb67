"""The performers of a whole take, with their frames, names and proportions.

Everybody who holds a T-pose is a performer, and so is the person of the calibration. All others are bystanders,
unless the operator says that everybody is a performer.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from heapq import merge

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.calibration.calibrate import walk_of, with_performer
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.calibration.performer.tpose import find_tpose
from studio.engine.identity.crowd import ALIKE_M, Crowd, SeenBody, Someone, apart_m
from studio.engine.identity.known import KnownPerson
from studio.engine.identity.recognised import LEAST_FRAMES, LEAST_SPAN_S, MOST_PERFORMERS, performer_key
from studio.engine.identity.settle import settle
from studio.engine.identity.undecided import spans
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import MIRROR, PARENTS
from studio.engine.model.on_demand import FramesOnDemand

_UP = np.array([0.0, 0.0, 1.0])
_LEAST_S = 1.0
"""A person seen for less than this does not count."""

_SURE = 0.8
"""Lowest confidence of joints between which bones are measured."""
_LEAST_DOUBTS = 3


@dataclass(frozen=True)
class TakePerformer:
    """A performer of a take.

    Attributes:
        number: that of a performer known from before; others are numbered in the order in which they came in, from 1.
        frames: by camera, in device time order, with this performer's body alone.
        calibration: with this performer's proportions.
        undecided_s: spans of stage time [s] in which this performer was not told apart from another.
    """

    number: int
    frames: Mapping[str, Sequence[CameraFrame]]
    calibration: Calibration
    undecided_s: tuple[tuple[float, float], ...]

    @property
    def name(self) -> str:
        """`performer_1`, ..."""
        return performer_key(self.number)


@dataclass(frozen=True)
class People:
    """Everybody in a take.

    Attributes:
        bystanders: number of others who held no T-pose and are ignored.
        left_out: number of those who held one, but came in after the eighth performer.
        recorded_s: spans of stage time [s] in which cameras sent frames, of anybody.
    """

    performers: tuple[TakePerformer, ...]
    bystanders: int
    left_out: int
    recorded_s: tuple[tuple[float, float], ...]


def of_one(frames: Mapping[str, Sequence[CameraFrame]]) -> dict[str, Sequence[CameraFrame]]:
    """Return the frames that show one body; a calibration uses these."""
    return {name: [frame for frame in mine if not frame.others] for name, mine in frames.items()}


def find_people(
    frames: Mapping[str, Sequence[CameraFrame]],
    calibration: Calibration,
    known: Sequence[KnownPerson] = (),
    *,
    everybody: bool = False,
) -> People:
    """Return everybody in a take.

    Args:
        frames: by camera, in device time order, with all bodies.
        calibration: places the cameras; its performer is the person who was alone on the stage for longest. Cameras
            that it lacks are left out.
        known: performers who are known from before; they are recognised by their bones and need no T-pose.
        everybody: persons without a T-pose are performers too, measured over the take.
    """
    crowd, order, alone = Crowd(), [], {}
    times_s: list[float] = []
    for stage_s, camera, place, bodies in _in_order(frames, calibration):
        times_s.append(stage_s)
        found = crowd.add(stage_s, bodies)
        order.append((camera, place))
        if len(found) == 1 and found[0] is not None:
            alone[found[0]] = alone.get(found[0], 0) + 1
    settle(crowd.people, np.array(times_s), lambda body: _bones(_body_of(body, frames, order)))
    recognised = recognise([one.person.bones_m() for one in crowd.people], known)
    walker = max(alone, key=lambda who: alone[who], default=0) if not recognised else None
    if everybody and calibration.performer is None:
        walker = None
    performers: list[TakePerformer] = []
    bystanders = left_out = 0
    used = max((one.performer for one in known), default=0)
    for number, one in enumerate(crowd.people):
        own = _frames_of(one, frames, order)
        if one.person.last_s - one.person.first_s < _LEAST_S and len(one.sightings) < 2 * len(own):
            continue
        told = recognised.get(number)
        if told is not None:
            theirs = (
                calibration if told.proportions is None else replace(calibration, performer=told.proportions)
            )
        else:
            theirs = calibration if number == walker else _measured(calibration, own, everybody=everybody)
        if theirs is None:
            bystanders += 1
            continue
        if len(performers) == MOST_PERFORMERS:
            left_out += 1
            continue
        theirs_is = used + 1 if told is None else told.performer
        used = max(used, theirs_is)
        performers.append(TakePerformer(theirs_is, own, theirs, spans(one.doubted, _LEAST_DOUBTS)))
    performers.sort(key=lambda one: one.number)
    return People(tuple(performers), bystanders, left_out, spans(times_s, 1))


_Moment = tuple[float, str, int, NDArray[np.float64]]


def _in_order(frames: Mapping[str, Sequence[CameraFrame]], calibration: Calibration) -> Iterator[_Moment]:
    """Yield every frame of the calibrated cameras in the order of stage times: time [s], camera, place among the
    camera's frames, and the bodies' joints [m], shape (body_count, 21, 3)."""

    def moments(name: str) -> Iterator[_Moment]:
        camera = calibration.cameras[name]
        for place, frame in enumerate(frames[name]):
            joints = np.array([body.positions for body in frame.bodies()])
            placed = transform_points(camera.T_stage_camera, unbiased(joints, camera.depth_bias_m))
            yield camera.clock.stage_ns(frame.device_time_ns) * 1e-9, name, place, placed

    names = [name for name in frames if name in calibration.cameras]
    return merge(*(moments(name) for name in names), key=lambda moment: moment[:3])


class _OfOneBody(FramesOnDemand):
    """A camera's frames with one body alone."""

    def __init__(self, frames: Sequence[CameraFrame], sightings: list[SeenBody]) -> None:
        """`sightings`: with the frame's place among `frames`."""
        self._frames, self._sightings = frames, sightings

    def __len__(self) -> int:
        return len(self._sightings)

    def at(self, index: int) -> CameraFrame:
        sighting = self._sightings[index]
        return self._frames[sighting.frame].bodies()[sighting.body]


def _body_of(
    body: SeenBody, frames: Mapping[str, Sequence[CameraFrame]], order: list[tuple[str, int]]
) -> CameraFrame:
    camera, place = order[body.frame]
    return frames[camera][place].bodies()[body.body]


def _bones(frame: CameraFrame) -> NDArray[np.float64]:
    """Return the lengths of a body's bones [m], shape (21,), both sides as one; NaN = not clearly seen."""
    sure = np.where((frame.confidence >= _SURE)[:, None], frame.positions, np.nan)
    lengths = np.linalg.norm(sure - sure[np.maximum(PARENTS, 0)], axis=1)
    both = np.stack([lengths, lengths[MIRROR]])
    seen = np.isfinite(both)
    mean = np.where(seen, both, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    return np.where(seen.any(axis=0), mean, np.nan)


def _frames_of(
    one: Someone, frames: Mapping[str, Sequence[CameraFrame]], order: list[tuple[str, int]]
) -> dict[str, Sequence[CameraFrame]]:
    own: dict[str, list[SeenBody]] = {}
    for sighting in sorted(one.sightings, key=lambda sighting: sighting.frame):
        camera, place = order[sighting.frame]
        own.setdefault(camera, []).append(SeenBody(place, sighting.body))
    return {name: _OfOneBody(frames[name], own[name]) for name in frames if name in own}


def _measured(
    calibration: Calibration, frames: Mapping[str, Sequence[CameraFrame]], *, everybody: bool
) -> Calibration | None:
    """Return the calibration with a person's proportions; None if they hold no T-pose but need one."""
    seen = any(len(mine) >= LEAST_FRAMES and _lasts_s(mine) >= LEAST_SPAN_S for mine in frames.values())
    if not (everybody and seen) and find_tpose(walk_of(calibration, frames), _UP) is None:
        return None
    theirs = with_performer(replace(calibration, performer=None), frames, another=True)
    return None if theirs.performer is None else theirs


def _lasts_s(frames: Sequence[CameraFrame]) -> float:
    return (frames[-1].device_time_ns - frames[0].device_time_ns) * 1e-9


def recognise(bones_m: Sequence[NDArray[np.float64]], known: Sequence[KnownPerson]) -> dict[int, KnownPerson]:
    """Return the known performers among the persons seen, by index: the joint assignment with the most similar bones.

    Args:
        bones_m: of each person seen, see `FollowedPerson.bones_m`, shape (21,) each.
        known: performers.
    """
    from scipy.optimize import linear_sum_assignment  # slow to load, as in `crowd`

    far = np.array([[min(apart_m(bones, one.bones_m), 1.0) for one in known] for bones in bones_m])
    pairs = zip(*linear_sum_assignment(far), strict=True) if far.size else ()
    return {int(who): known[one] for who, one in pairs if far[who, one] < ALIKE_M}
