"""A stage for tests of the view: a performer who steps aside, seen by two calibrated cameras."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from fastapi import FastAPI

from studio.engine.base.geometry import make_transform
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import FrameSet, FusedSkeleton, StepResult
from studio.engine.model.joints import JOINT_COUNT, OUTPUT_OF_CANONICAL_INDEX
from studio.live.cameras.links import Links
from studio.live.cameras.previews import Previews
from studio.live.states import PerformerStatus
from studio.server.listening import open_socket
from studio.server.run import make_server
from studio.take.folder.take import Take
from tests.review.render.figures import t_pose

CAMERAS = ("left", "right")


def step(shift_m: float = 0.0, *, seen: bool = True) -> StepResult:
    """A step of the pipeline: the T-pose moved along x; `seen`: whether cameras see it."""
    positions, wxyz = t_pose()
    positions = positions + np.array([shift_m, 0.0, 0.0])
    canonical = positions[OUTPUT_OF_CANONICAL_INDEX]
    raw = np.stack([canonical + 0.02, canonical - 0.02])
    raw[0, 10] = np.nan
    if not seen:
        raw[:] = np.nan
    cameras = len(CAMERAS)
    return StepResult(
        frame_set=FrameSet(
            0, CAMERAS, raw, np.full((cameras, JOINT_COUNT), 0.9), np.zeros((cameras, 3))
        ),
        fused=FusedSkeleton(
            canonical, np.linspace(0, 1, JOINT_COUNT), np.full(JOINT_COUNT, 0.01),
            np.ones((cameras, JOINT_COUNT), dtype=bool),
        ),
        positions_m=positions,
        rotations_wxyz=wxyz,
        confidence=np.ones(52),
        uncertainty_mm=np.full(52, np.nan),
    )  # fmt: skip


def calibration() -> Calibration:
    """Two cameras 3 m in front of the stage's origin, looking at it."""
    looking_north = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    cameras = {
        name: CameraCalibration(make_transform(looking_north, np.array([x, -3.0, 1.0])))
        for name, x in zip(CAMERAS, (-1.0, 1.0), strict=True)
    }
    return Calibration(CAMERAS[0], cameras)


class FakeStage:
    """A stage that shows what a test gives it."""

    def __init__(self) -> None:
        self.callbacks: list[Callable[[StepResult], None]] = []
        self.clock_ns = time.monotonic_ns
        self.previews = Previews(Links(), self.clock_ns)
        self._calibration = calibration()
        self.performers: list[PerformerStatus] = []

    def subscribe(self, callback: Callable[[StepResult], None], *, raw: bool = False) -> Callable[[], None]:
        self.callbacks.append(callback)
        return lambda: self.callbacks.remove(callback)

    def calibration(self) -> Calibration:
        return self._calibration

    def status(self) -> SimpleNamespace:
        pipeline = SimpleNamespace(clock_offset_ns=self.clock_ns())
        return SimpleNamespace(cameras=dict.fromkeys(CAMERAS), pipeline=pipeline, performers=self.performers)

    @contextmanager
    def performing(self, steps: Callable[[float], StepResult] = step) -> Iterator[None]:
        """Somebody is on stage, at 60 Hz, while the block runs: `steps`, each moved along x [m]."""
        stop = threading.Event()

        def perform() -> None:
            n = 0
            while not stop.wait(1 / 60):
                n += 1
                for callback in self.callbacks:
                    callback(steps(0.2 * np.sin(n / 20)))

        thread = threading.Thread(target=perform)
        thread.start()
        try:
            yield
        finally:
            stop.set()
            thread.join()


def until(condition: Callable[[], bool], timeout_s: float = 60.0) -> None:
    """Wait until the condition holds; fail when it does not in time."""
    end_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end_s, "it did not happen in time"
        time.sleep(0.02)


@contextmanager
def serving(app: FastAPI, port: int = 0) -> Iterator[str]:
    """Serve the app on a loopback port (0: a free one) while the block runs; yields its address."""
    listening = open_socket("127.0.0.1", port)
    server = make_server(app)
    thread = threading.Thread(target=server.run, args=([listening],))
    thread.start()
    try:
        until(lambda: server.started)
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()
        listening.close()


class FolderOfTakes:
    """Finds the takes of a folder, as the API's finder does."""

    def __init__(self, sessions: Path) -> None:
        self._sessions = sessions

    def take(self, session: str, name: str) -> Take:
        return Take.open(self._sessions / session / name)

    def solve(self, take: Take, name: str) -> Path:
        return take.solve_folder(name) / "poses.npz"
