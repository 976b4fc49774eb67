"""The live depth source: its format, its rate, its clock."""

import asyncio

import numpy as np
import pytest

from studio.camera.simulated.depth_config import SimulatedDepthConfig
from studio.engine.base.errors import SettingsError
from tests.refused import refused


@pytest.mark.parametrize("argument", ["", "0", "2/2", "0/9", "a/2", "0/2:x", "-1/2"])
def test_a_wrong_argument_says_what_is_allowed(argument):
    with refused(SettingsError, "source.rig", kind="simulated-depth"):
        SimulatedDepthConfig.parse(argument)


def test_images_come_in_real_time():
    source = SimulatedDepthConfig(1, 2, 3).open()
    assert source.name == "camera_1" and source.realtime
    began = source.clock_ns()

    async def three():
        got = []
        async for stamp, depth_mm in source.frames():
            got.append((stamp, depth_mm, source.clock_ns()))
            if len(got) == 3:
                return got

    got = asyncio.run(asyncio.wait_for(three(), 120))
    stamps = [stamp for stamp, _, _ in got]
    assert (np.diff(stamps) > 0).all()
    for stamp, depth_mm, now in got:
        assert began - 50_000_000 < stamp <= now  # the first frame may have begun before
        assert depth_mm.dtype == np.uint16
        assert depth_mm.shape == (source.camera.height, source.camera.width)
        assert (depth_mm > 0).mean() > 0.3
