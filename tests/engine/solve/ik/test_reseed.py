"""A stuck limb is recovered smoothly; a limb that follows costs nothing and is left alone."""

import sys

import numpy as np
import pytest

from studio.engine.model.joints import INDEX
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.ik.reseed import FADE_S, STUCK_M, STUCK_S, LimbReseed
from studio.engine.solve.ik.solver import Solver
from tests.engine.solve.ik.test_solver import (
    DT,
    SIGMA,
    adversarial_joints,
    assert_human,
    errors_m,
    follow,
    make_solver,
)
from tests.engine.walkers import arms_swinging, humanoid, site_positions, standing

WEIGHTS = np.full(len(SIGMA), 50.0)


def after_adversity(seed):
    """A solver that has followed adversarial joints."""
    rng, solver = np.random.default_rng(seed), make_solver()
    follow(solver, arms_swinging(0.0), 3)
    for _, joints in adversarial_joints(rng):
        for _ in range(3):
            sigma = np.where(np.isnan(joints[:, 0]), np.nan, rng.choice([1e-4, 0.01, 3.0]))
            solver.solve(joints, sigma, float(rng.choice([0.0, 1 / 120, DT, 0.5, 10.0])))
    return solver


@pytest.mark.parametrize("seed", [21, 32, 1036])  # an arm was lost for good after these
def test_a_stuck_arm_is_found_again_without_a_jump(seed):
    solver, body, target = after_adversity(seed), humanoid(), arms_swinging(0.0)
    last, fastest = follow(solver, target, 5), 0.0
    for _ in range(90):
        q = solver.solve(target, SIGMA, DT)
        assert_human(body, q)
        if solver._watch._left_s.any():  # it is being guided
            fastest = max(fastest, float(np.abs(q - last)[7:].max()) / DT)
        last = q
    assert errors_m(body, last, target).max() < 0.02
    assert fastest < 1.6 * 2 * np.pi / FADE_S


def stuck(watch, body, q, targets, seconds, weights=WEIGHTS):
    """Feed the watch the same pose; return when it found another one [s], and that pose."""
    sites = site_positions(body, q)
    for k in range(round(seconds / DT)):
        found = watch.found(q, sites, targets, weights, lambda: None, DT)
        if found is not None:
            return k * DT, found
    return None


def raised_arm(body):
    """The rest pose, and the joints of the same pose with the right arm elsewhere."""
    q, wanted = body.rest_qpos, body.rest_qpos
    wanted[7 + body.model.joint("RightArm_swing").id - 1] = np.radians(-60)
    wanted[7 + body.model.joint("RightForeArm_bend").id - 1] = np.radians(-100)
    wanted[7:] = np.clip(wanted[7:], *body.range_rad.T)
    return q, site_positions(body, wanted)


def test_it_waits_four_frames_then_changes_that_limb_alone():
    body = humanoid()
    q, targets = raised_arm(body)
    assert np.linalg.norm(site_positions(body, q) - targets, axis=1).max() > 2 * STUCK_M
    when, (better, hinges) = stuck(LimbReseed(body, limited=True), body, q, targets, 1.0)
    assert STUCK_S - 1e-9 <= when <= STUCK_S + 2 * DT
    assert np.linalg.norm(site_positions(body, better) - targets, axis=1).max() < 0.03
    names = {body.model.joint(i + 1).name.split("_")[0] for i in np.flatnonzero(better[7:] != q[7:])}
    assert names <= {"RightShoulder", "RightArm", "RightForeArm", "RightHand"}
    assert set(np.flatnonzero(better[7:] != q[7:])) <= set(hinges.tolist())


def test_a_first_pose_with_an_arm_elsewhere_is_mended_at_once():
    body = humanoid()
    q, targets = raised_arm(body)
    watch, sites = LimbReseed(body, limited=True), site_positions(body, q)
    better = watch.settled(q, sites, targets, WEIGHTS, lambda: None)
    assert np.linalg.norm(site_positions(body, better) - targets, axis=1).max() < 0.03
    assert watch.led(better, DT) is better, "nothing is led: there is no pose before it"
    assert watch.settled(q, sites, sites, WEIGHTS, lambda: None) is None
    assert watch.settled(q, sites, targets, np.zeros(len(SIGMA)), lambda: None) is None


