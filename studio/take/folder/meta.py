"""The content of `take.json`; docs/formats.md explains every key."""

from typing import NotRequired, TypedDict

from studio.engine.model.calibration import PerformerJson
from studio.engine.model.solve_metrics import ExchangeJson


class CameraMeta(TypedDict):
    """A camera of a take: its device, and the client's starts (`boot_ids`).

    Attributes:
        clock_within_s: maximum offset between its clock and that of the other cameras with this key [s]; missing: it
            has its own clock.
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
    """A part of another take's solve, used in a spliced take.

    Attributes:
        take: its id at that time, session/name.
        solve, performer: which; performer "" = the only one.
        start_s, end_s: the part used, in its time [s].
    """

    take: str
    solve: str
    performer: str
    start_s: float
    end_s: float


class TakePerformerMeta(TypedDict):
    """A performer who was known when a take was recorded.

    Attributes:
        number: from 1, in order of entry.
        proportions: None = those of the calibration.
        bones_m: measured lengths by canonical joint, both sides as one; unknown ones are left out [m].
    """

    number: int
    proportions: PerformerJson | None
    bones_m: dict[str, float]


class TakeMeta(TypedDict):
    """A take: its names, when it was created (ISO 8601, UTC), its cameras, its slate.

    Attributes:
        performers: those known on a stage of several when it was recorded live.
        calibration: number of the one in use.
        calibration_s: length of the calibration part at the beginning [s]; None = no such part.
        recording: state of the recording.
        take_id: permanent id of a live take.
        timecode: of a live take: time of day at its start, `hh:mm:ss:ff`.
        timecode_rate: rate of the timecode of a take recorded with one.
        number: of a live take, within the session.
        performer_names: names of its performers, by `performer_1`, ...
        parts: of a spliced take: its parts in order.
        exchanges: of performers, in the order in which they were made.
        video_unwanted: its video was thrown away; cameras do not send what they still have of it.
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
