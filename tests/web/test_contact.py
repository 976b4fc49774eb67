"""Contact shadows under the feet: soft discs that shrink as a foot is lifted."""

import json
import struct

import numpy as np
import pytest

from studio.web.scene.performers.contact import sizes, spot


def test_a_spot_is_a_soft_disc_that_hides_nothing_of_the_floor() -> None:
    disc = spot()
    magic, version, length = struct.unpack("<4sII", disc[:12])
    assert (magic, version, length) == (b"glTF", 2, len(disc))
    size, kind = struct.unpack("<I4s", disc[12:20])
    head = json.loads(disc[20 : 20 + size])
    assert kind == b"JSON" and head["materials"][0]["alphaMode"] == "BLEND"  # readers write no depth for it
    data = disc[20 + size + 8 :]
    arrays = [data[view["byteOffset"] :][: view["byteLength"]] for view in head["bufferViews"]]
    points = np.frombuffer(arrays[0], "<f4").reshape(-1, 3)
    alpha = np.frombuffer(arrays[1], "<f4").reshape(-1, 4)[:, 3]
    faces = np.frombuffer(arrays[2], "<u2").reshape(-1, 3)
    away = np.linalg.norm(points, axis=1)
    assert away.max() == pytest.approx(1.0) and (alpha[away > 0.999] == 0.0).all() and alpha[0] == alpha.max()
    corners = points[faces]
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert (area > 0.0).all() and area.sum() == pytest.approx(np.pi, rel=0.01)


def test_a_spot_shrinks_as_the_foot_is_lifted() -> None:
    shares = sizes(np.array([-0.01, 0.0, 0.03, 0.06, 0.12, 0.5]))
    assert shares[0] == shares[1] == 1.0 and (np.diff(shares[1:5]) < 0.0).all() and shares[-1] == 0.0
