"""Every switch in any combination: all pairs of values, on a short motion with noise, gaps and spikes."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.geometry import matrices
from studio.engine.model.frames import HandSeen
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import JOINT_COUNT, OUTPUT_INDEX, OUTPUT_PARENTS
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.pipeline import Pipeline
from studio.engine.solve.timing.schedule import Schedule
from tests.engine.combinations import available, pairwise
from tests.engine.walkers import SECOND, humanoid, performer, recorded, site_positions, stage

STAGE = stage(-35.0, 35.0)
COMBINATIONS = pairwise(available())


def at_the_limits(time_s):
    """The performer with every hinge swinging to the ends of its range, shape (21, 3) [m]."""
    body = humanoid()
    low, high = body.range_rad.T
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    reach = 0.3 + 0.7 * min(1.0, time_s - 1.0)  # with growing range
    q = body.rest_qpos
    q[7:] = middle + reach * half * np.sin(2 * np.pi * 0.6 * time_s + np.arange(len(half)))
    return site_positions(body, q)


def disturbed_frames():
    """1.2 s of two cameras: noise, joints that drop out or jump, 0.2 s without a person, hand states that flicker."""
    rng = np.random.default_rng(1)
    for frame in recorded(STAGE, at_the_limits, 1.2, noise_m=0.015):
        positions = frame.positions.copy()
        positions[rng.random(JOINT_COUNT) < 0.1] = np.nan
        positions[rng.random(JOINT_COUNT) < 0.05] += rng.normal(0, 0.5, 3)
        if 1.6 < frame.device_time_ns / SECOND < 1.8:
            positions[:] = np.nan
        hands = (HandSeen("left", "shape", rng.random()), HandSeen("right", "circles", rng.random()))
        yield replace(frame, positions=positions, confidence=np.ones(JOINT_COUNT), hands=hands)


def run(settings):
    pipeline, schedule, results = Pipeline(STAGE, settings), Schedule(settings.output_hz), []
    for frame in disturbed_frames():
        pipeline.add_frame(frame)
        results += [pipeline.step(stage_ns) for stage_ns in schedule.due(pipeline.newest_stage_ns())]
    return [r for r in results if r is not None]


def excess_deg(settings, results):
    """How far the output is outside its ranges, including fingers: the largest excess, and the name of its hinge."""
    full = build_humanoid(Skeleton.of(performer()), flexibility=settings.flexibility)
    low, high = full.range_rad.T
    worst, name = 0.0, ""
    for r in results:
        q = configuration_of(full, r.positions_m[0], matrices(r.rotations_wxyz), limited=False)[7:]
        over = np.maximum(low - q, q - high)
        if over.max() > worst:
            worst, name = float(over.max()), full.model.joint(int(over.argmax()) + 1).name
    return np.degrees(worst), name


def test_the_combinations_hold_every_pair():
    assert 30 <= len(COMBINATIONS) <= 80
    wanted = {f"{key}={value}" for key, values in available().items() for value in values}
    assert {item for row in COMBINATIONS for item in row} == wanted


@pytest.mark.parametrize("combination", COMBINATIONS, ids=[str(k) for k in range(len(COMBINATIONS))])
def test_any_combination_gives_a_human(combination):
    settings = parse_settings("studio", combination)
    results = run(settings)
    assert len(results) > 0.9 * settings.output_hz
    lengths = np.linalg.norm(Skeleton.of(performer()).offsets_m, axis=1)[1:]
    for r in results:
        assert np.isfinite(r.positions_m).all() and np.abs(r.positions_m).max() < 20
        assert np.isfinite(r.rotations_wxyz).all() and np.isfinite(r.confidence).all()
        assert np.abs(np.linalg.norm(r.rotations_wxyz, axis=1) - 1).max() < 1e-9
        if settings.ik != "none":
            bones = r.positions_m[1:] - r.positions_m[OUTPUT_PARENTS[1:]]
            assert np.abs(np.linalg.norm(bones, axis=1) - lengths).max() < 1e-9
        if settings.ik != "none" and settings.floor_contact == "on":
            assert r.positions_m[OUTPUT_INDEX["LeftToeBase"], 2] > -0.01
    if settings.ik != "none" and settings.human_limits == "on":
        worst, name = excess_deg(settings, results)
        assert worst < 0.1, f"{name} is {worst:.2f} degrees outside its range: {' '.join(combination)}"
