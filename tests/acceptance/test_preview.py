"""A real client of a depth camera: the server has a picture of what it sees, and it ends with the server."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.acceptance.processes import server_process, wait_until
from tests.acceptance.test_devices_end import check_ended, connect


@pytest.mark.timeout(900)
def test_a_depth_camera_sends_previews(tmp_path: Path) -> None:
    """A click starts the client, as in `test_devices_end.py`, and the server ends in order."""
    with server_process(tmp_path / "sessions") as server:
        processes = connect(server)
        assert len(processes) >= 2
        wait_until(lambda: server.status()["cameras"].get("left", {}).get("previews", 0) > 3, "previews come")
        answer = server.http.get("/cameras/left/preview")
        status = server.status()["cameras"]["left"]
        server.close()
        check_ended(processes)
    assert status["machine"] != ""
    picture = np.asarray(Image.open(io.BytesIO(answer.content)))
    assert max(picture.shape) == 80
    assert np.unique(picture).size > 30 and (picture > 0).mean() > 0.3
