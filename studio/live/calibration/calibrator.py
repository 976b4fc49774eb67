"""Calibration of the live stage: frames are gathered for some seconds, then a separate process computes."""

import logging
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from studio.engine.base.errors import CalibrationError, StudioError
from studio.engine.base.sentences import say
from studio.engine.calibration.calibrate import calibrate, with_performer
from studio.engine.calibration.estimate import estimate_residuals
from studio.engine.calibration.performer.depth_floor import seen_floors
from studio.engine.calibration.quality.residuals import Residuals
from studio.engine.calibration.views.estimate import can_estimate
from studio.engine.calibration.views.pictures import sees_no_depth
from studio.engine.calibration.views.seen.known_lens import KnownLenses
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.live.calibration.coverage import Coverage
from studio.live.calibration.kept import KeptCalibration, save_calibration
from studio.live.cameras.previews import FloorViews
from studio.live.states import AttemptStatus, CameraVerdict, EstimateStatus, Progress
from studio.worker import run_in_process

_log = logging.getLogger(__name__)

ESTIMATE_NS = 2_000_000_000
"""Interval of the estimates of the cameras' agreement during gathering."""

RETRY_NS = 2_000_000_000
"""Interval of the provisional calibrations of one camera."""

PROVISIONAL_FRAMES = 30
"""Frames of one camera, about a second, that suffice for a provisional calibration."""

Frames = dict[str, list[CameraFrame]]


@dataclass
class Attempt:
    """The last calibration begun, for the status; `state`: idle, gathering, computing, done or failed."""

    state: Progress = "idle"
    message: str = ""
    seconds: float = 0.0
    began_ns: int = 0
    frames: dict[str, int] = field(default_factory=dict)
    coverage: dict[str, Coverage] = field(default_factory=dict)
    estimates: dict[str, Residuals] = field(default_factory=dict)
    result: Calibration | None = None
    kept: KeptCalibration | None = None


@dataclass(frozen=True)
class Outcome:
    """A computed calibration; None if nothing could be computed, then `problem` says why.

    `kept`: as stored on disk, if it is good.
    """

    calibration: Calibration | None
    kept: KeptCalibration | None
    problem: str
    provisional: bool


