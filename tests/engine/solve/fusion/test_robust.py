"""Robust fusion: it leaves out implausible joints, and accepts them again if they persist."""

import numpy as np
import pytest

from studio.engine.model.joints import INDEX, JOINT_COUNT, MIRROR
from studio.engine.solve.fusion.robust import AGREE_S, FORGET_S, INSIST_S, RobustFusion
from tests.engine.walkers import arms_swinging, frame_set, standing

DT = 1 / 60
WRIST = INDEX["left_wrist"]
REASONS = {"unseen", "unsure", "outlier", "disagrees"}


class Run:
    """A fusion that is fed frame by frame."""

    def __init__(self, cameras=2):
        self.fusion, self.cameras, self.time_s = RobustFusion(), cameras, 1.0

    def feed(self, seconds, joints_at=standing, change=None, **more):
        """Feed `joints_at(time)` to all cameras, altered by `change(positions)`; return the results."""
        out = []
        for _ in range(max(1, round(seconds / DT))):
            positions = np.stack([joints_at(self.time_s)] * self.cameras)
            if change is not None:
                change(positions)
            out.append(self.fusion.fuse(frame_set(self.time_s, positions, **more)))
            self.time_s += DT
        return out


def moved(camera, joint, by):
    def change(positions):
        positions[camera, joint] = positions[camera, joint] + by

    return change


def hidden(camera, joint):
    return moved(camera, joint, np.nan)


def test_it_takes_the_joints_as_they_are_from_the_first_frame_on():
    run = Run()
    first = run.feed(DT)[0]
    assert np.abs(first.positions - standing()).max() < 1e-9
    assert (first.confidence > 0.9).all() and first.used.any(axis=0).all()
    last = run.feed(0.5, arms_swinging)[-1]
    assert np.linalg.norm(last.positions - arms_swinging(run.time_s - DT), axis=1).mean() < 0.02
    assert last.used.all() and last.reasons == {} and (last.sigma < 0.05).all()


@pytest.mark.parametrize("camera", [0, 1])
@pytest.mark.parametrize("joint", ["left_wrist", "head", "right_ankle"])
def test_a_spike_at_full_confidence_in_one_camera_is_left_out(camera, joint):
    run, j = Run(), INDEX[joint]
    run.feed(0.5)
    for result in run.feed(0.3, change=moved(camera, j, np.array([0.2, 0.2, 0.1])), confidence=1.0):
        assert not result.used[camera, j] and result.used[1 - camera, j]
        assert result.reasons[(camera, j)] == "disagrees"
        assert np.linalg.norm(result.positions[j] - standing()[j]) < 0.02


def test_a_spike_in_the_only_camera_is_left_out_while_it_is_short():
    run = Run(cameras=1)
    run.feed(0.5)
    spiked = run.feed(3 * DT, change=moved(0, WRIST, np.array([0.3, 0.0, 0.2])), confidence=1.0)
    assert all(r.reasons == {(0, WRIST): "outlier"} for r in spiked)
    assert max(np.linalg.norm(r.positions[WRIST] - standing()[WRIST]) for r in spiked) < 0.02
    assert spiked[-1].confidence[WRIST] < 0.5 < spiked[-1].confidence[INDEX["head"]]
    assert spiked[-1].sigma[WRIST] > spiked[0].sigma[WRIST]
    assert run.feed(DT)[0].used.all(), "and it is back as soon as the spike ends"


def burst(rng, joint, frames):
    """A new error of 20 to 50 cm in every camera frame (two output frames); the first of the two is interpolated."""
    ways = rng.normal(size=(frames + 1, 3))
    ways *= (rng.uniform(0.2, 0.5, frames + 1) / np.linalg.norm(ways, axis=1))[:, None]
    ways[0] = 0.0
    for k in range(1, frames + 1):
        yield moved(0, joint, 0.5 * (ways[k - 1] + ways[k]))
        yield moved(0, joint, ways[k])


