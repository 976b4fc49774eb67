"""The solver: it follows exact joints, and for any input the pose stays finite and human."""

import numpy as np
import pytest

from studio.engine.base.geometry import transform_points
from studio.engine.model.joints import CANONICAL, INDEX, JOINT_COUNT, OUTPUT_OF_CANONICAL_INDEX, PARENTS
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.ik.solver import Solver
from tests.engine.walkers import arms_swinging, camera_at, humanoid, only, random_q, site_positions, usual_q

MODES = ("previous_pose", "combined_skeleton")
DT = 1 / 60
LIMIT_TOLERANCE_RAD = np.radians(0.1)
SIGMA = np.full(JOINT_COUNT, 0.01)


def make_solver(*assignments, height_m=1.78):
    settings = parse_settings("studio", assignments)
    body = humanoid(height_m, human_limits=settings.human_limits == "on")
    return Solver(body, settings)


def assert_human(body, q):
    """Check for finite values, limits, and constant bone lengths."""
    assert np.isfinite(q).all()
    low, high = body.range_rad.T
    excess = np.maximum(low - q[7:], q[7:] - high)
    worst = int(excess.argmax())
    assert excess[worst] <= LIMIT_TOLERANCE_RAD, (
        f"{body.model.joint(worst + 1).name} is {np.degrees(excess[worst]):.2f} degrees beyond its range"
    )
    assert np.linalg.norm(q[3:7]) == pytest.approx(1.0, abs=1e-9)
    place = q.copy()
    place[:3] = 0.0  # bones are compared near the origin, where numbers are exact
    joints = site_positions(body, place)
    for joint, name in enumerate(CANONICAL):
        if name.split("_")[-1] in ("elbow", "wrist", "hand", "knee", "ankle", "toe"):
            length = np.linalg.norm(joints[joint] - joints[PARENTS[joint]])
            rest = body.skeleton.rest_positions_m[OUTPUT_OF_CANONICAL_INDEX]
            assert abs(length - np.linalg.norm(rest[joint] - rest[PARENTS[joint]])) < 1e-9, name


def follow(solver, joints, frames, dt=DT):
    for _ in range(frames):
        q = solver.solve(joints, SIGMA, dt)
    return q


def errors_m(body, q, joints):
    return np.linalg.norm(site_positions(body, q) - joints, axis=1)


@pytest.mark.parametrize("mode", MODES)
def test_it_converges_to_exact_joints_of_usual_poses(mode):
    body, rng = humanoid(), np.random.default_rng(21)
    solver = make_solver(f"ik={mode}")
    means = []
    for _ in range(12):  # a jump from pose to pose: the trunk moves, so that each must be found again
        target = site_positions(body, usual_q(body, rng))
        q = follow(solver, target, 25)
        assert_human(body, q)
        means.append(errors_m(body, q, target).mean())
    assert np.mean(means) < 0.01, f"mean {1e3 * np.mean(means):.1f} mm"
    assert np.mean(np.array(means) < 0.012) >= 0.9, np.round(1e3 * np.array(means), 1)


@pytest.mark.parametrize("mode", MODES)
def test_it_follows_motion_within_centimetres(mode):
    solver, body = make_solver(f"ik={mode}"), humanoid()
    errors = []
    for k in range(90):
        target = arms_swinging(k * DT)
        q = solver.solve(target, SIGMA, DT)
        assert_human(body, q)
        if k > 30:
            errors.append(errors_m(body, q, target).mean())
    assert np.mean(errors) < 0.01


@pytest.mark.parametrize("height_m", [0.9, 2.3])
def test_children_and_giants(height_m):
    body, rng = humanoid(height_m), np.random.default_rng(4)
    solver = make_solver(height_m=height_m)
    for _ in range(5):
        target = site_positions(body, usual_q(body, rng, spreads=0.7))
        q = follow(solver, target, 30)
        assert_human(body, q)
        assert errors_m(body, q, target).mean() < 0.012 * height_m


