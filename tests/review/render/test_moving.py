"""Moving pictures of solves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from studio.engine.base.errors import SettingsError
from studio.review.render.moving import render_moving
from tests.refused import refused
from tests.review.render.figures import sidestep


def test_who_moves_is_seen_moving_at_the_speed_of_the_take(tmp_path: Path) -> None:
    walks = sidestep()
    stands = replace(walks, positions_m=walks.positions_m[:1].repeat(walks.frame_count, axis=0))
    beside = replace(stands, positions_m=stands.positions_m + np.array([0.0, -1.5, 0.0]))
    path = tmp_path / "moving.gif"
    render_moving({"finish": [walks, beside]}, path, span_s=(0.0, 0.8), size=(160, 120), yaw_deg=0.0)
    with Image.open(path) as picture:
        assert picture.size == (160, 120) and getattr(picture, "n_frames", 0) == 10
        assert picture.info["duration"] == 80
        shown = []
        for k in (0, 9):
            picture.seek(k)
            shown.append(np.asarray(picture.convert("RGB")).astype(int))
    changed = np.abs(shown[0] - shown[1]).sum(axis=2) > 60
    assert 0.002 < changed[20:].mean() < 0.3
    with refused(SettingsError, "picture.long"):
        render_moving({"finish": [walks]}, path, span_s=(0.0, 31.0))


@pytest.mark.parametrize("span_s", [(0.5, 0.5), (0.5, 0.1)])
def test_a_span_without_time_is_refused(span_s: tuple[float, float], tmp_path: Path) -> None:
    with refused(SettingsError, "picture.long"):
        render_moving({"finish": [sidestep()]}, tmp_path / "moving.gif", span_s=span_s)