@pytest.mark.parametrize("joint", ["left_wrist", "head", "right_knee"])
def test_bursts_of_spikes_in_the_only_camera_are_left_out_to_their_end(joint):
    rng, j, used, back = np.random.default_rng(5), INDEX[joint], [], []
    for _ in range(8):
        run = Run(cameras=1)
        run.feed(0.5)
        for change in burst(rng, j, 10):
            used.append(run.feed(DT, change=change, confidence=1.0)[0].used[0, j])
        back.append(np.linalg.norm(run.feed(0.1)[-1].positions[j] - standing()[j]))
    assert np.mean(used) < 0.25, "but for those that come near"
    assert max(back) < 0.03, "and it is believed as soon as it is back"


def test_one_that_jumps_there_and_stays_must_insist():
    run, off = Run(cameras=1), np.array([0.3, 0.0, 0.1])
    run.feed(0.5)
    results = run.feed(INSIST_S + 0.2, change=moved(0, WRIST, off), confidence=1.0)
    away = np.array([np.linalg.norm(r.positions[WRIST] - standing()[WRIST]) for r in results])
    assert away[: round(INSIST_S / DT) - 2].max() < 0.05
    assert abs(away[-1] - np.linalg.norm(off)) < 0.02


@pytest.mark.parametrize("cameras", [1, 2])
def test_a_fast_limb_is_followed(cameras):
    def punching(time_s):
        joints = standing().copy()
        phase = 2 * np.pi * 2.0 * (time_s - 1.0)
        joints[WRIST] += np.array([0.0, -0.3, 0.3]) * (1 - np.cos(phase))  # up to 5 m/s, 67 m/s2
        return joints

    run = Run(cameras=cameras)
    run.feed(0.2, punching)
    results = run.feed(2.0, punching)
    assert all(r.used[:, WRIST].all() for r in results)


def test_an_unseen_joint_goes_with_the_body():
    def walking(time_s):
        return standing() + np.array([1.2 * (time_s - 1.0), 0.0, 0.0])

    run = Run()

    def hide(positions):
        positions[:, [WRIST, INDEX["neck"]]] = np.nan

    run.feed(0.6, walking)
    for result in run.feed(0.4, walking, change=hide):
        error = np.linalg.norm(result.positions - walking(run.time_s - DT), axis=1)
    assert max(error[WRIST], error[INDEX["neck"]]) < 0.16, "of 0.48 m that it went"


def test_one_camera_that_insists_is_believed():
    run, off = Run(cameras=1), np.array([0.0, -1.5, 0.3])
    run.feed(0.5)
    results = run.feed(INSIST_S + 0.3, change=moved(0, WRIST, off))
    away = np.array([np.linalg.norm(r.positions[WRIST] - standing()[WRIST] - off) for r in results])
    assert (away[:4] > 1.4).all(), "not at once"
    assert away[-1] < 0.02 and results[-1].used[0, WRIST]


def test_two_cameras_that_agree_are_believed_soon():
    run, off = Run(), np.array([0.0, -0.6, 0.3])

    def both(positions):
        positions[:, WRIST] += off

    run.feed(0.5)
    results = run.feed(0.2, change=both)
    away = np.array([np.linalg.norm(r.positions[WRIST] - standing()[WRIST] - off) for r in results])
    assert away[round((AGREE_S + 3 * DT) / DT)] < 0.05
    assert away[-1] < 0.02


def test_a_camera_that_swaps_left_and_right_is_turned_round():
    run = Run()
    run.feed(0.5)

    def swap(positions):
        positions[1] = positions[1][MIRROR]

    for result in run.feed(0.5, arms_swinging, change=swap):
        assert result.used.all()
    assert np.linalg.norm(result.positions - arms_swinging(run.time_s - DT), axis=1).mean() < 0.02
    alone = Run(cameras=1)
    alone.feed(0.3)
    swapped = alone.feed(0.3, change=lambda p: p.__setitem__(0, p[0][MIRROR]))
    assert np.abs(swapped[-1].positions - standing()).max() < 0.01