class Calibrator:
    """Runs one calibration at a time; `start`, `add` and `update` belong to the engine thread.

    A worker thread calls `report` with the outcome; `report` must pass it to the engine thread. `floor_views`
    returns small depth images that arrived since a time on the server's clock [ns].
    """

    def __init__(
        self,
        folder: Path,
        report: Callable[[Outcome], None],
        floor_views: Callable[[int], FloorViews] = lambda since_ns: {},
    ) -> None:
        self.attempt = Attempt()
        self._floor_views = floor_views
        self._folder = folder
        self._report = report
        self._frames: Frames = {}
        self._serials: dict[str, str] = {}
        self._height_m: float | None = None
        self._lenses = KnownLenses()
        self._busy = False
        self._estimated_ns = 0
        self._tried_ns: int | None = None
        self._estimating: threading.Thread | None = None

    @property
    def computing(self) -> bool:
        """Whether a calibration, also a provisional one, is being computed."""
        return self._busy

    @property
    def estimating(self) -> bool:
        """Whether the cameras' agreement is being estimated."""
        return self._estimating is not None and self._estimating.is_alive()

    def start(
        self,
        seconds: float,
        now_ns: int,
        serials: dict[str, str],
        height_m: float | None = None,
        lenses: KnownLenses | None = None,
    ) -> None:
        """Start to gather frames of cameras with these serial numbers.

        `height_m`: the performer's, where it was measured before; a height that disagrees is refused. `lenses`: those
        known of cameras without depth.

        Raises:
            CalibrationError: one is under way.
        """
        if self.attempt.state in ("gathering", "computing"):
            raise CalibrationError(
                "calibration.under_way", "a calibration is under way; wait until it is done"
            )
        self._frames, self._serials, self._height_m = {}, serials, height_m
        self._lenses = lenses or KnownLenses()
        self.attempt = Attempt(
            "gathering",
            say("calibration.hold_tpose", "hold the T-pose for 3 s, then walk about"),
            seconds,
            now_ns,
        )

    def finish_gathering(self) -> None:
        """Compute with the frames gathered so far.

        Raises:
            CalibrationError: nothing is being gathered.
        """
        if self.attempt.state != "gathering":
            raise CalibrationError(
                "calibration.none_gathered", "no calibration is being gathered; start one first"
            )
        self.attempt.seconds = 0.0

    def add(self, frame: CameraFrame) -> None:
        """Add a frame while frames are being gathered."""
        if self.attempt.state == "gathering":
            self._frames.setdefault(frame.camera, []).append(frame)
            self.attempt.frames[frame.camera] = self.attempt.frames.get(frame.camera, 0) + 1
            self.attempt.coverage.setdefault(frame.camera, Coverage()).add(frame)

    def update(self, now_ns: int, reference: str | None, place: Callable[[CameraFrame], CameraFrame]) -> None:
        """Compute once the time is over; `place` converts a frame to the stage clock by its exchanges."""
        attempt = self.attempt
        if attempt.state != "gathering":
            return
        if now_ns - attempt.began_ns < attempt.seconds * 1e9 or self._busy:
            if reference is not None and now_ns - max(self._estimated_ns, attempt.began_ns) > ESTIMATE_NS:
                self._estimated_ns = now_ns
                self._estimate(attempt, reference, place)
            return
        if reference is None or reference not in self._frames:
            attempt.state = "failed"
            attempt.message = say(
                "calibration.reference_silent",
                "the reference camera {name} sent no frames; connect it and calibrate again",
                name=reference or "",
            )
            return
        frames = {
            name: sorted((place(frame) for frame in frames), key=lambda frame: frame.device_time_ns)
            for name, frames in self._frames.items()
        }
        self._frames = {}
        attempt.state, attempt.message = (
            "computing",
            say("calibration.computing", "computing the calibration"),
        )
        self._begin(frames, reference, provisional=False)

    def _estimate(
        self, attempt: Attempt, reference: str, place: Callable[[CameraFrame], CameraFrame]
    ) -> None:
        """Start a thread that estimates the cameras' agreement so far, unless one is running."""
        if self.estimating:
            return
        frames = {name: list(mine) for name, mine in self._frames.items()}
        starts_ns = {name: place(mine[0]).device_time_ns for name, mine in frames.items()}

        def estimate() -> None:
            if can_estimate(frames):
                self._estimate_views(attempt, frames, starts_ns, reference)
            elif reference in frames and not sees_no_depth(frames[reference][-1:]):
                attempt.estimates = estimate_residuals(frames, starts_ns, reference)

        self._estimating = threading.Thread(target=estimate, name="calibration estimate", daemon=True)
        self._estimating.start()

    def _estimate_views(
        self, attempt: Attempt, frames: Frames, starts_ns: dict[str, int], reference: str
    ) -> None:
        """Adjust cameras without depth by what they have seen so far, in a process of low priority."""
        try:
            attempt.estimates = run_in_process(
                "studio.engine.calibration.views.estimate:estimate_views",
                frames,
                starts_ns,
                reference,
                self._height_m,
                on_progress=lambda share: None,
                should_stop=lambda: attempt.state != "gathering" or attempt is not self.attempt,
                spare=False,
            )
        except StudioError as error:
            _log.info("no estimate of the cameras' agreement: %s", error.sentence)

    def start_provisional(self, recent: Iterable[Sequence[CameraFrame]], now_ns: int) -> None:
        """Calibrate one camera alone, so that the view has something to draw: the first with enough frames, at
        intervals."""
        if self._tried_ns is not None and now_ns - self._tried_ns < RETRY_NS:
            return
        for frames in recent:
            if len(frames) >= PROVISIONAL_FRAMES:
                self._tried_ns = now_ns
                self._begin({frames[0].camera: list(frames)}, frames[0].camera, provisional=True)
                return

    def _begin(self, frames: Frames, reference: str, *, provisional: bool) -> None:
        self._busy = True
        threading.Thread(
            target=self._compute, args=(frames, reference, provisional), name="calibration", daemon=True
        ).start()

    def _compute(self, frames: Frames, reference: str, provisional: bool) -> None:
        calibration, kept, problem = None, None, ""
        try:
            if provisional:
                calibration = calibrate_stage(frames, reference)
            else:
                views = self._floor_views(self.attempt.began_ns)
                calibration = run_in_process(
                    "studio.live.calibration.calibrator:calibrate_stage",
                    frames,
                    reference,
                    self._height_m,
                    views,
                    self._lenses,
                )
                if not calibration.refused:
                    serials = {name: self._serials.get(name, "") for name in calibration.cameras}
                    kept = save_calibration(self._folder, calibration, serials)
        except StudioError as error:
            problem = error.sentence
        except Exception as error:  # the boundary of the thread
            _log.exception("calibration failed")
            problem = say(
                "calibration.failed", "calibration failed: {error!r}; see the server's log", error=error
            )
        self._report(Outcome(calibration, kept, problem, provisional))

    def finish(self, outcome: Outcome) -> bool:
        """Handle an outcome on the engine thread; return whether its calibration is to be used."""
        self._busy = False
        calibration = outcome.calibration
        if outcome.provisional:
            return calibration is not None and calibration.performer is not None
        good = outcome.kept is not None
        message = say("calibration.calibrated", "calibrated")
        if not good:
            reasons = outcome.problem or ([] if calibration is None else calibration.reasons())
            message = say(
                "calibration.refused", "refused, what was in use before stays: {reasons}", reasons=reasons
            )
        self.attempt = replace(
            self.attempt,
            state="done" if good else "failed",
            message=message,
            result=calibration,
            kept=outcome.kept,
        )
        return good

    def status(self, now_ns: int) -> AttemptStatus:
        """Return the state of the last attempt."""
        attempt = self.attempt
        share = {"idle": 0.0, "gathering": 0.0, "computing": 0.9, "done": 1.0, "failed": 1.0}[attempt.state]
        if attempt.state == "gathering":
            share = 0.9 * min(1.0, (now_ns - attempt.began_ns) * 1e-9 / max(attempt.seconds, 1e-3))
        return AttemptStatus(
            state=attempt.state,
            message=attempt.message,
            progress=round(share, 3),
            seconds=attempt.seconds,
            frames=dict(attempt.frames),
            coverage={name: coverage.status() for name, coverage in sorted(attempt.coverage.items())},
            estimates={
                name: EstimateStatus(
                    _mm(one.median_m),
                    _mm(one.p95_m),
                    None if one.median_px is None else round(one.median_px, 1),
                )
                for name, one in sorted(attempt.estimates.items())
            },
            number=None if attempt.kept is None else attempt.kept.number,
            cameras={} if attempt.result is None else camera_verdicts(attempt.result),
        )


def _mm(metres: float | None) -> float | None:
    return None if metres is None else round(metres * 1e3, 1)


def calibrate_stage(
    frames: Frames,
    reference: str,
    height_m: float | None = None,
    views: FloorViews | None = None,
    lenses: KnownLenses | None = None,
) -> Calibration:
    """Return the calibration of these frames with a performer; runs in a worker process.

    Depth images in `views` that show the floor define it.
    """
    floors = seen_floors(views) if views else {}
    known = lenses or KnownLenses()
    mine = {name: lens for name, lens in known.lenses.items() if name in frames}
    calibration = calibrate(
        frames,
        reference=reference,
        height_m=height_m,
        floors=floors,
        must_hold="at_end",
        lenses=mine,
        same_lens=known.same,
    )
    if calibration.performer is not None or (calibration.refused and len(frames) > 1):
        return calibration
    return with_performer(calibration, frames)


def camera_verdicts(calibration: Calibration) -> dict[str, CameraVerdict]:
    """Return verdict, reasons and residuals by camera."""
    return {
        name: CameraVerdict(
            camera.verdict,
            camera.reasons,
            camera.residual_median_mm,
            camera.residual_p95_mm,
            camera.coverage,
        )
        for name, camera in calibration.cameras.items()
    }
