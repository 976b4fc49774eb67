"""Simulated cameras of several performers: who is there when, and that every camera's client sends all bodies."""

import numpy as np
import pytest

from studio import wire
from studio.camera.client.link import _encode
from studio.camera.simulated.skeletons import SimulatedConfig, SimulatedCrowdSource
from studio.camera.sources.registry import parse_source
from studio.engine.base.errors import SettingsError
from studio.simulator.crowd.stage import body_of, crowd_stage
from tests.refused import refused

BEGIN_S = 1000


@pytest.fixture(scope="module")
def source() -> SimulatedCrowdSource:
    opened = parse_source(f"simulated:0/3:0:2:{BEGIN_S}").open()
    assert isinstance(opened, SimulatedCrowdSource)
    return opened


def test_the_text_says_how_many_and_when():
    assert parse_source("simulated:1/3:0:2:1000") == SimulatedConfig(1, 3, 0, 2, 1000)
    for text in ("simulated:0/2:0:5", "simulated:0/2:0:0"):
        with refused(SettingsError, "source.performers"):
            parse_source(text)


def test_one_walks_alone_then_all_are_seen(source):
    alone_s = source._meeting.calibration_s
    seen = []
    for time_s in (5.0, alone_s - 1.0, *(alone_s + 2.0 + np.arange(20) / 30)):
        frame = source.frame_at(round((BEGIN_S + time_s) * 1e9))
        seen.append(0 if frame is None else 1 + len(frame.others))
    assert seen[:2] == [1, 1] and seen[-1] == 2
    frame = source.frame_at(round((BEGIN_S + alone_s + 3.0) * 1e9))
    message = wire.decode(_encode(7, frame))
    assert isinstance(message, wire.SkeletonFrame)
    bodies = wire.each_body(message)
    assert [one.body for one in bodies] == [frame.body, frame.others[0].body] and len({*seen}) == 2
    across = [one.positions[0, 0] for one in (frame, *frame.others)]
    assert across[1] - across[0] == pytest.approx(2.0, abs=0.2)


def test_the_loop_goes_on_without_a_leap_and_bodies_differ():
    meeting = crowd_stage(3)
    first = meeting.motions[0].positions_m
    assert np.abs(first[-1] - first[0]).max() < 0.02
    heights = [body_of(who)[0, 2] for who in range(4)]
    assert min(abs(a - b) for k, a in enumerate(heights) for b in heights[:k]) > 0.01
