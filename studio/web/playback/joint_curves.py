"""Curves of several joints of a clip, as an animator's graph editor has them, thinned for a part of the take.

Axes are those of exported files: y up, the T-pose faces +z. Rotations are local to the parent: Euler angles without
jumps, in the order that FBX files have for the joint.
"""

import threading
from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from studio.engine.animation.clip.kinematics import local_keys
from studio.engine.animation.clip.skeleton import rotations_to_file_axes, to_file_axes
from studio.engine.animation.curves.euler import best_order, euler_deg
from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import INDEX, OUTPUT_INDEX, OUTPUT_OF_CANONICAL, OUTPUT_PARENTS
from studio.web.playback.clip import Clip
from studio.web.playback.curves import no_joint, seen_by, spans, speed_m_s, thinned
from studio.web.playback.second import Second

Array = NDArray[np.float64]

CHANNELS: dict[str, str] = {
    "position_x": "m", "position_y": "m", "position_z": "m",
    "rotation_x": "deg", "rotation_y": "deg", "rotation_z": "deg",
    "speed": "m/s", "distance": "mm",
}  # fmt: skip
"""Channel -> its unit. `distance` is to the second figure's joint, wherever that stands."""

MAX_CURVES = 12
_DECIMALS = {"m": 4, "deg": 2, "m/s": 3, "mm": 1}
_CANONICAL_OF_OUTPUT = {OUTPUT_INDEX[output]: INDEX[name] for name, output in OUTPUT_OF_CANONICAL.items()}


class JointCurve(Struct):
    """One channel of one joint.

    Attributes:
        joint, channel: one of `OUTPUT_JOINTS`, of `CHANNELS`; `unit`: of the values.
        order: of a rotation's axes, the first one turned first, as programs name it ("XYZ"); else "".
        frames: indices, increasing; `values` there, null where unknown.
        unseen: spans `[first, last]` of frames in which no camera was used for the joint: the solve filled them in.
    """

    joint: str
    channel: str
    unit: str
    order: str
    frames: list[int]
    values: list[float | None]
    unseen: list[tuple[int, int]]


class JointCurves(Struct):
    """Curves of the frames from `first` to `last`; `whole`: with every frame, not thinned."""

    first: int
    last: int
    whole: bool
    curves: list[JointCurve]


