"""Props that depth cameras saw: found in a take, and kept as its rigid bodies."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.model.calibration import Calibration
from studio.engine.rigid_bodies.known import KnownBody
from studio.engine.rigid_bodies.tracks import BodyTrack
from studio.engine.seeing.props.follow import FollowedProp, follow_prop
from studio.engine.seeing.props.sight import PropCamera, SeenImage
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import Take
from studio.take.raw.depth import DepthReader, DepthRecording, placed_cameras
from studio.take.rigid_bodies.kept import save_seen, take_tracks
from studio.take.rigid_bodies.used import name_body

_ROOM_IMAGES = 24
_NEAREST_S = 0.025


def find_prop_of(
    take: Take,
    body: KnownBody,
    *,
    solve: str | None = None,
    start: tuple[float, tuple[float, float, float]] | None = None,
    progress: Callable[[float], None] | None = None,
) -> FollowedProp:
    """Find a prop in a take's depth images and keep it as a rigid body of the take; return its motion.

    Args:
        take: recorded with depth cameras, and calibrated.
        body: the prop; its shape is searched for.
        solve: of the take, whose performers are no prop; None = nobody is in view.
        start: a time from the solve's beginning [s], and the prop's place on the stage then [m]; None = it is
            searched for.
        progress: receives the share done.

    Raises:
        SettingsError: no shape is given, or another system tracked a body of this name.
        FormatError: the take has no depth, or nothing of this shape was seen.
        CalibrationError: no camera with depth is calibrated.
    """
    if body.shape is None:
        raise SettingsError(
            "rigid.no_shape",
            "no shape is known of {name}; give one, such as shape=cylinder:3,90 (cm)",
            name=body.name,
        )
    tracks = take_tracks(take)
    if body.name in tracks.tracks and body.name not in tracks.on_stage:
        raise SettingsError(
            "rigid.told_already",
            "another system told of {name} while this take was recorded; give the prop another name",
            name=body.name,
        )
    recording = DepthRecording(take.raw_path)
    if not recording.cameras:
        raise FormatError(
            "rigid.no_depth",
            "{take} has no depth images, in which a prop could be seen",
            take=take.path,
        )
    calibration = take.calibration()
    names = placed_cameras(take.path, recording, calibration)
    with DepthReader(recording) as reader:
        looks = _Looks(reader, names, calibration, _people(take, solve))
        time_s = looks.time_s
        began_s = float(time_s[0]) if len(time_s) else 0.0
        at = None if start is None else (began_s + start[0], np.array(start[1]))
        found = (
            follow_prop(time_s, looks.at, body.shape, start=at, progress=progress) if len(time_s) else None
        )
    if found is None:
        raise FormatError(
            "rigid.not_found",
            "nothing of the shape of {name} was seen in {take}; say where it is at a time, by at=SECONDS,X,Y,Z",
            name=body.name,
            take=take.path,
        )
    save_seen(take, body.name, BodyTrack(found.time_s, found.places_m, found.rotations_wxyz))
    name_body(take, body)
    return found


def _people(take: Take, solve: str | None) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return the performers of a solve: times [s] and canonical joints [m]."""
    if solve is None:
        return []
    return [(one.poses.time_s, canonical_positions(one.poses)) for one in solved_performers(take, solve)]


class _Looks:
    """What a take's cameras see at each instant; the instants are those of the camera with the most images."""

    def __init__(
        self,
        reader: DepthReader,
        names: Sequence[str],
        calibration: Calibration,
        people: list[tuple[NDArray[np.float64], NDArray[np.float64]]],
    ) -> None:
        self._reader, self._names, self._people = reader, names, people
        recording = reader.recording
        self._times_s = {
            name: calibration.cameras[name].clock.stage_s(
                np.float64(1e-9) * recording.times_ns(name).astype(np.float64)
            )
            for name in names
        }
        self._cameras = {}
        for name in names:
            count = len(self._times_s[name])
            chosen = np.unique(np.linspace(0, count - 1, min(_ROOM_IMAGES, count)).round().astype(int))
            images = [reader.image(name, int(k)) for k in chosen]
            room = [one.depth_mm for one in images if one is not None]
            if room:
                T = calibration.cameras[name].T_stage_camera
                self._cameras[name] = PropCamera(recording.cameras[name], T, room)
        first = max(names, key=lambda name: len(self._times_s[name]))
        time_s = self._times_s[first]
        if people:
            begins_s, ends_s = min(one[0][0] for one in people), max(one[0][-1] for one in people)
            time_s = time_s[(time_s >= begins_s) & (time_s <= ends_s)]
        self.time_s = time_s

    def at(self, number: int) -> list[SeenImage]:
        """Return what the cameras see at an instant."""
        time_s = float(self.time_s[number])
        found = []
        for name, camera in self._cameras.items():
            times = self._times_s[name]
            k = int(np.abs(times - time_s).argmin())
            if abs(times[k] - time_s) > _NEAREST_S:
                continue
            image = self._reader.image(name, k)
            if image is not None:
                found.append(camera.see(image.depth_mm, float(times[k] - time_s), self._joints(times[k])))
        return found

    def _joints(self, time_s: float) -> list[NDArray[np.float64]]:
        return [
            joints[int(np.abs(times - time_s).argmin())]
            for times, joints in self._people
            if times[0] - 0.1 <= time_s <= times[-1] + 0.1
        ]
