"""A recording of two people before the live stage, frame by frame in the order in which its cameras send them.

As an operator would: the stage is calibrated with the first one's walk, the second one comes in and both hold a
T-pose, then a take is recorded. The server's clock moves with the frames, so that a run is the same on any machine.

`python -m tests.live.recorded_shoot` prints the figures of all recordings: switches, missed and undecided frames.
"""

import argparse
import heapq
import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any

from studio import wire
from studio.__main__ import main as studio
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import ClockModel
from studio.live import LiveStage
from studio.live.calibration.kept import save_calibration
from studio.live.cameras.links import CameraLink
from studio.live.warmup import warm_up
from studio.offline.tracking import calibrate_take
from studio.take.folder.take import Take
from studio.take.importers import import_recording
from studio.take.raw.frames import read_raw
from studio.take.raw.records import RawCamera, RawFrame

RECORDINGS = ("jump_punches_2_cameras", "punches_jacks_3_cameras", "ballet_punches_4_cameras")
BEGIN_NS = 1_000_000_000_000
"""The server's time at which the stage clock is zero."""

LATENCY_NS = 30_000_000
EXCHANGE_NS = 500_000_000


class RecordedShoot:
    """A live stage and the cameras of a recording.

    Attributes:
        calibration: of the recording, by the first performer's walk.
        stage: calibrated with it.
    """

    def __init__(self, source: Path, folder: Path) -> None:
        self.take = import_recording(source, folder / "imported")
        self.calibration = calibrate_take(self.take)
        sessions = folder / "sessions"
        save_calibration(sessions / "calibrations", _without_clocks(self.calibration), devices=None)
        self._now_ns = BEGIN_NS
        warm_up()
        self.stage = LiveStage(sessions, clock_ns=lambda: self._now_ns)
        self.stage.start()
        self._links: dict[str, CameraLink] = {}
        self._exchanged_ns: dict[str, int] = {}
        self._frames = self._in_order_of_arrival()
        self._waiting: tuple[int, str, RawFrame] | None = None

    def close(self) -> None:
        """End the stage."""
        self.stage.close()

    def _in_order_of_arrival(self) -> Iterator[tuple[int, str, RawFrame]]:
        """Yield every frame with its arrival on the stage clock [ns], a little later than it was taken."""
        frames: dict[str, list[tuple[int, str, RawFrame]]] = {}
        for record in read_raw(self.take.raw_path):
            if isinstance(record, RawCamera):
                self._links[record.hello.name] = self.stage.join(record.hello)
            elif isinstance(record, RawFrame):
                clock = self.calibration.cameras[record.camera].clock
                arrival_ns = clock.stage_ns(record.frame.device_time_ns) + LATENCY_NS
                frames.setdefault(record.camera, []).append((arrival_ns, record.camera, record))
        return heapq.merge(*frames.values(), key=lambda one: one[:2])

    def play(self, until_s: float, from_s: float = 0.0) -> None:
        """Let the cameras send what they see up to a stage time [s]; what they saw before `from_s` is left out."""
        for arrival_ns, camera, record in self._frames:
            if arrival_ns * 1e-9 < from_s:
                continue
            self._now_ns = BEGIN_NS + arrival_ns
            self._exchange(camera, record.frame.device_time_ns)
            self.stage.frame(self._links[camera], record.message, wire.encode(record.message), self._now_ns)
            self.settle()
            if arrival_ns * 1e-9 > until_s:
                return

    def settle(self) -> None:
        """Wait until the engine has handled what was sent, and made the output frames of it."""
        for _ in range(2):
            self.stage._engine.call(lambda: None)

    def _exchange(self, camera: str, device_ns: int) -> None:
        """Compare the camera's clock with the server's, twice a second."""
        if self._now_ns - self._exchanged_ns.get(camera, -EXCHANGE_NS) < EXCHANGE_NS:
            return
        self._exchanged_ns[camera] = self._now_ns
        now_ns = device_ns + LATENCY_NS  # on the camera's clock
        sample = wire.ClockSample(now_ns, self._now_ns, self._now_ns, now_ns)
        self.stage.clock_sample(self._links[camera], sample)

    def measured(self) -> int:
        """Return how many performers are known; waits for a T-pose that is being computed."""
        strangers = self.stage._engine.strangers
        while any(one.computing for one in list(strangers._people.values())):
            self.settle()
        return max(len(self.stage.members()), 1)


def _without_clocks(calibration: Calibration) -> Calibration:
    """Return the calibration as a stage keeps it: exchanges tell the clocks, and devices have no latency."""
    cameras = {name: replace(one, clock=ClockModel()) for name, one in calibration.cameras.items()}
    return replace(calibration, cameras=cameras)


def record_both(source: Path, folder: Path) -> Take:
    """Return the take that the live stage records of a recording, from the end of the T-poses on."""
    told = json.loads((source / "truth" / "cameras.json").read_text())
    shoot = RecordedShoot(source, folder)
    try:
        shoot.play(told["perform_s"], from_s=told["calibration_s"])
        shoot.measured()
        started = shoot.stage.start_recording("day", "both")
        shoot.play(float("inf"))
        shoot.stage.stop_recording()
    finally:
        shoot.close()
    return Take.open(shoot.stage.sessions / started.session / started.take)


def figures(source: Path, folder: Path) -> tuple[Take, dict[str, Any]]:
    """Return the live take of a recording, and the figures of its live solve, as `studio evaluate` tells them."""
    take = record_both(source, folder)
    truth = {"performer_1": "a", "performer_2": "b"}
    references = [f"--reference={name}={source / 'truth' / of / 'joints.csv'}" for name, of in truth.items()]
    file = folder / "figures.json"
    with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
        assert studio(["evaluate", str(take.path), "--solve", "live", *references, "--json", str(file)]) == 0
    return take, json.loads(file.read_text())["solves"]["live"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", nargs="*", default=RECORDINGS)
    data = Path(os.environ["STUDIO_TEST_DATA"]) / "two_performers"
    for name in parser.parse_args().recording:
        with tempfile.TemporaryDirectory() as folder:
            _, found = figures(data / name, Path(folder))
        errors = ", ".join(f"{one['mpjpe_mm']:.1f}" for one in found["performers"].values())
        print(
            f"{name}: {errors} mm, {found['identity_switches']} switches, missed {found['missed_percent']:.2f} %, "
            f"undecided {found['undecided_percent']:.2f} %"
        )


if __name__ == "__main__":
    main()