def adversarial_joints(rng):
    """Adversarial joints: random clouds, far away, subsets, coincident, swapped, mirrored, another scale."""
    body = humanoid()
    base = site_positions(body, random_q(body, rng))
    kinds = {
        "cloud": lambda: rng.normal(0, 1, (JOINT_COUNT, 3)),
        "far": lambda: base + rng.normal(0, 1e6, 3),
        "one joint far": lambda: np.where(np.arange(JOINT_COUNT)[:, None] == rng.integers(21), 1e6, base),
        "scattered far": lambda: rng.normal(0, 1e6, (JOINT_COUNT, 3)),
        "float32 end": lambda: base + 3e38 * rng.choice([-1, 0, 1], (JOINT_COUNT, 3)),
        "a point": lambda: np.tile(rng.normal(0, 1, 3), (JOINT_COUNT, 1)),
        "flat": lambda: base * [1, 1, 0],
        "mirrored": lambda: base * [-1, 1, 1],
        "upside down": lambda: base * [1, 1, -1],
        "huge": lambda: 10 * base,
        "tiny": lambda: 0.01 * base,
        "shuffled": lambda: rng.permutation(base),
        "as it is": lambda: base,
    }
    for _ in range(2):
        for name, make in kinds.items():
            joints = np.array(make())
            if rng.random() < 0.5:
                joints[rng.random(JOINT_COUNT) < rng.random()] = np.nan
            if rng.random() < 0.1:
                joints = only(joints, CANONICAL[rng.integers(JOINT_COUNT)])
            yield name, joints


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("mode", MODES)
def test_adversarial_joints_never_break_the_limits(mode, seed):
    rng = np.random.default_rng(seed)
    solver, body = make_solver(f"ik={mode}"), humanoid()
    follow(solver, arms_swinging(0.0), 3)
    for name, joints in adversarial_joints(rng):
        for _ in range(3):
            sigma = np.where(np.isnan(joints[:, 0]), np.nan, rng.choice([1e-4, 0.01, 3.0]))
            q = solver.solve(joints, sigma, float(rng.choice([0.0, 1 / 120, DT, 0.5, 10.0])))
            assert q is not None, name
            assert_human(body, q)
    q = follow(solver, arms_swinging(0.0), 60)
    assert errors_m(body, q, arms_swinging(0.0)).mean() < 0.02, "it finds the performer again"


@pytest.mark.parametrize("bend", [3, 40])
def test_feet_that_point_outward_do_not_move_the_knees(bend):
    """Without a hinge for it the thigh turned instead: knees and toes were centimetres off."""
    body, q = humanoid(), humanoid().rest_qpos
    for side, out in (("Left", 20.0), ("Right", -20.0)):
        for name, deg in (("UpLeg_bend", -0.5 * bend), ("Leg_bend", bend), ("Foot_turn", out)):
            q[7 + body.model.joint(f"{side}{name}").id - 1] = np.radians(deg)
    joints = site_positions(body, q)
    found = follow(make_solver(), joints, 30)
    off = errors_m(body, found, joints)
    assert off[[INDEX[f"{side}_toe"] for side in ("left", "right")]].max() < 0.02, (
        "held back by the usual stance"
    )
    assert np.delete(off, [INDEX["left_toe"], INDEX["right_toe"]]).max() < 0.01


@pytest.mark.parametrize("mode", MODES)
def test_it_starts_from_adversarial_joints(mode):
    for seed in range(2):
        solver, body = make_solver(f"ik={mode}"), humanoid()
        for _, joints in adversarial_joints(np.random.default_rng(100 + seed)):
            q = solver.solve(joints, SIGMA, DT)
            if q is not None:
                assert_human(body, q)


def test_nothing_is_made_up_before_the_trunk_was_seen():
    solver = make_solver()
    joints = arms_swinging(0.0)
    assert solver.solve(np.full((JOINT_COUNT, 3), np.nan), SIGMA, DT) is None
    assert solver.solve(only(joints, "left_wrist"), SIGMA, DT) is None
    assert solver.solve(joints, SIGMA, DT) is not None


@pytest.mark.parametrize("left", [(), ("head",), ("left_ankle", "right_wrist"), ("hips",)])
def test_a_performer_who_is_not_seen_any_more_stays_human_and_in_place(left):
    solver, body = make_solver(), humanoid()
    before = follow(solver, arms_swinging(0.2), 30)
    seen = only(arms_swinging(0.2), *left)
    for _ in range(120):
        q = solver.solve(seen, SIGMA, DT)
        assert_human(body, q)
    assert np.linalg.norm(q[:3] - before[:3]) < 0.25


def test_a_single_hidden_limb_falls_to_rest_and_is_found_again():
    solver, body = make_solver(), humanoid()
    joints = arms_swinging(0.3)
    follow(solver, joints, 30)
    hidden = joints.copy()
    for name in ("elbow", "wrist", "hand"):
        hidden[INDEX[f"left_{name}"]] = np.nan
    for _ in range(60):
        assert_human(body, solver.solve(hidden, SIGMA, DT))
    assert errors_m(body, follow(solver, joints, 30), joints).mean() < 0.01


