"""Several performers on the live stage: who holds a T-pose is solved, recorded and listed from then on."""

import sys

import numpy as np
import pytest

from studio import wire
from studio.engine.base.errors import CalibrationError, SettingsError, TakeError
from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.identity.recognised import FIRST
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings, preset
from studio.live import LiveStage
from studio.offline.replay import solve_take
from studio.take.folder.solves import read_metrics, undecided_spans
from studio.take.folder.take import POSES, Take
from tests.api.camera import wait_until
from tests.live.performer import camera_transform, hello, joints_m, offsets_m, save_stage_calibration
from tests.refused import refused

CAMERAS = ["camera_0", "camera_1"]
SMALLER = 0.85
ARMS_OUT_S = 1.785
"""When the waving arms of `joints_m` are level."""

APART_M = np.array([1.6, 0.0, 0.0])

ALIKE = 600
"""From this frame on, both wave alike; in other frames their arms distinguish them at once."""


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
        self.hidden_from: set[str] = set()
        self.ghost = False
        self.apart_m = APART_M

    def see(self, first_s: float | None, second_s: float | None = None) -> None:
        """Move on by one frame of all cameras: each performer at their time of `joints_m`, None = not there."""
        self.sequence += 1
        self.clock.ns += 33_333_333
        for index, link in enumerate(self.links):
            rng = np.random.default_rng([index, self.sequence])
            bodies, seen = [], np.zeros((JOINT_COUNT, 3))
            confidence = np.full(JOINT_COUNT, 0.9)
            for number, at_s in enumerate((first_s, second_s)):
                if at_s is None or (number and link.name in self.hidden_from):
                    continue
                joints = joints_m(at_s) * (SMALLER if number else 1.0) + number * self.apart_m
                seen = transform_points(invert_transform(camera_transform(index)), joints)
                seen += rng.normal(0.0, 0.004, seen.shape)
                number_of_body = 7 * self.sequence + number  # of no use
                bodies.append(
                    wire.skeleton_frame(self.sequence, self.clock.ns, seen, confidence, body=number_of_body)
                )
            if self.ghost:
                near = np.array([0.15, 0.0, 0.1])
                bodies.append(
                    wire.skeleton_frame(self.sequence, self.clock.ns, seen + near, confidence, body=1)
                )
            message = wire.with_others(bodies[0], bodies[1:])
            self.stage.frame(link, message, wire.encode(message), self.clock.ns)
        self.stage._engine.call(lambda: None)

    def performers(self) -> list[tuple[str, bool]]:
        self.stage._engine.call(lambda: None)
        return [(one.name, one.state not in ("away", "undecided")) for one in self.stage.status().performers]

    def play(
        self, seconds: float, *, first: bool = True, second: bool = True, pose_s: float | None = None
    ) -> None:
        """Let the performers wave, or hold a pose."""
        for _ in range(round(30 * seconds)):
            now_s = self.sequence / 30
            one, other = (now_s, now_s + 0.5) if pose_s is None else (pose_s, pose_s)
            self.see(one if first else None, other if second else None)


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


def test_who_holds_a_t_pose_becomes_a_performer_and_is_recorded_to_the_last_bit(shoot):
    a_second_performer(shoot)
    first, second = shoot.stage.status().performers
    assert (first.name, second.name) == ("performer_1", "performer_2")
    assert second.height_m < 0.92 * first.height_m
    shoot.play(1.0)
    _, result = shoot.stage.results.get()
    assert [one.performer for one in result.each()] == [1, 2]
    hips = [one.positions_m[0] for one in result.each()]
    np.testing.assert_allclose(hips[1][:2] - hips[0][:2], APART_M[:2], atol=0.05)
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


