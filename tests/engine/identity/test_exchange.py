"""Two performers are exchanged from a moment on, as often as an operator requests it."""

import numpy as np

from studio.engine.identity.exchange import exchanged
from studio.engine.identity.whole_take import People, TakePerformer
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.engine.model.performers.exchange import Exchange

RATE_HZ = 30
AHEAD_S = 0.5
"""How far the camera's clock is ahead of the stage's."""


def frames(height_m: float, seconds: range) -> list[CameraFrame]:
    """Frames of a body whose joints all have this height, in these whole seconds of the camera's clock."""
    joints = np.full((21, 3), height_m)
    times_ns = [round((s + k / RATE_HZ) * 1e9) for s in seconds for k in range(RATE_HZ)]
    return [CameraFrame("left", i, time_ns, joints, np.ones(21)) for i, time_ns in enumerate(times_ns)]


def two(**undecided: tuple[tuple[float, float], ...]) -> tuple[People, Calibration]:
    pose = CameraCalibration(np.eye(4), ClockModel(offset_ns=round(-AHEAD_S * 1e9)))
    calibration = Calibration(reference="left", cameras={"left": pose})
    heights = {1: (1.0, range(10)), 2: (2.0, range(3, 10))}
    performers = tuple(
        TakePerformer(number, {"left": frames(*what)}, calibration, undecided.get(f"performer_{number}", ()))
        for number, what in heights.items()
    )
    return People(performers, 0, 0, ((0.0, 10.0),)), calibration


def heights(people: People, performer: int) -> list[tuple[float, int]]:
    """Heights of a performer's bodies, and for how many frames each lasts; also checks that times increase."""
    mine = list(people.performers[performer].frames["left"])
    times = [frame.device_time_ns for frame in mine]
    assert times == sorted(set(times))
    found: list[list[float]] = []
    for frame in mine:
        if found and found[-1][0] == frame.positions[0, 0]:
            found[-1][1] += 1
        else:
            found.append([float(frame.positions[0, 0]), 1])
    return [(height, int(count)) for height, count in found]


def test_frames_are_the_others_from_the_moment_on():
    people, made = exchanged(*two(), [Exchange(5.0, ("performer_1", "performer_2"))])
    assert len(made) == 1
    assert heights(people, 0) == [
        (1.0, 165),
        (2.0, 135),
    ]  # 5 s on the stage's clock are 5.5 s on the camera's
    assert heights(people, 1) == [(2.0, 75), (1.0, 135)]


def test_another_exchange_is_made_on_what_the_first_left():
    pair = ("performer_1", "performer_2")
    people, _ = exchanged(*two(), [Exchange(7.0, pair), Exchange(5.0, pair)])
    assert heights(people, 0) == [(1.0, 165), (2.0, 60), (1.0, 75)]
    back, _ = exchanged(*two(), [Exchange(5.0, pair), Exchange(5.0, pair)])
    assert heights(back, 0) == [(1.0, 300)] and heights(back, 1) == [(2.0, 210)]


def test_doubts_go_with_the_frames():
    doubts = {"performer_1": ((1.0, 2.0), (4.5, 6.0)), "performer_2": ((8.0, 9.0),)}
    people, _ = exchanged(*two(**doubts), [Exchange(5.0, ("performer_2", "performer_1"))])
    assert people.performers[0].undecided_s == ((1.0, 2.0), (4.5, 5.0), (8.0, 9.0))
    assert people.performers[1].undecided_s == ((5.0, 6.0),)


def test_who_was_not_found_is_left_as_it_is():
    before, calibration = two()
    people, made = exchanged(before, calibration, [Exchange(5.0, ("performer_1", "performer_3"))])
    assert made == [] and heights(people, 0) == [(1.0, 300)]