def limb_bend(body, q, joint):
    return np.degrees(q[7 + body.model.joint(joint).id - 1])


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    ("hinge", "bend"), [("LeftForeArm_bend", -100), ("RightForeArm_bend", -100), ("LeftLeg_bend", 100)]
)
def test_a_limb_straightened_and_bent_again_does_not_flip(mode, hinge, bend):
    solver, body = make_solver(f"ik={mode}"), humanoid()
    row = 7 + body.model.joint(hinge).id - 1
    rng = np.random.default_rng(1)
    angles, wanted = [], []
    for k in range(180):
        q = body.rest_qpos
        share = 0.5 - 0.5 * np.cos(2 * np.pi * k * DT / 1.5)
        q[row] = np.radians(bend) * share
        joints = site_positions(body, q) + rng.normal(0, 0.002, (JOINT_COUNT, 3))
        solved = solver.solve(joints, SIGMA, DT)
        assert_human(body, solved)
        angles.append(limb_bend(body, solved, hinge))
        wanted.append(np.degrees(q[row]))
    angles, wanted = np.array(angles[30:]), np.array(wanted[30:])
    assert np.abs(np.diff(angles)).max() < 12, "continuous"
    assert np.abs(angles - wanted).max() < 25
    assert np.abs(angles - wanted).mean() < 8


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("way", ["side", "front"])
def test_an_arm_raised_overhead_comes_back(mode, way):
    solver, body = make_solver(f"ik={mode}"), humanoid()
    joints0 = site_positions(body, body.rest_qpos)
    shoulder, lengths = joints0[INDEX["left_shoulder"]], (0.288, 0.258, 0.092)
    out = np.array([1.0, 0, 0]) if way == "side" else np.array([0.05, -1.0, 0])
    worst, last = 0.0, None
    for k in range(200):
        raise_rad = np.radians(10 + 160 * (0.5 - 0.5 * np.cos(2 * np.pi * k * DT / 3.0)))
        direction = np.sin(raise_rad) * out - np.cos(raise_rad) * np.array([0, 0, 1.0])
        joints = joints0.copy()
        at = shoulder
        for name, length in zip(("elbow", "wrist", "hand"), lengths, strict=True):
            at = at + length * direction
            joints[INDEX[f"left_{name}"]] = at
        q = solver.solve(joints, SIGMA, DT)
        assert_human(body, q)
        found = site_positions(body, q)
        if k > 30:
            worst = max(worst, float(np.linalg.norm((found - joints)[INDEX["left_wrist"]])))
            assert np.linalg.norm(found - last, axis=1).max() < 0.12, "no joint jumps"
        last = found
    assert worst < 0.08
    assert np.linalg.norm((found - joints)[INDEX["left_wrist"]]) < 0.04


def test_without_human_limits_the_pose_follows_beyond_them():
    limited, free = make_solver(), make_solver("human_limits=off")
    body = humanoid()
    q = body.rest_qpos
    q[7 + body.model.joint("LeftLeg_bend").id - 1] = np.radians(-40)  # a knee bent forward
    joints = site_positions(body, q)
    q_limited, q_free = follow(limited, joints, 60), follow(free, joints, 60)
    assert_human(body, q_limited)
    assert limb_bend(body, q_free, "LeftLeg_bend") < -20
    assert limb_bend(body, q_limited, "LeftLeg_bend") > -3.1


def test_the_stage_has_no_favoured_place_or_direction():
    """The same motion elsewhere and turned gives the same pose there."""
    T = camera_at(0.0)
    turn = np.eye(4)
    angle = 2.1
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turn[:2, 3] = T[:2, 3]
    here, there = make_solver(), make_solver()
    for k in range(40):
        joints = arms_swinging(k * DT)
        a, b = here.solve(joints, SIGMA, DT), there.solve(transform_points(turn, joints), SIGMA, DT)
    assert np.abs(a[7:] - b[7:]).max() < 1e-6
    assert np.allclose(transform_points(turn, a[:3]), b[:3], atol=1e-6)


def test_reach_zero_lets_a_joint_be_and_resist_slows_it():
    body = humanoid()
    rest = site_positions(body, body.rest_qpos)
    raised = rest.copy()
    raised[INDEX["left_wrist"]] += [0.1, -0.2, 0.4]
    seen = {}
    for name, assignments in {
        "as it is": (),
        "no reach": ("effectors.left_wrist.reach=0", "effectors.left_hand.reach=0"),
        "resists": ("effectors.left_elbow.resist=1", "effectors.left_shoulder.resist=1"),
    }.items():
        solver = make_solver(*assignments)
        follow(solver, rest, 20)
        q = follow(solver, raised, 3)
        seen[name] = float(np.linalg.norm((site_positions(body, q) - rest)[INDEX["left_wrist"]]))
    assert seen["no reach"] < 0.3 * seen["as it is"]
    assert seen["resists"] < 0.8 * seen["as it is"]