def test_bystanders_become_performers_without_a_t_pose_if_asked(shoot):
    shoot.stage.set_settings(parse_settings("studio", ["bystanders=performers"]))
    shoot.play(1.0, second=False)
    started = shoot.stage.start_recording("day", "both")
    shoot.play(2.0)
    assert [one.message.code for one in shoot.stage.status().performers[1:]] == ["performers.seen_soon"]
    shoot.play(1.5)
    wait_until(
        lambda: (shoot.play(0.04), shoot.performers() == [("performer_1", True), ("performer_2", True)])[1],
        "the second one was measured",
    )
    shoot.play(0.5)
    first, second = shoot.stage.status().performers
    assert second.height_m / first.height_m == pytest.approx(SMALLER, abs=0.03)
    shoot.stage.stop_recording()
    take = Take.open(shoot.stage.sessions / started.session / started.take)
    solve_take(take, preset("studio"), name="again", as_live=True)
    live, again = (
        Poses.load(take.performer_folder(solve, "performer_2") / POSES) for solve in ("live", "again")
    )
    np.testing.assert_array_equal(live.positions_m, again.positions_m)


def test_a_live_take_tells_when_two_were_not_told_apart(shoot):
    a_second_performer(shoot)
    shoot.sequence = ALIKE
    started = shoot.stage.start_recording("day", "both")
    shoot.play(0.5)
    shoot.apart_m = 0.02 * APART_M
    shoot.play(0.5)
    shoot.stage.stop_recording()
    take = Take.open(shoot.stage.sessions / started.session / started.take)
    solve_take(take, preset("studio"), name="again", as_live=True)
    for name in take.performer_names("live"):
        live, again = (undecided_spans(take.performer_folder(solve, name)) for solve in ("live", "again"))
        assert live == again and len(live) == 1
        assert 0.1 < live[0][1] - live[0][0] < 0.7
    live, again = (read_metrics(take.solve_folder(solve)) for solve in ("live", "again"))
    assert live["recorded_s"] == again["recorded_s"]


def test_performers_who_leave_come_back_as_themselves(shoot):
    a_second_performer(shoot)
    shoot.play(0.5)
    shoot.play(3.0, second=False)
    assert shoot.performers() == [("performer_1", True), ("performer_2", False)]
    shoot.play(2.0)
    assert shoot.performers() == [("performer_1", True), ("performer_2", True)]


def test_an_empty_stage_knows_who_comes_in_whoever_is_first(shoot):
    a_second_performer(shoot)
    shoot.play(1.0)
    shoot.stage.choose_reference("camera_1")  # begins anew: nobody has been seen on this clock
    assert shoot.performers() == [("performer_1", False), ("performer_2", False)]
    shoot.play(1.3, first=False)
    assert shoot.performers() == [("performer_1", False), ("performer_2", True)]
    shoot.play(1.3)
    assert shoot.performers() == [("performer_1", True), ("performer_2", True)]
    first, second = shoot.stage.results.get()[1].each()
    assert (first.performer, second.performer) == (1, 2)
    assert second.positions_m[0, 0] - first.positions_m[0, 0] == pytest.approx(APART_M[0], abs=0.1)


def test_a_stranger_on_an_empty_stage_is_nobody_s_double(shoot, monkeypatch):
    a_second_performer(shoot)
    shoot.stage.choose_reference("camera_1")
    monkeypatch.setattr(sys.modules[__name__], "SMALLER", 0.6)  # a child, whom nobody has measured
    shoot.play(3.0, first=False)
    assert shoot.performers() == [("performer_1", False), ("performer_2", False), ("", True)]


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


def named(shoot, new="Bo"):
    a_second_performer(shoot)
    shoot.stage.rename_performer("performer_2", new)


def test_names_go_into_the_take_and_finish_knows_who_was_measured_before(shoot):
    named(shoot)
    with refused(TakeError, "performers.name_taken"):
        shoot.stage.rename_performer("performer_1", "bo")
    with refused(SettingsError, "performers.none"):
        shoot.stage.rename_performer("performer_2", "Cy")
    shoot.play(0.5)
    started = shoot.stage.start_recording("day", "both")
    shoot.play(1.0)
    shoot.stage.stop_recording()
    take = Take.open(shoot.stage.sessions / started.session / started.take)
    assert take.performer_names("live") == ["performer_1", "performer_2"]
    assert take.meta["performer_names"] == {"performer_2": "Bo"}
    solve_take(take, preset("studio"), name="again", as_live=True)
    solve_take(take, preset("studio"), name="later")
    for solve in ("again", "later"):
        assert take.performer_names(solve) == ["performer_1", "performer_2"], solve
        first, second = (
            Poses.load(take.performer_folder(solve, name) / POSES) for name in take.performer_names(solve)
        )
        assert second.positions_m[-1, 0, 0] - first.positions_m[-1, 0, 0] > 1.0, solve


