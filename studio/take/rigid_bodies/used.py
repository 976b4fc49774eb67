"""The rigid bodies of a take in use: on the stage, measured on joints, as evidence, as a reference."""

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.edits.edit import Edit
from studio.engine.edits.pins import Pins
from studio.engine.metrics.reference.canonical import canonical_columns, canonical_positions
from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.calibration import Performer
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.model.poses import Poses
from studio.engine.rigid_bodies.known import KnownBody, TakeBodies, Tie
from studio.engine.rigid_bodies.markers import MarkerTracks
from studio.engine.rigid_bodies.pins import BodyPins
from studio.engine.rigid_bodies.props import HANDS, prop_poses
from studio.engine.rigid_bodies.tie import joint_places_m, measure_ties
from studio.engine.rigid_bodies.tracks import BodyTrack, BodyTracks
from studio.take.folder.solved import SolvedPerformer, solved_performers
from studio.take.folder.take import PERFORMER, Take
from studio.take.rigid_bodies.kept import save_take_bodies, take_bodies, take_markers, take_tracks

REFERENCE_HZ = 120.0


def stage_bodies(take: Take, bodies: TakeBodies | None = None) -> BodyTracks:
    """Return the motion of a take's rigid bodies in the stage frame.

    Raises:
        FormatError: a file is damaged.
    """
    known = take_bodies(take) if bodies is None else bodies
    return take_tracks(take).placed(known.place, known.later_s)


def stage_markers(take: Take, bodies: TakeBodies | None = None) -> MarkerTracks:
    """Return a take's markers in the stage frame.

    Raises:
        FormatError: a file is damaged.
    """
    known = take_bodies(take) if bodies is None else bodies
    return take_markers(take).placed(known.place, known.later_s)


def name_body(take: Take, body: KnownBody) -> TakeBodies:
    """Describe a body of a take; return the descriptions. Its tie stays while it is on the same joint.

    Raises:
        SettingsError: a value that is not allowed, or no such body was received.
    """
    if body.name not in take_tracks(take).tracks:
        raise no_such_body(take, body.name)
    known = take_bodies(take)
    before = known.named(body.name)
    ties = dict(known.ties)
    if before is not None and (before.joint, before.performer) != (body.joint, body.performer):
        ties.pop(body.name, None)
    mine = [body if one.name == body.name else one for one in known.bodies]
    found = msgspec.structs.replace(known, bodies=(*mine, *(() if before else (body,))), ties=ties)
    save_take_bodies(take, found)
    return found


def forget_body(take: Take, name: str) -> TakeBodies:
    """Delete the description of a body of a take, which is then only shown; return the descriptions.

    Raises:
        SettingsError: no such body was received.
    """
    if name not in take_tracks(take).tracks:
        raise no_such_body(take, name)
    known = take_bodies(take)
    ties = {other: tie for other, tie in known.ties.items() if other != name}
    bodies = tuple(one for one in known.bodies if one.name != name)
    found = msgspec.structs.replace(known, bodies=bodies, ties=ties)
    save_take_bodies(take, found)
    return found


def prop_in_hand(
    name: str, track: BodyTrack, body: KnownBody | None, performers: Sequence[SolvedPerformer]
) -> Poses:
    """Return a prop as a skeleton of two joints at a solve's instants, tied to the hand that holds it.

    Args:
        name: of its joints.
        track: its motion on the stage.
        body: its description; None = none.
        performers: of the solve.
    """
    mine = [
        one.poses for one in performers if body is None or not body.joint or one.performer == body.performer
    ]
    hands = HANDS if body is None or body.joint not in HANDS else (body.joint,)
    shape = None if body is None else body.shape
    return prop_poses(name, track, shape, mine or [performers[0].poses], hands)


def no_such_body(take: Take, name: str) -> SettingsError:
    """Return the error for a name that no body of a take has."""
    return SettingsError(
        "rigid.no_such",
        "no rigid body {name!r} came in while this take was recorded; there are: {names}",
        name=name,
        names=", ".join(take_tracks(take).tracks) or "none",
    )


