"""Several performers on the live stage: who holds a T-pose is followed, recorded and told from then on."""

import numpy as np
import pytest

from studio import wire
from studio.engine.base.errors import TakeError
from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.identity.recognised import FIRST
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.poses import Poses
from studio.engine.model.settings import preset
from studio.live import LiveStage
from studio.offline.replay import solve_take
from studio.take.folder.take import POSES, Take
from tests.api.camera import wait_until
from tests.live.performer import camera_transform, hello, joints_m, offsets_m, save_stage_calibration
from tests.refused import refused

CAMERAS = ["camera_0", "camera_1"]
SMALLER = 0.85
ARMS_OUT_S = 1.785
"""When the waving arms of `joints_m` are level."""

APART_M = np.array([1.6, 0.0, 0.0])


class Clock:
    """A clock that the test moves on."""

    ns = 1_000_000_000

    def __call__(self) -> int:
        return self.ns


class Shoot:
    """A stage whose cameras see the first performer, and a smaller second one beside while `second` is given."""

    def __init__(self, folder) -> None:
        save_stage_calibration(folder, CAMERAS)
        self.clock = Clock()
        self.stage = LiveStage(folder, clock_ns=self.clock)
        self.stage.start()
        self.links = [self.stage.join(hello(name)) for name in CAMERAS]
        self.sequence = 0

    def see(self, first_s: float | None, second_s: float | None = None) -> None:
        """Move on by one frame of all cameras: each performer at their time of `joints_m`, None = not there."""
        self.sequence += 1
        self.clock.ns += 33_333_333
        for index, link in enumerate(self.links):
            rng = np.random.default_rng([index, self.sequence])
            bodies = []
            for number, at_s in enumerate((first_s, second_s)):
                if at_s is None:
                    continue
                joints = joints_m(at_s) * (SMALLER if number else 1.0) + number * APART_M
                seen = transform_points(invert_transform(camera_transform(index)), joints)
                seen += rng.normal(0.0, 0.004, seen.shape)
                confidence = np.full(JOINT_COUNT, 0.9)
                number_of_body = 7 * self.sequence + number  # of no use
                bodies.append(
                    wire.skeleton_frame(self.sequence, self.clock.ns, seen, confidence, body=number_of_body)
                )
            message = wire.with_others(bodies[0], bodies[1:])
            self.stage.frame(link, message, wire.encode(message), self.clock.ns)
        self.stage._engine.call(lambda: None)

    def performers(self) -> list[tuple[str, bool]]:
        self.stage._engine.call(lambda: None)
        return [(one.name, one.here) for one in self.stage.status().performers]

    def play(self, seconds: float, *, second: bool = True, pose_s: float | None = None) -> None:
        """Let the performers wave, or hold a pose."""
        for _ in range(round(30 * seconds)):
            now_s = self.sequence / 30
            first, other = (now_s, now_s + 0.5) if pose_s is None else (pose_s, pose_s)
            self.see(first, other if second else None)


@pytest.fixture
def shoot(tmp_path):
    shoot = Shoot(tmp_path / "sessions")
    yield shoot
    shoot.stage.close()


def a_second_performer(shoot) -> None:
    """The first performer alone, then a second one who holds a T-pose until measured."""
    shoot.play(1.0, second=False)
    assert shoot.performers() == []
    shoot.play(0.5)
    assert shoot.performers() == [("performer_1", True), ("", True)]
    assert "T-pose" in shoot.stage.status().performers[1].message
    shoot.play(2.0, pose_s=ARMS_OUT_S)
    wait_until(
        lambda: (shoot.see(ARMS_OUT_S, ARMS_OUT_S), len(shoot.stage.results.get()[1].others) == 1)[1],
        "the second one was measured",
    )


def test_who_holds_a_t_pose_becomes_a_performer(shoot):
    a_second_performer(shoot)
    first, second = shoot.stage.status().performers
    assert (first.name, second.name) == ("performer_1", "performer_2")
    assert second.height_m < 0.92 * first.height_m
    shoot.play(1.0)
    _, result = shoot.stage.results.get()
    assert [one.performer for one in result.each()] == [1, 2]
    hips = [one.positions_m[0] for one in result.each()]
    np.testing.assert_allclose(hips[1][:2] - hips[0][:2], APART_M[:2], atol=0.05)


def test_a_recording_has_both_and_repeats_to_the_last_bit(shoot):
    a_second_performer(shoot)
    shoot.play(0.5)
    started = shoot.stage.start_recording("day", "both")
    shoot.play(2.0)
    shoot.stage.stop_recording()
    take = Take.open(shoot.stage.sessions / started.session / started.take)
    assert take.performer_names("live") == ["performer_1", "performer_2"]
    solve_take(take, preset("studio"), name="again", as_live=True)
    for name in take.performer_names("live"):
        live, again = (Poses.load(take.performer_folder(solve, name) / POSES) for solve in ("live", "again"))
        assert live.frame_count > 100
        np.testing.assert_array_equal(live.positions_m, again.positions_m)
        np.testing.assert_array_equal(live.rotations_wxyz, again.rotations_wxyz)
    assert not list(take.path.glob("*.poses"))


def test_performers_who_leave_come_back_as_themselves(shoot):
    a_second_performer(shoot)
    shoot.play(0.5)
    shoot.play(3.0, second=False)
    assert shoot.performers() == [("performer_1", True), ("performer_2", False)]
    shoot.play(2.0)
    assert shoot.performers() == [("performer_1", True), ("performer_2", True)]


def test_forgotten_performers_are_strangers_again(shoot):
    a_second_performer(shoot)
    shoot.stage.start_recording("day", "both")
    with refused(TakeError, "recording.performers_fixed"):
        shoot.stage.forget_performers()
    shoot.stage.stop_recording()
    shoot.stage.forget_performers()
    shoot.play(1.0)
    assert shoot.performers() == [("performer_1", True), ("", True)]


def test_a_ghost_of_a_device_changes_nothing(shoot):
    """Bodies that split in two for some frames, and nobody else: the first performer goes on alone."""
    shoot.play(1.0, second=False)
    shoot.see(1.0, 1.0)
    shoot.play(3.0, second=False)
    assert shoot.performers() == []
    _, result = shoot.stage.results.get()
    assert result.performer == FIRST and not result.others
    assert np.linalg.norm(result.positions_m[0] - offsets_m()[0]) < 0.05
