"""A jump seen with noise and finished: with physics its flight follows gravity, and no other figure gets worse."""

import mujoco
import numpy as np
import pytest

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.base.errors import SettingsError
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.pipeline import Pipeline
from studio.engine.whole_take import finisher as finishing
from studio.engine.whole_take.finisher import Finisher
from studio.engine.whole_take.physics.dynamics import GRAVITY_M_S2
from studio.engine.whole_take.take import solve_frames
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.simulator.rig import standard_rig
from tests.engine.walkers import AUTHORED_HEIGHT_M, SECOND
from tests.refused import refused

DT = 1.0 / 60.0
MARGIN_S = 2.0


@pytest.fixture(scope="module")
def jump():
    """The demo motion's jump: its times of flight [s], and canonical joints at 30 Hz with their times [s]."""
    motion = demo_motion()
    toes = motion.positions_m[:, [INDEX["left_toe"], INDEX["right_toe"]], 2].min(axis=1)
    flight = motion.times_s()[toes > 0.12][[0, -1]]
    begin, end = flight[0] - MARGIN_S, flight[1] + MARGIN_S
    return motion, begin, flight - begin, int((end - begin) * FRAMES_PER_SECOND)


@pytest.fixture(scope="module")
def calibration(jump):
    placed = {c.name: CameraCalibration(c.T_stage_camera, depth_bias_m=0.03) for c in standard_rig(2)}
    return Calibration("camera_0", placed, Performer(AUTHORED_HEIGHT_M, jump[0].offsets_m))


@pytest.fixture(scope="module")
def live(jump, calibration):
    """Results of the live pipeline on the jump seen with the noise contract."""
    motion, begin, _, count = jump
    joints = np.array([motion.at(begin + k / FRAMES_PER_SECOND) for k in range(count)])
    performer, *streams = np.random.SeedSequence(4).spawn(3)
    anatomy = anatomical_offsets(np.random.default_rng(performer))
    pipeline, results = Pipeline(calibration, parse_settings("finish")), []
    views = [
        NoisyJoints(camera.T_stage_camera, motion.offsets_m, anatomy, np.random.default_rng(stream)).see_all(joints)
        for camera, stream in zip(calibration.cameras.values(), streams, strict=True)
    ]  # fmt: skip
    for k in range(count):
        for (positions, confidence), name in zip(views, calibration.cameras, strict=True):
            frame = CameraFrame(name, k, k * SECOND // FRAMES_PER_SECOND, positions[k], confidence[k])
            pipeline.add_frame(frame)
        results += [pipeline.step(t * SECOND // 60) for t in ((2 * k - 1, 2 * k) if k else (0,))]
    return results


def finished(live, calibration, *assignments):
    finisher = Finisher(calibration.performer, parse_settings("finish", assignments))
    for result in live:
        finisher.add(result)
    return list(finisher.results()), finisher.physics_report


@pytest.fixture(scope="module")
def off(live, calibration):
    return finished(live, calibration)[0]


@pytest.fixture(scope="module")
def on(live, calibration):
    return finished(live, calibration, "physics=on")


@pytest.fixture(scope="module")
def body(calibration):
    return build_humanoid(Skeleton.of(calibration.performer))


def off_gravity_m_s2(body, results, flight):
    """Mean deviation of the centre of mass's acceleration from free fall, over the frames in flight."""
    data, com = mujoco.MjData(body.model), []
    for result in results:
        data.qpos[:] = result.configuration
        mujoco.mj_kinematics(body.model, data)
        mujoco.mj_comPos(body.model, data)
        com.append(data.subtree_com[1].copy())
    acceleration = np.diff(com, 2, axis=0) / DT**2 + [0.0, 0.0, GRAVITY_M_S2]
    times = np.arange(1, len(com) - 1) * DT
    return np.linalg.norm(acceleration, axis=1)[(times > flight[0]) & (times < flight[1])].mean()


def test_flight_follows_gravity(body, jump, off, on):
    before, after = (off_gravity_m_s2(body, results, jump[2]) for results in (off, on[0]))
    assert before > 1.5 and after < 0.4 * before


def test_nothing_else_gets_worse(jump, body, off, on):
    motion, begin, _, _ = jump
    truth = np.array([motion.at(begin + k * DT) for k in range(len(off))])
    errors, lowest = [], []
    for results in (off, on[0]):
        joints = np.array([r.positions_m for r in results])
        errors.append(np.linalg.norm(joints[:, OUTPUT_OF_CANONICAL_INDEX] - truth, axis=2).mean())
        lowest.append(joints[..., 2].min())
    assert errors[1] < errors[0] + 5e-4
    assert lowest[1] > min(lowest[0], 0.0) - 1e-3
    low, high = body.range_rad.T
    hinges = np.array([r.configuration[7:] for r in on[0]])
    assert np.maximum(low - hinges, hinges - high).max() < np.radians(0.1)


def test_the_report_says_what_was_gained(on):
    said = on[1]["physics_figures"]
    assert 0.4 < said["kept_share"] <= 1.0
    for name in ("residual_force_n", "residual_moment_nm", "sole_sunk_mm"):
        assert said[f"{name}_after"] < 0.9 * said[f"{name}_before"], name
    assert said["torque_excess_nm_after"] < said["torque_excess_nm_before"] + 0.1
    assert said["foot_slide_cm_s_after"] < said["foot_slide_cm_s_before"] + 0.1
    assert "body weights" in on[1]["physics"]


def test_equal_input_gives_equal_bits(live, calibration, on):
    again, report = finished(live, calibration, "physics=on")
    assert report == on[1]
    assert all(np.array_equal(a.positions_m, b.positions_m) for a, b in zip(again, on[0], strict=True))


def test_windows_do_not_show(live, calibration, on, monkeypatch):
    monkeypatch.setattr(finishing, "WINDOW", 110)
    other = finished(live, calibration, "physics=on")[0]
    away = [
        np.linalg.norm(a.positions_m - b.positions_m, axis=1).max() for a, b in zip(other, on[0], strict=True)
    ]
    assert np.mean(away) < 1e-3 and max(away) < 0.02, f"{1e3 * max(away):.1f} mm"


def test_without_known_contacts_and_over_a_gap(live, calibration):
    parts = live[:90] + live[150:153] + live[200:]
    results, report = finished(parts, calibration, "physics=on", "floor_contact=off", "human_limits=off")
    assert len(results) == len(parts) and np.isfinite([r.positions_m for r in results]).all()
    assert report["physics_figures"]["kept_share"] < 1.0


def test_it_corrects_finished_takes_only(calibration):
    with refused(SettingsError, "settings.physics_needs_finish"):
        solve_frames([], calibration, parse_settings("studio", ["physics=on"]))