class CurveColumns:
    """The channels of one clip over all its frames, each computed at its first request and kept until another clip or
    second figure is requested. Safe from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._clip: Clip | None = None
        self._beside: tuple[Second | None, float] = (None, 0.0)
        self._columns: dict[str, tuple[Array, str]] = {}
        self._unseen: dict[int, NDArray[np.bool_]] = {}

    def curves(
        self,
        clip: Clip,
        wanted: Sequence[str],
        *,
        first: int = 0,
        last: int | None = None,
        points: int = 3000,
        beside: tuple[Second | None, float] = (None, 0.0),
    ) -> JointCurves:
        """Return curves of a part of a clip: the first frame and the extremes of each stretch, about `points` frames.

        Args:
            clip: the replayed clip.
            wanted: curves as `joint.channel`, at most `MAX_CURVES`; without a second figure there is no `distance`.
            first, last: the part; None = up to the end.
            points: frames of each curve, about.
            beside: the second figure, and its lead [s].

        Raises:
            SettingsError: no such joint or channel, too many curves, or no such part.
        """
        names = [_split(one) for one in wanted]
        if len(names) > MAX_CURVES:
            raise SettingsError(
                "replay.many_curves",
                "{count} curves are wanted; allowed: {most} at most; leave some out",
                count=len(names),
                most=MAX_CURVES,
            )
        end = clip.poses.frame_count - 1
        last = end if last is None else min(last, end)
        if not 0 <= first <= last:
            raise SettingsError(
                "replay.range",
                "first={first}, last={last} is no range; allowed: 0 to {most}, first up to last",
                first=first,
                last=last,
                most=end,
            )
        with self._lock:
            self._take_in(clip, beside)
            found = [
                self._curve(joint, channel, slice(first, last + 1), points)
                for joint, channel in names
                if channel != "distance" or beside[0] is not None
            ]
        return JointCurves(first, last, last - first < points, found)

    def _take_in(self, clip: Clip, beside: tuple[Second | None, float]) -> None:
        if clip is not self._clip:
            self._clip, self._columns, self._unseen = clip, {}, {}
        if beside[0] is not self._beside[0] or beside[1] != self._beside[1]:
            self._columns = {k: v for k, v in self._columns.items() if not k.endswith(".distance")}
            self._beside = beside

    def _curve(self, joint: str, channel: str, part: slice, points: int) -> JointCurve:
        column, order = self._column(joint, channel)
        values = column[part]
        rows = thinned(values[:, None], points)
        unit = CHANNELS[channel]
        shown = values[rows].round(_DECIMALS[unit])
        known = np.isfinite(shown)
        unseen = spans(self._not_used(OUTPUT_INDEX[joint])[part], len(values) // points)
        return JointCurve(
            joint, channel, unit, order, (rows + part.start).tolist(),
            [value if there else None for value, there in zip(shown.tolist(), known.tolist(), strict=True)],
            [(a + part.start, b + part.start) for a, b in unseen],
        )  # fmt: skip

    def _column(self, joint: str, channel: str) -> tuple[Array, str]:
        key = f"{joint}.{channel}"
        if key not in self._columns:
            kind = channel.split("_")[0]
            values, order = getattr(self, f"_{kind}")(OUTPUT_INDEX[joint])
            for k, name in enumerate([f"{kind}_{axis}" for axis in "xyz"] if values.ndim == 2 else [kind]):
                self._columns[f"{joint}.{name}"] = (values[:, k] if values.ndim == 2 else values), order
        return self._columns[key]

    # --- channels of a joint over all frames, shape (N,) or (N, 3), and a rotation's order

    def _position(self, joint: int) -> tuple[Array, str]:
        return to_file_axes(self._shown.poses.positions_m[:, joint]), ""

    def _rotation(self, joint: int) -> tuple[Array, str]:
        poses, parent = self._shown.poses, int(OUTPUT_PARENTS[joint])
        pair = [joint] if parent < 0 else [parent, joint]
        parents = np.arange(-1, len(pair) - 1)
        _, local = local_keys(parents, poses.positions_m[:, pair], poses.rotations_wxyz[:, pair])
        turns = rotations_to_file_axes(local[:, -1])
        order = best_order(turns)
        return euler_deg(turns, order), order[::-1]

    def _speed(self, joint: int) -> tuple[Array, str]:
        poses = self._shown.poses
        return speed_m_s(poses.positions_m[:, joint], poses.time_s), ""

    def _distance(self, joint: int) -> tuple[Array, str]:
        poses, (second, ahead_s) = self._shown.poses, self._beside
        if second is None:
            raise AssertionError("without a second figure there is no distance")
        there = second.path_m(poses.time_s + ahead_s, joint)
        return 1e3 * np.linalg.norm(poses.positions_m[:, joint] - there, axis=1), ""

    @property
    def _shown(self) -> Clip:
        if self._clip is None:
            raise AssertionError("no clip was taken in")
        return self._clip

    def _not_used(self, joint: int) -> NDArray[np.bool_]:
        """Whether no camera was used for a joint, or for its nearest parent that cameras see, by frame."""
        if joint not in self._unseen:
            clip, seen = self._shown, joint
            while seen not in _CANONICAL_OF_OUTPUT and OUTPUT_PARENTS[seen] >= 0:
                seen = int(OUTPUT_PARENTS[seen])
            if clip.trace is None or seen not in _CANONICAL_OF_OUTPUT:
                self._unseen[joint] = clip.poses.confidence[:, joint] == 0.0
            else:
                place, trace = _CANONICAL_OF_OUTPUT[seen], clip.trace
                used = [
                    seen_by(trace, camera, place) & trace.used[:, camera, place]
                    for camera in range(len(trace.cameras))
                ]
                self._unseen[joint] = ~np.any(used, axis=0)
        return self._unseen[joint]


def _split(wanted: str) -> tuple[str, str]:
    joint, _, channel = wanted.partition(".")
    if joint not in OUTPUT_INDEX:
        raise no_joint(joint)
    if channel not in CHANNELS:
        raise SettingsError(
            "replay.no_channel",
            "there is no channel {channel!r}; allowed: {allowed}",
            channel=channel,
            allowed=[*CHANNELS],
        )
    return joint, channel
