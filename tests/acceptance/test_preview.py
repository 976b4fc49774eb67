"""Real clients of a depth camera: the server has a small picture of what they see."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.acceptance.processes import CameraProcess, server_process, wait_until


@pytest.mark.timeout(900)
def test_a_depth_camera_sends_previews(tmp_path: Path) -> None:
    with server_process(tmp_path / "sessions") as server:
        camera = CameraProcess(tmp_path, server.url, 0, 2, source="simulated-depth")
        try:
            wait_until(
                lambda: server.status()["cameras"].get("camera_0", {}).get("previews", 0) > 3, "previews come"
            )
            answer = server.http.get("/cameras/camera_0/preview")
            status = server.status()["cameras"]["camera_0"]
        finally:
            camera.close()
    assert status["machine"] != ""
    picture = np.asarray(Image.open(io.BytesIO(answer.content)))
    assert max(picture.shape) == 80
    assert np.unique(picture).size > 30 and (picture > 0).mean() > 0.3
