import json

import numpy as np
import pytest

from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import invert_transform, is_rigid, transform_points
from studio.simulator.rig import read_rig, standard_rig
from tests.refused import refused


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_standard_rigs_look_at_the_stage(count):
    rig = standard_rig(count)
    assert [camera.name for camera in rig] == [f"camera_{k}" for k in range(count)]
    for k, camera in enumerate(rig):
        T = camera.T_stage_camera
        assert is_rigid(T)
        assert T[2, 3] == (1.0, 1.6)[k % 2]
        assert np.hypot(*T[:2, 3]) == pytest.approx(3.5)
        aim, left, up = transform_points(
            invert_transform(T), np.array([[0, 0, 1.0], [0.5, 0, 1.0], [0, 0, 1.5]])
        )
        np.testing.assert_allclose(aim[:2], 0, atol=1e-12)
        assert up[1] < aim[1]  # y down
        if T[1, 3] < -1:
            assert left[0] > aim[0]  # who faces the camera has the left hand on the picture's right


@pytest.mark.parametrize("count", [0, 5, -1])
def test_other_counts_need_a_file(count):
    with refused(FormatError, "simulator.rig_standard", most=4):
        standard_rig(count)


def test_a_rig_file(tmp_path):
    path = tmp_path / "rig.json"
    T = standard_rig(2)[1].T_stage_camera
    value = {"cameras": {"front": {"position_m": [0, -3, 1.2], "look_at_m": [0, 0, 0.8]},
                         "other": {"T_stage_camera": T.tolist()}}}  # fmt: skip
    path.write_text(json.dumps(value))
    front, other = read_rig(path)
    assert (front.name, other.name) == ("front", "other")
    np.testing.assert_allclose(front.T_stage_camera[:3, 3], [0, -3, 1.2])
    np.testing.assert_array_equal(other.T_stage_camera, T)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("{", "simulator.rig_not_json"),
        ("[]", "simulator.rig_no_cameras"),
        ('{"cameras": {}}', "simulator.rig_no_cameras"),
        ('{"cameras": {"a": {}}}', "simulator.rig_no_position"),
        ('{"cameras": {"a": 3}}', "simulator.rig_no_position"),
        ('{"cameras": {"../a": {"position_m": [0, -3, 1]}}}', "simulator.rig_camera_name"),
        ('{"cameras": {"a": {"position_m": [0, 3]}}}', "simulator.rig_numbers"),
        ('{"cameras": {"a": {"position_m": [0, NaN, 1]}}}', "simulator.rig_numbers"),
        (
            '{"cameras": {"a": {"position_m": [0, 0, 3], "look_at_m": [0, 0, 0]}}}',
            "simulator.rig_straight_down",
        ),
        ('{"cameras": {"a": {"T_stage_camera": [[1, 2], [3]]}}}', "simulator.rig_numbers"),
        (
            '{"cameras": {"a": {"T_stage_camera": [[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]}}}',
            "simulator.rig_not_rigid",
        ),
    ],
)
def test_a_rig_file_that_cannot_be_used(tmp_path, text, code: str):
    path = tmp_path / "rig.json"
    path.write_text(text)
    with refused(FormatError, code):
        read_rig(path)