def test_a_joint_unseen_for_long_is_unseen_and_comes_back_at_once():
    run = Run()

    def hide(positions):
        positions[:, WRIST] = np.nan

    run.feed(0.5)
    results = run.feed(FORGET_S + 1.0, change=hide)
    known = np.array([np.isfinite(r.positions[WRIST]).all() for r in results])
    assert known[: round(0.8 * FORGET_S / DT)].all() and not known[round(1.2 * FORGET_S / DT) :].any()
    confidence = np.array([r.confidence[WRIST] for r in results])
    assert (np.diff(confidence) <= 0).all() and confidence[0] <= 0.5 and confidence[-1] == 0
    assert np.isnan(results[-1].sigma[WRIST])
    assert results[-1].reasons == {(0, WRIST): "unseen", (1, WRIST): "unseen"}
    back = run.feed(5 * DT)
    for result in back:
        assert np.linalg.norm(result.positions[WRIST] - standing()[WRIST]) < 0.02
        assert result.confidence[WRIST] > 0.8


def test_a_joint_rejected_until_it_is_forgotten_is_taken_up_again():
    """First unseen, then away from its place: neither may lose the joint for good."""
    run, off = Run(cameras=1), np.array([0.0, -0.8, 0.5])
    run.feed(0.5)
    run.feed(0.3, change=hidden(0, WRIST))
    results = run.feed(1.0, change=moved(0, WRIST, off))
    found = [np.linalg.norm(r.positions[WRIST] - standing()[WRIST] - off) for r in results[-30:]]
    assert max(found) < 0.02 and results[-1].used[0, WRIST]


def test_time_that_goes_back_or_leaps_starts_anew():
    for leap_s in (-5.0, -0.1, 20.0):
        run = Run()
        run.feed(0.3)
        run.time_s += leap_s
        shifted = run.feed(3 * DT, lambda t: standing(t) + 1.0)
        assert np.abs(shifted[-1].positions - standing() - 1.0).max() < 0.01


def test_everything_that_is_not_used_has_a_reason_and_nothing_else_has():
    run, rng = Run(cameras=3), np.random.default_rng(2)

    def mess(positions):
        positions[rng.random((3, JOINT_COUNT)) < 0.2] = np.nan
        positions[rng.random((3, JOINT_COUNT)) < 0.1] += rng.normal(0, 0.4, 3)

    for result in run.feed(1.0, arms_swinging, change=mess, confidence=0.9):
        assert set(result.reasons) == {
            (int(c), int(j)) for c, j in zip(*np.nonzero(~result.used), strict=True)
        }
        assert set(result.reasons.values()) <= REASONS
        seen = np.isfinite(result.positions).all(axis=1)
        assert (np.isfinite(result.sigma) == seen).all() and ((result.confidence > 0) <= seen).all()


def test_noise_is_averaged_and_unsure_joints_weigh_less():
    rng = np.random.default_rng(3)
    sure = np.full((2, JOINT_COUNT), 0.95)
    sure[1] = 0.3
    run = Run()

    def noisy(positions):
        positions[0] += rng.normal(0, 0.015, (JOINT_COUNT, 3))
        positions[1] += 0.06 + rng.normal(0, 0.03, (JOINT_COUNT, 3))

    results = run.feed(1.5, change=noisy, confidence=sure)[30:]
    error = np.array([np.linalg.norm(r.positions - standing(), axis=1) for r in results])
    assert error.mean() < 0.035, "nearer to the sure camera than to the middle (52 mm off)"


def test_nothing_seen_gives_nothing():
    result = Run().feed(DT, lambda t: np.full((JOINT_COUNT, 3), np.nan))[0]
    assert np.isnan(result.positions).all() and (result.confidence == 0).all()
    assert set(result.reasons.values()) == {"unseen"}
