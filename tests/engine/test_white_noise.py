"""How much a solve gets out of joints that err independently: one camera, `white_noise`.

The bars are 2.4 cm and 26 m/s2 live. The live solve meets the second everywhere, the first on `02_05` only; the
limits are what it reaches. In `05_06` legs are lifted beyond the ranges of an adult, which costs 3.4 cm without any
noise.
"""

import pytest

from tests.engine.white_noise import TUNED_ON, solved_figures

LIVE_RMS_CM = {"02_05": 2.4, "14_08": 2.9, "05_06": 5.3, "49_02": 3.2}
LIVE_ACCELERATION_M_S2 = 26.0


@pytest.mark.parametrize("motion", TUNED_ON)
def test_live_for_a_few_seconds(motion, test_data):
    found = solved_figures(test_data / "mocap" / f"{motion}.bvh", "studio", seconds=5.0)
    assert found.rms_cm < LIVE_RMS_CM[motion] + 0.4
    assert found.acceleration_error_m_s2 < LIVE_ACCELERATION_M_S2 + 2.0


@pytest.mark.long
@pytest.mark.parametrize("motion", LIVE_RMS_CM)
def test_live(motion, test_data):
    found = solved_figures(test_data / "mocap" / f"{motion}.bvh", "studio")
    assert found.rms_cm < LIVE_RMS_CM[motion]
    assert found.acceleration_error_m_s2 < LIVE_ACCELERATION_M_S2
