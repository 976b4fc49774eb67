"""The content of `take.json`; docs/formats.md explains every key."""

from typing import NotRequired, TypedDict

from studio.engine.model.calibration import PerformerJson
from studio.engine.model.solve_metrics import ExchangeJson


class CameraMeta(TypedDict):
    """A camera of a take: its device, and the client's starts (`boot_ids`).

    Attributes:
        clock_within_s: how far its clock may be from that of the other cameras with this key [s]; missing: it has a
            clock of its own.
    """

    name: str
    device: str
    joint_set: str
    serial: str
    frames_per_second: float
    intrinsics: dict[str, float | list[float]] | None
    boot_ids: list[str]
    clock_within_s: NotRequired[float]


class MarkerMeta(TypedDict):
    """A named instant of a take, in stage time [s]."""

    time_s: float
    name: str


class PartMeta(TypedDict):
    """A part of another take's solve that a take was spliced of.

    Attributes:
        take: its id then, session/name.
        solve, performer: which; performer "" = the only one.
        start_s, end_s: what was used of it, in its time [s].
    """

    take: str
    solve: str
    performer: str
    start_s: float
    end_s: float


class TakePerformerMeta(TypedDict):
    """A performer who was known when a take was recorded.

    Attributes:
        number: from 1, in the order in which they came in.
        proportions: None = those of the calibration.
        bones_m: lengths as they were seen, both sides as one, by canonical joint; unknown ones are left out [m].
    """

    number: int
    proportions: PerformerJson | None
    bones_m: dict[str, float]


class TakeMeta(TypedDict):
    """A take: its names, when it was created (ISO 8601, UTC), its cameras, its slate.

    Attributes:
        performers: who was known on a stage of several when it was recorded live.
        calibration: number of the one in use.
        calibration_s: length of the calibration part at the beginning [s]; None = no such part.
        recording: state of the recording.
        take_id: names a live take for good.
        timecode: of a live take: time of day at its start, `hh:mm:ss:ff`.
        timecode_rate: of a take that was recorded with timecode: its rate.
        number: of a live take, within the session.
        performer_names: names of its performers, by `performer_1`, ...
        parts: of a take that was spliced: what of, in their order.
        exchanges: of performers, in the order in which they were made.
        video_unwanted: its video was thrown away: what cameras still have of it does not come.
    """

    format_version: int
    id: str
    session: str
    name: str
    created: str
    source: str
    cameras: list[CameraMeta]
    performer: NotRequired[str]
    performers: NotRequired[list[TakePerformerMeta]]
    notes: NotRequired[str]
    rating: NotRequired[int | None]
    starred: NotRequired[bool]
    tags: NotRequired[list[str]]
    markers: NotRequired[list[MarkerMeta]]
    performer_names: NotRequired[dict[str, str]]
    exchanges: NotRequired[list[ExchangeJson]]
    parts: NotRequired[list[PartMeta]]
    calibration: int | None
    calibration_s: float | None
    recording: str
    take_id: NotRequired[str]
    timecode: NotRequired[str]
    timecode_rate: NotRequired[str]
    number: NotRequired[int]
    video_unwanted: NotRequired[bool]
