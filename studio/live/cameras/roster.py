"""The cameras of the live stage and their clocks: which are present, and whose clock is the stage clock."""

from dataclasses import replace

from studio.engine.base.errors import SettingsError
from studio.engine.base.sentences import say
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.live.cameras.camera import LiveCamera
from studio.live.cameras.clocks import Anchor, StageClock
from studio.wire import ClockSample, Hello

CLOCK_STEP_NS = 100_000
"""Largest error of a camera's clock model before it is replaced."""

MAX_CAMERAS = 64
"""Beyond this number, cameras that have left are forgotten."""

FUTURE_NS = 1_000_000_000
PAST_NS = 5_000_000_000
"""A frame whose stage time is further from the present is not used."""


class Roster:
    """The cameras since the start; times are on the server's clock unless stated otherwise.

    Attributes:
        cameras: by name.
        clock: the stage clock.
        chosen: the reference camera chosen by the operator.
        restored: the stage clock is from before a restart of the server, which is more accurate than arrivals.
    """

    def __init__(self) -> None:
        self.cameras: dict[str, LiveCamera] = {}
        self.clock = StageClock()
        self.chosen: str | None = None
        self.restored = False

    @property
    def reference(self) -> str | None:
        """The camera whose clock is the stage clock."""
        return None if self.clock.anchor is None else self.clock.anchor.camera

    def connected(self) -> list[LiveCamera]:
        return [camera for camera in self.cameras.values() if camera.connected]

    def join(self, hello: Hello, *, keep_clock: bool, local: bool = False) -> bool:
        """Add a camera; return whether the stage clock changes.

        The first camera's clock is the stage clock. A camera that joins an empty stage becomes the reference. So does
        one on the server's own machine (`local`) if the reference is not local, unless the operator chose the
        reference. With `keep_clock` the stage clock does not change.
        """
        alone = not self.connected()
        camera = self.cameras.get(hello.name)
        if camera is None:
            self._forget()
            camera = self.cameras[hello.name] = LiveCamera(hello, local=local)
        else:
            camera.rejoin(hello, local=local)
        if self.clock.anchor is None:
            return self._anchor(camera)
        if keep_clock:
            return False
        if self.chosen is not None:
            return hello.name == self.chosen and self._anchor(camera)
        reference = self.cameras.get(self.clock.anchor.camera)
        nearer = local and reference is not None and not reference.local
        return (alone or nearer) and self._anchor(camera)

    def restore(self, anchor: Anchor, server_to_stage: ClockModel) -> None:
        """Restore the stage clock from before a restart of the server."""
        self.clock.restore(anchor, server_to_stage)
        self.restored = True

    def choose(self, name: str) -> bool:
        """Make a camera the reference for good; return whether the stage clock changes.

        Raises:
            SettingsError: no such camera is connected.
        """
        if name not in [camera.name for camera in self.connected()]:
            names = ", ".join(camera.name for camera in self.connected()) or "none"
            raise SettingsError(
                "camera.none", "no camera {name!r} is connected; connected: {names}", name=name, names=names
            )
        self.chosen = name
        return self._anchor(self.cameras[name])

    def _anchor(self, camera: LiveCamera) -> bool:
        if self.clock.is_anchor(camera.name, camera.clock_id):
            return False
        self.clock.set_anchor(camera.name, camera.clock_id)
        for each in self.cameras.values():
            each.clock = None
        if camera.estimator.model is not None:
            self._follow(camera)
        return True

    def _forget(self) -> None:
        """Forget a camera that has left if there are too many, because a client may join under any number of
        names."""
        gone = [name for name, camera in self.cameras.items() if not camera.connected]
        if len(self.cameras) >= MAX_CAMERAS and gone:
            del self.cameras[gone[0]]

    def arrived(self, frame: CameraFrame, arrival_ns: int) -> list[LiveCamera]:
        """Count a frame; return the cameras whose clock it changed.

        After a jump of the camera's clock, its `clock_id` has changed.
        """
        camera = self.cameras[frame.camera]
        camera.saw(frame, arrival_ns)
        if not camera.estimator.exchanged:
            segment = camera.estimator.segment
            camera.estimator.add_arrival(frame.device_time_ns, arrival_ns)
            if camera.estimator.segment != segment:
                camera.clock_lost()
            return self._follow(camera)
        return self._moved([camera]) if camera.clock is None else []

    def measured(self, name: str, sample: ClockSample) -> list[LiveCamera]:
        """Add a clock exchange; return the cameras whose clock it changed.

        After a jump of the camera's clock, its `clock_id` has changed.
        """
        camera = self.cameras[name]
        segment = camera.estimator.segment
        possible = camera.estimator.add_exchange(
            sample.client_send_ns, sample.server_receive_ns, sample.server_send_ns, sample.client_receive_ns
        )
        if camera.estimator.segment != segment:
            camera.clock_lost()
        return self._follow(camera) if possible else []

    def set_corrections(self, corrections_ns: dict[str, int]) -> None:
        """Use other latency corrections from now on."""
        self.clock.set_corrections(corrections_ns)
        for camera in self.cameras.values():
            if self.clock.is_anchor(camera.name, camera.clock_id) and camera.estimator.model is not None:
                self.clock.follow(camera.estimator.model)
        self._moved(list(self.cameras.values()))

    def _follow(self, camera: LiveCamera) -> list[LiveCamera]:
        """Update the clocks after a change of one; the reference camera's changes all, by exchanges once there is a
        stage clock."""
        if not self.clock.is_anchor(camera.name, camera.clock_id):
            return self._moved([camera])
        if not camera.estimator.exchanged and self.clock.server_to_stage is not None and self.restored:
            return self._moved([camera])
        assert camera.estimator.model is not None
        self.clock.follow(camera.estimator.model)
        return self._moved(self.connected())

    def _moved(self, cameras: list[LiveCamera]) -> list[LiveCamera]:
        """Update the clocks of these cameras; return those that changed by more than a step."""
        changed = []
        for camera in cameras:
            model = camera.estimator.model
            if model is None:
                continue
            clock = self.clock.camera_to_stage(camera.name, camera.clock_id, model)
            at, old = model.reference_ns, camera.clock
            if clock is None:
                continue
            if old is None or abs(old.stage_ns(at) - clock.stage_ns(at)) > CLOCK_STEP_NS:
                camera.clock = clock
                changed.append(camera)
        return changed

    def is_present(self, frame: CameraFrame, now_ns: int) -> bool:
        """Whether the frame's time is near the present; if not, the camera's status says so."""
        camera = self.cameras[frame.camera]
        now = self.clock.server_to_stage_ns(now_ns)
        if now is None or camera.clock is None:
            return False
        ahead_ns = camera.clock.stage_ns(frame.device_time_ns) - now
        present = -PAST_NS <= ahead_ns <= FUTURE_NS
        camera.reason = (
            ""
            if present
            else say(
                "camera.off_time",
                "its frames are {seconds:+.1f} s off the present: check its clock",
                seconds=ahead_ns * 1e-09,
            )
        )
        return present

    def newest_stage_ns(self, names: tuple[str, ...]) -> dict[str, int]:
        """Stage time of the newest frame of each connected camera among `names`."""
        return {
            camera.name: camera.clock.stage_ns(camera.newest_device_ns)
            for camera in self.connected()
            if camera.name in names and camera.clock is not None and camera.newest_device_ns is not None
        }

    def clock_of(self, name: str) -> ClockModel:
        """The clock model of a camera's frames; where unknown, the last one, else the identity."""
        camera = self.cameras.get(name)
        return (None if camera is None else camera.clock or camera.last_clock) or ClockModel()

    def by_exchange(self, frame: CameraFrame) -> CameraFrame:
        """The frame with its time on the stage clock by exchanges alone, without latency corrections."""
        stage_ns = self.clock_of(frame.camera).stage_ns(frame.device_time_ns)
        return replace(frame, device_time_ns=stage_ns - self.clock.correction_ns(frame.camera))
