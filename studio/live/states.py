"""The parts of the live stage's status, for `GET /api/v1/status` and the events.

`docs/api.md` explains every key; the API's own description has the schema. Texts are for people; `state`,
`limited_by` and `verdict` are for programs. Unknown figures are None.
"""

from typing import Literal

from msgspec import Struct

from studio.rigid_bodies.incoming import RigidStatus
from studio.take.folder.marker import Restart
from studio.timecode.incoming import TimecodeStatus

Progress = Literal["idle", "gathering", "computing", "done", "failed"]
PerformerState = Literal["here", "away", "undecided", "measuring", "stranger"]
TPoseState = Literal["idle", "countdown", "holding", "computing", "done", "failed"]


class ClockStatus(Struct):
    """A camera's clock: offset to the stage clock [ms] and drift [ppm]; round trip and largest error [ms]; jumps.

    `source` is `exchange`, or `arrival` for a client without clock exchange.
    """

    offset_ms: float | None
    drift_ppm: float | None
    round_trip_ms: float | None
    error_ms: float | None
    source: Literal["exchange", "arrival"]
    jumps: int


class CameraStatus(Struct):
    """A camera of the live stage: its client, its figures, and the limit of its rate.

    `fps`, `latency_ms`, `jitter_ms`, `loss_percent` and `confidence` are of the last two seconds; `frames` to
    `errors` are counts since the start. The client's own figures are None until it has sent them. `shift_mm` is the
    distance of its joints from the other cameras', `apart_mm` the same over the last second if that is too large.
    """

    device: str
    joint_set: str
    connected: bool
    reference: bool
    local: bool
    machine: str
    usb_controller: str
    calibrated: bool
    state: Literal["live", "trouble", "silent", "gone"]
    limited_by: str
    reason: str
    fps: float
    latency_ms: float | None
    jitter_ms: float | None
    loss_percent: float | None
    confidence: float | None
    clock: ClockStatus
    frames: int
    skipped: int
    late: int
    errors: int
    processor_percent: int | None
    sending_percent: int | None
    dropped_by_client: int | None
    kept_by_client: int | None
    not_kept_by_client: int | None
    unknown_by_client: int | None
    message: str
    previews: int = 0
    shift_mm: float | None = None
    apart_mm: float | None = None


class PipelineStatus(Struct):
    """The live pipeline: output frames a second [Hz], time of a step [ms], counts, errors.

    `not_followed_mm` is by joint, the furthest first; `clock_offset_ns` converts stage time to server time.
    """

    rate_hz: float
    step_ms_median: float | None
    step_ms_p99: float | None
    steps: int
    left_out: int
    failures: int
    problem: str = ""
    preparing: bool = False
    not_followed_mm: dict[str, int] = {}
    clock_offset_ns: int | None = None


class RecordingStatus(Struct):
    """The take being recorded: its length [s], camera frames, missing frames by camera; and free space of the
    disk."""

    active: bool
    session: str | None
    take: str | None
    seconds: float
    frames: int
    late_frames: int
    missing_frames: dict[str, int]
    restarts: tuple[Restart, ...]
    notice: str
    problem: str
    disk_free_gb: float
    minutes_left: float


class CameraVerdict(Struct):
    """Quality of a camera's calibration: residuals [mm], and the share of the walked volume that it saw, 0..1."""

    verdict: str
    reasons: tuple[str, ...]
    residual_median_mm: float | None
    residual_p95_mm: float | None
    coverage: float | None


class CoverageStatus(Struct):
    """One camera's coverage of a walk: points of a median joint, floor, and whether it is enough.

    `cells`: half metres to the right of and away from the camera, with the number of the hips' visits.
    """

    points: int
    cells: list[tuple[int, int, int]]
    enough: bool


class EstimateStatus(Struct):
    """Agreement of a camera with the reference so far: residuals [mm], None with too few common joints.

    Of cameras without depth they are the distances from the joints that all find together, also in pixels.
    """

    residual_median_mm: float | None
    residual_p95_mm: float | None
    residual_median_px: float | None = None


class AttemptStatus(Struct):
    """The last calibration begun: progress 0..1, length of the gathering [s], frames by camera."""

    state: Progress
    message: str
    progress: float
    seconds: float
    frames: dict[str, int]
    coverage: dict[str, CoverageStatus]
    estimates: dict[str, EstimateStatus]
    number: int | None
    cameras: dict[str, CameraVerdict]


class TPose(Struct):
    """The last requested T-pose.

    `name` is the performer's, empty if it is measured for the stage only; `seconds_left` of the countdown or of
    the hold [s]; `problems` lists faults of the pose, in words for the performer; `height_m` as measured [m].
    """

    state: TPoseState = "idle"
    name: str = ""
    seconds_left: float = 0.0
    problems: list[str] = []
    message: str = ""
    height_m: float | None = None


class CalibrationStatus(Struct):
    """The calibration in use, `provisional` if it has one camera only: its age [s], the performer's height [m].

    `attempt` is the last calibration begun, `tpose` the last requested T-pose.
    """

    state: Literal["none", "provisional", "good"]
    message: str
    number: int | None
    borrowed: bool
    age_s: float | None
    warnings: list[str]
    reference: str | None
    height_m: float | None
    cameras: dict[str, CameraVerdict]
    attempt: AttemptStatus
    tpose: TPose


class PerformerStatus(Struct):
    """Somebody on a stage of several: a performer, or a stranger, who has no `number`, no `name` and no poses.

    `number` counts from 1 in the order in which they came in; `name` is `performer_1` and so on until they are named.
    `state`: `here`, `away` (no camera sees them) or `undecided` (they cannot be told apart from another now); of
    strangers `measuring` (they hold a T-pose) or `stranger`. `height_m` as measured [m]; `profile`: there is a stored
    profile of that name. `message` says what is wrong, or what a stranger has to do.
    """

    number: int | None
    name: str
    state: PerformerState
    height_m: float | None = None
    profile: bool = False
    message: str = ""


class SettingsStatus(Struct):
    """The settings in use: the preset, None if they are none of the program's, and the output rate [Hz]."""

    preset: str | None
    output_hz: int


class RefusedLinks(Struct, frozen=True):
    """Refused camera links: their number, and the reason of the last one."""

    count: int = 0
    last: str = ""


class StageStatus(Struct):
    """The status of the live stage, cameras by name; `performers` is empty while cameras show one body.

    `performer_warnings` say what may be lost on a stage of several. `timecode` and `bodies` are what is received.
    """

    cameras: dict[str, CameraStatus]
    pipeline: PipelineStatus
    recording: RecordingStatus
    calibration: CalibrationStatus
    settings: SettingsStatus
    refused_links: RefusedLinks = RefusedLinks()
    performers: list[PerformerStatus] = []
    performer_warnings: list[str] = []
    timecode: TimecodeStatus = TimecodeStatus()
    bodies: RigidStatus = RigidStatus()


class RecordStarted(Struct):
    """The take that is being recorded."""

    session: str
    take: str


class RecordStopped(RecordStarted):
    """A recorded take: its length [s], camera frames, and frames of the live solve (0 = there is none).

    `problem` says why the recording is incomplete, else it is empty.
    """

    seconds: float
    frames: int
    poses: int
    problem: str