def measure(take: Take, solve: str, *, place: bool) -> TakeBodies:
    """Measure how the bodies on joints sit on them, against a solve, and keep it; return the descriptions.

    Args:
        take: whose bodies.
        solve: of the take.
        place: also measure the place of their system; else it stays.

    Raises:
        SettingsError: no body is on a joint.
        FormatError: they were not seen for long enough, or the solve cannot be read.
    """
    known = take_bodies(take)
    poses_of = _poses_of(take, solve)
    on_joints = {one.name: one for one in known.bodies if one.joint and one.use != "prop"}
    if not on_joints:
        raise SettingsError(
            "rigid.no_joint",
            "no rigid body of this take is on a joint; name one first, such as "
            "`studio rigid TAKE set NAME use=evidence joint=right_hand`",
        )
    time_s = next(iter(poses_of.values())).time_s
    joints = {}
    for name, one in on_joints.items():
        poses = poses_of.get(one.performer)
        if poses is not None and canonical_columns(poses)[INDEX[one.joint]] >= 0:
            joints[name] = _at(poses, one.joint, time_s)
    tracks = take_tracks(take)
    told = {name: one for name, one in tracks.tracks.items() if name not in tracks.on_stage}
    found = measure_ties(time_s, joints, told, place=None if place else known.place)
    measured = msgspec.structs.replace(
        known,
        place=found.place,
        later_s=found.later_s,
        ties={**known.ties, **found.ties},
        calibration=take.meta["calibration"] if place else known.calibration,
    )
    save_take_bodies(take, measured)
    return measured


def _poses_of(take: Take, solve: str) -> dict[str, Poses]:
    return {one.performer: one.poses for one in solved_performers(take, solve)}


def _at(poses: Poses, joint: str, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    places = canonical_positions(poses)[:, INDEX[joint]]
    return np.stack([np.interp(time_s, poses.time_s, column) for column in places.T], axis=1)


def evidence_of(take: Take, performer: str) -> dict[str, tuple[BodyTrack, Tie]]:
    """Return by canonical joint the bodies that pin a performer's joints: evidence that was measured.

    Empty if the place was measured under another calibration than that in use.

    Raises:
        FormatError: a file is damaged.
    """
    known = take_bodies(take)
    if known.calibration is not None and known.calibration != take.meta["calibration"]:
        return {}
    wanted = [one for one in known.bodies if one.use == "evidence" and one.performer == performer]
    if not any(one.name in known.ties for one in wanted):
        return {}
    tracks = stage_bodies(take, known).tracks
    return {
        one.joint: (tracks[one.name], known.ties[one.name])
        for one in wanted
        if one.name in known.ties and one.name in tracks
    }


def pins_of(take: Take, performer: str, edits: Sequence[Edit], proportions: Performer | None) -> Pins:
    """Return the pins of a performer's edits and of the rigid bodies that are evidence.

    Raises:
        FormatError: a file is damaged.
    """
    bodies = evidence_of(take, performer)
    return BodyPins(edits, proportions, bodies) if bodies else Pins(edits, proportions)


def reference_of(take: Take, performer: str = PERFORMER) -> Reference:
    """Return the positions in which the bodies on a performer's joints put these, as a reference on the stage clock.

    Raises:
        FormatError: no body on a joint was measured, or a file is damaged.
    """
    known = take_bodies(take)
    tracks = stage_bodies(take, known).tracks
    mine = {
        one.joint: one.name
        for one in known.bodies
        if one.use != "prop" and one.performer == performer and one.name in known.ties and one.name in tracks
    }
    if not mine:
        raise FormatError(
            "rigid.not_measured",
            "no rigid body on a joint was measured; run `studio rigid TAKE measure` first",
        )
    begins_s = min(tracks[name].time_s[0] for name in mine.values())
    ends_s = max(tracks[name].time_s[-1] for name in mine.values())
    time_s = np.arange(begins_s, ends_s, 1.0 / REFERENCE_HZ)
    positions = np.full((len(time_s), JOINT_COUNT, 3), np.nan)
    for joint, name in mine.items():
        positions[:, INDEX[joint]] = joint_places_m(tracks[name], known.ties[name], time_s)
    return Reference(time_s, positions)


def distances_mm(take: Take, solve: str) -> dict[str, NDArray[np.float64]]:
    """Return by body the distance of its joint in a solve from where the body puts it [mm], where it is seen.

    Raises:
        FormatError: a file is damaged.
    """
    known, poses_of = take_bodies(take), _poses_of(take, solve)
    tracks = stage_bodies(take, known).tracks
    found = {}
    for one in known.bodies:
        poses = poses_of.get(one.performer)
        if poses is None or not one.joint or one.name not in known.ties or one.name not in tracks:
            continue
        where = joint_places_m(tracks[one.name], known.ties[one.name], poses.time_s)
        apart = np.linalg.norm(canonical_positions(poses)[:, INDEX[one.joint]] - where, axis=1) * 1e3
        found[one.name] = apart[np.isfinite(apart)]
    return found