def test_two_are_exchanged_from_a_moment_on_and_back(shoot):
    named(shoot)
    shoot.play(0.5)
    started = shoot.stage.start_recording("day", "both")
    apart = []
    for _ in range(3):
        shoot.play(0.7)
        first, second = shoot.stage.results.get()[1].each()
        apart.append(float(second.positions_m[0, 0] - first.positions_m[0, 0]))
        shoot.stage.exchange_performers("performer_1", "Bo")
    assert apart == pytest.approx([APART_M[0], -APART_M[0], APART_M[0]], abs=0.1)
    shoot.play(0.5)
    shoot.stage.stop_recording()
    take = Take.open(shoot.stage.sessions / started.session / started.take)
    solve_take(take, preset("studio"), name="again", as_live=True)
    for name in ("performer_1", "Bo"):
        live, again = (Poses.load(take.performer_folder(solve, name) / POSES) for solve in ("live", "again"))
        np.testing.assert_array_equal(live.positions_m, again.positions_m)


def smoothings(shoot):
    """The smoothing that each performer's pipeline has, by number, and where their hips are."""
    pipeline = shoot.stage._engine._pipeline.pipeline
    _, result = shoot.stage.results.get()
    places = {one.performer: float(one.positions_m[0, 0]) for one in result.each()}
    return {
        one.number: (one.pipeline._settings.smoothing, round(places[one.number] / APART_M[0]))
        for one in pipeline._followed.values()
    }


def test_who_is_exchanged_keeps_settings_of_their_own(shoot):
    a_second_performer(shoot)
    shoot.stage.set_settings(parse_settings("raw", ["performer_2.smoothing=one_euro:before"]))
    started = shoot.stage.start_recording("day", "both")
    shoot.play(0.7)
    assert smoothings(shoot) == {1: ("none", 0), 2: ("one_euro:before", 1)}
    shoot.stage.exchange_performers("performer_1", "performer_2")
    shoot.play(0.7)
    assert smoothings(shoot) == {1: ("none", 1), 2: ("one_euro:before", 0)}
    shoot.stage.exchange_performers("performer_2", "performer_1")
    shoot.play(0.7)
    assert smoothings(shoot) == {1: ("none", 0), 2: ("one_euro:before", 1)}
    shoot.stage.stop_recording()
    take = Take.open(shoot.stage.sessions / started.session / started.take)
    solve_take(take, preset("studio"), name="again", as_live=True)
    for name in take.performer_names("live"):
        live, again = (Poses.load(take.performer_folder(solve, name) / POSES) for solve in ("live", "again"))
        np.testing.assert_array_equal(live.positions_m, again.positions_m)


def test_a_profile_gives_its_name_to_who_has_its_bones(shoot):
    named(shoot)
    shoot.stage.keep_profile("Bo")
    assert shoot.stage.status().performers[1].profile
    shoot.stage.forget_performers("Bo")
    with refused(CalibrationError, "performers.first"):
        shoot.stage.forget_performers("performer_1")
    a_second_performer_again(shoot)
    assert shoot.performers()[1] == ("Bo", True)


def a_second_performer_again(shoot):
    shoot.play(1.0)
    assert shoot.performers() == [("performer_1", True), ("", True)]
    wait_until(
        lambda: (shoot.see(ARMS_OUT_S, ARMS_OUT_S), len(shoot.stage.results.get()[1].others) == 1)[1],
        "the second one was measured again",
    )


def test_what_may_be_lost_is_told(shoot):
    named(shoot)
    shoot.play(1.0)
    assert shoot.stage.status().performer_warnings == []
    shoot.hidden_from = {"camera_1"}
    shoot.play(2.0)
    assert [one.code for one in shoot.stage.status().performer_warnings] == ["performers.unseen"]
    shoot.hidden_from, shoot.ghost = set(), True
    shoot.play(2.0)
    assert [one.code for one in shoot.stage.status().performer_warnings] == ["performers.ghost"]
