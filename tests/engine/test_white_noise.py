"""How well a solve handles joints with independent errors: one camera, `white_noise`.

The bars are 2.4 cm and 26 m/s2 live, 1.5 cm and 6 m/s2 finished. The live solve meets the second everywhere; it meets
the first on `02_05` and `14_08`, and misses it on `49_02` by a tenth of a millimetre. Finishing meets both on `02_05`
and `14_08`. The limits in the tests are the reached values. `05_06` has joints that jump (a knee at 47 m/s) and
angles that no human has: `white_noise_parts` shows the causes of the error, `known_accelerations` what could be
gained.
"""

import pytest

from tests.engine.white_noise import TUNED_ON, solved_figures
from tests.engine.white_noise_parts import parts

LIVE_RMS_CM = {"02_05": 1.85, "14_08": 2.4, "05_06": 4.3, "49_02": 2.6}
LIVE_BEGINNING_RMS_CM = {"02_05": 1.65, "05_06": 5.3}
LIVE_ACCELERATION_M_S2 = {"02_05": 10.5, "14_08": 14.5, "05_06": 23.0, "49_02": 16.0}
FINISHED_RMS_CM = {"02_05": 1.2, "14_08": 1.5, "05_06": 3.05, "49_02": 1.7}
FINISHED_ACCELERATION_M_S2 = {"02_05": 3.1, "14_08": 4.9, "05_06": 11.9, "49_02": 6.3}


@pytest.mark.parametrize("motion", TUNED_ON)
def test_live_for_a_few_seconds(motion, test_data):
    found = solved_figures(test_data / "mocap" / f"{motion}.bvh", "studio", seconds=5.0)
    assert found.rms_cm < LIVE_BEGINNING_RMS_CM[motion]
    assert found.acceleration_error_m_s2 < LIVE_ACCELERATION_M_S2[motion] + 2.0


@pytest.mark.long
@pytest.mark.parametrize("motion", LIVE_RMS_CM)
def test_live(motion, test_data):
    found = solved_figures(test_data / "mocap" / f"{motion}.bvh", "studio")
    assert found.rms_cm < LIVE_RMS_CM[motion]
    assert found.acceleration_error_m_s2 < LIVE_ACCELERATION_M_S2[motion]


def test_finished_for_a_few_seconds(test_data):
    found = solved_figures(test_data / "mocap" / "02_05.bvh", "finish", seconds=5.0)
    assert found.rms_cm < FINISHED_RMS_CM["02_05"] + 0.2
    assert found.acceleration_error_m_s2 < FINISHED_ACCELERATION_M_S2["02_05"]


@pytest.mark.long
@pytest.mark.parametrize("motion", FINISHED_RMS_CM)
def test_finished(motion, test_data):
    found = solved_figures(test_data / "mocap" / f"{motion}.bvh", "finish")
    assert found.rms_cm < FINISHED_RMS_CM[motion]
    assert found.acceleration_error_m_s2 < FINISHED_ACCELERATION_M_S2[motion]


def test_what_is_left_without_noise_is_little_of_it_the_body(test_data):
    found = parts(test_data / "mocap" / "02_05.bvh", seconds=3.0)
    assert found["body"] < 0.15
    assert found["body"] <= found["ranges"] < 0.5
    assert found["ranges"] < found["no noise"] < found["finished"]
