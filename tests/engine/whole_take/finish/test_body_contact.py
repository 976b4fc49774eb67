"""Parts of the body that penetrate each other are pushed apart; nothing else changes."""

import numpy as np
import pytest

from studio.engine.model.human.anthropometry import anthropometric_positions
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX
from studio.engine.seeing.fitting.cones import SHAPE, performer_of
from studio.engine.whole_take.finish.contact import body_contact
from studio.engine.whole_take.finish.contact.body_contact import BELIEVED_M, GIVES_M, SIGMA_M, BodyContact
from studio.engine.whole_take.finish.trajectory import Kinematics, moved


@pytest.fixture(scope="module")
def body():
    humanoid = build_humanoid(Skeleton.of(performer_of(np.zeros(len(SHAPE)))))
    return humanoid, Kinematics(humanoid), BodyContact(humanoid.skeleton.height_m)


@pytest.fixture
def all_believed(monkeypatch):
    """Make every depth count alike."""
    monkeypatch.setattr(body_contact, "BELIEVED_M", 1e3)


def _hanging(humanoid, abduction: float) -> np.ndarray:
    """The rest pose with the right arm hanging outwards by this angle [rad], by the best hinges of the shoulder."""
    q = np.zeros(humanoid.model.nq)
    q[:7] = humanoid.rest_qpos[:7]
    q[7:] = humanoid.rest_q
    kinematics = Kinematics(humanoid)
    target = kinematics.sites(q[None])[0][INDEX["right_shoulder"]]
    names = [humanoid.model.joint(k).name for k in range(1, humanoid.model.njnt)]
    columns = [7 + k for k, name in enumerate(names) if name.startswith("RightArm_")]
    for _ in range(60):
        sites, jacobians = kinematics.linearised(q[None])
        wrist = INDEX["right_wrist"]
        wanted = target + 0.5 * np.array([-np.sin(abduction), 0.0, -np.cos(abduction)])
        rows = jacobians[0, 3 * wrist : 3 * wrist + 3][:, [c - 1 for c in columns]]
        q[columns] += 0.5 * np.linalg.lstsq(rows, wanted - sites[0, wrist], rcond=1e-2)[0]
    return q[None]


def test_a_t_pose_asks_for_nothing(body):
    humanoid, kinematics, contact = body
    q = humanoid.rest_qpos[None].copy()
    q[:, 7:] = 0.0
    _, _, residuals = contact.rows(*kinematics.linearised(q))
    assert not residuals.any()


def test_a_row_says_how_two_parts_come_apart(body, all_believed):
    """The residual falls by the row times a small step: finite differences, up to the effect of tapering."""
    humanoid, kinematics, contact = body
    q = _hanging(humanoid, -0.3)
    frames, rows, residuals = contact.rows(*kinematics.linearised(q))
    deepest = int(np.argmax(residuals))
    assert frames[deepest] == 0 and residuals[deepest] * SIGMA_M > 0.01
    for k in np.flatnonzero(np.abs(rows[deepest]) > 1e-3):
        step = np.zeros((1, humanoid.model.nv))
        step[0, k] = 1e-6
        after = contact.rows(*kinematics.linearised(moved(q, step)))[2]
        assert (residuals[deepest] - after[deepest]) / 1e-6 == pytest.approx(rows[deepest, k], abs=2.0)


def test_steps_along_the_rows_bring_parts_apart(body, all_believed):
    humanoid, kinematics, contact = body
    q = _hanging(humanoid, -0.3)
    for _ in range(8):
        _, rows, residuals = contact.rows(*kinematics.linearised(q))
        normal = rows.T @ rows + 1e3 * np.eye(rows.shape[1])
        q = moved(q, np.linalg.solve(normal, rows.T @ residuals)[None])
    assert contact.rows(*kinematics.linearised(q))[2].max(initial=0.0) * SIGMA_M < 0.002


def test_parts_scale_with_the_performer(all_believed):
    sites = anthropometric_positions(1.7)[None].copy()
    sites[0, INDEX["right_wrist"]] = sites[0, INDEX["right_hip"]] + [-0.11, 0.0, -0.05]
    sites[0, INDEX["right_elbow"]] = sites[0, INDEX["right_wrist"]] + [-0.02, 0.0, 0.25]
    jacobians = np.zeros((1, 63, 5))
    small, large = (BodyContact(height).rows(sites, jacobians)[2].max(initial=0.0) for height in (1.2, 2.2))
    assert small == 0.0
    assert large * SIGMA_M > GIVES_M


def _forearm_in_thigh(deep_m: float) -> np.ndarray:
    """Canonical joints with the right forearm across the right thigh, this deep beyond what flesh gives."""
    sites = anthropometric_positions(1.7)[None].copy()
    hip, knee = sites[0, INDEX["right_hip"]], sites[0, INDEX["right_knee"]]
    thigh = 0.5 * (hip + knee)
    radii = body_contact._PARTS["right_thigh"][2:], body_contact._PARTS["right_forearm"][2:]
    away = 1.7 * sum(0.5 * (begin + end) for begin, end in radii) - GIVES_M - deep_m
    for joint, y in (("right_elbow", 0.13), ("right_wrist", -0.13), ("right_hand", -0.2)):
        sites[0, INDEX[joint]] = thigh + np.array([-away, y, 0.0])
    return sites


def test_what_is_too_deep_for_noise_counts_little():
    """The pull grows with the depth at first, and fades where cameras see one part well inside the other."""
    contact, jacobians = BodyContact(1.7), np.zeros((1, 63, 1))
    jacobians[0, 3 * INDEX["right_elbow"], 0] = jacobians[0, 3 * INDEX["right_wrist"], 0] = 1.0

    def pull(deep_m: float) -> float:
        _, rows, residuals = contact.rows(_forearm_in_thigh(deep_m), jacobians)
        return float(np.abs(rows[:, 0] @ residuals))

    assert pull(0.2 * BELIEVED_M) < pull(0.5 * BELIEVED_M)
    assert pull(3.0 * BELIEVED_M) < 0.2 * pull(0.5 * BELIEVED_M)