def posed(body, hinges_deg):
    q = body.rest_qpos
    for name, deg in hinges_deg.items():
        q[7 + body.model.joint(name).id - 1] = np.radians(deg)
    q[7:] = np.clip(q[7:], *body.range_rad.T)
    return q


def test_a_first_frame_whose_arm_is_caught_behind_its_ranges_is_followed(monkeypatch):
    """As in punches_2: an arm that is stretched forward began folded, at the ends of all its ranges."""
    body, solver = humanoid(), make_solver()
    caught = {"LeftArm_swing": -120, "LeftArm_raise": 30, "LeftArm_twist": -100, "LeftForeArm_bend": -150}
    forward = {"LeftArm_swing": 85, "LeftArm_raise": -80, "LeftArm_twist": -20, "LeftForeArm_bend": -10}
    joints = site_positions(body, posed(body, forward))
    monkeypatch.setattr(solver, "_shown", lambda *_: posed(body, caught))
    assert errors_m(body, solver.solve(joints, SIGMA, 0.0), joints).max() < 0.03


def test_the_pose_is_led_there_smoothly_and_ends_there():
    body = humanoid()
    q, targets = raised_arm(body)
    watch = LimbReseed(body, limited=True)
    _, (better, _) = stuck(watch, body, q, targets, 1.0)
    course = np.array([q, *(watch.led(better, DT) for _ in range(round(FADE_S / DT) + 3))])
    assert np.abs(course[1] - q).max() < 1e-9 and np.array_equal(course[-1], better)
    way = np.abs(better - q).max()
    assert np.abs(np.diff(course, axis=0)).max() < 2.0 * way * DT / FADE_S


def test_unsure_or_unseen_joints_do_not_tell_that_a_limb_is_stuck():
    body = humanoid()
    q, targets = raised_arm(body)
    unseen = targets.copy()
    weights = WEIGHTS.copy()
    for name in ("elbow", "wrist", "hand"):
        unseen[INDEX[f"right_{name}"]], weights[INDEX[f"right_{name}"]] = np.nan, 0.0
    assert stuck(LimbReseed(body, limited=True), body, q, unseen, 1.0, weights) is None
    assert stuck(LimbReseed(body, limited=True), body, q, targets, 1.0, np.full(len(SIGMA), 5.0)) is None


def test_a_limb_that_cannot_get_there_is_tried_more_and_more_seldom(monkeypatch):
    body, tried = humanoid(), []
    watch = LimbReseed(body, limited=True)
    q = body.rest_qpos
    targets = standing()
    targets[INDEX["left_wrist"]] += [2.0, 0.0, 1.0]
    trial = watch._try
    monkeypatch.setattr(watch, "_try", lambda *a: tried.append(1) or trial(*a))
    assert stuck(watch, body, q, targets, 20.0) is None
    assert 3 <= len(tried) <= 7


def test_equal_input_gives_equal_output():
    a, b = after_adversity(1036), after_adversity(1036)
    for _ in range(40):
        x, y = (s.solve(arms_swinging(0.0), SIGMA, DT) for s in (a, b))
        assert x.tobytes() == y.tobytes()


def test_watching_costs_little():
    """A frame of a body that fits takes a few calls of numpy, nothing limb by limb; 17 us on an idle machine."""
    body = humanoid()
    watch, q = LimbReseed(body, limited=True), body.rest_qpos
    sites, calls = site_positions(body, q), []
    sys.setprofile(lambda frame, event, function: calls.append(event) if "call" in event else None)
    try:
        found, led = watch.found(q, sites, sites, WEIGHTS, lambda: None, DT), watch.led(q, DT)
    finally:
        sys.setprofile(None)
    assert found is None and led is q
    assert 3 <= len(calls) <= 20, calls


def test_combined_skeleton_needs_no_watch():
    solver = Solver(humanoid(), parse_settings("studio", ["ik=combined_skeleton"]))
    assert solver._watch is None
