"""Left and right of cameras around a pin: they continue where all cameras exchange them at once."""

import numpy as np

from studio.engine.model.joints import INDEX, JOINT_COUNT, MIRROR
from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.sides import exchanged_sides
from tests.live.performer import joints_m

COUNT, CAMERAS = 120, 3


def test_sides_go_on_where_all_cameras_exchange_them_at_once():
    """Most cameras exchange their sides for a while, then all do, on a turning body."""
    rng = np.random.default_rng(5)
    true = np.array([joints_m(STEP_S * k) for k in range(COUNT)])
    centre = true[:, INDEX["hips"]].mean(axis=0)
    for k in range(COUNT):
        c, s = np.cos(0.1 * k), np.sin(0.1 * k)
        true[k] = centre + (true[k] - centre) @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T
    exchanged = np.zeros((COUNT, CAMERAS), dtype=bool)
    exchanged[30:50, :2] = exchanged[50:65] = True
    tracks = true[:, None] + 0.01 * rng.normal(size=(COUNT, CAMERAS, JOINT_COUNT, 3))
    tracks[70:74] = np.nan  # a gap
    tracks = np.where(exchanged[..., None, None], tracks[:, :, MIRROR], tracks)
    found = exchanged_sides(tracks)
    assert (found != exchanged).sum() <= 2
