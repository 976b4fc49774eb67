"""Recordings of two people before the live stage: nobody becomes the other."""

import pytest

from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.offline.replay import solve_take
from studio.take.folder.take import POSES
from tests.live.recorded_shoot import RECORDINGS, figures

SHORTEST = "jump_punches_2_cameras"


@pytest.mark.parametrize(
    "recording",
    [name if name == SHORTEST else pytest.param(name, marks=pytest.mark.long) for name in RECORDINGS],
)
def test_everybody_stays_themselves_live(recording, tmp_path, test_data):
    source = test_data / "two_performers" / recording
    if not source.is_dir():
        pytest.skip(f"no {source}")
    take, found = figures(source, tmp_path)
    assert sorted(found["performers"]) == take.performer_names("live") == ["performer_1", "performer_2"]
    assert found["identity_switches"] <= 1
    assert found["missed_percent"] <= 2 and found["undecided_percent"] <= 5
    solve_take(take, preset("studio"), name="again", as_live=True)
    for name in take.performer_names("live"):
        live, again = (Poses.load(take.performer_folder(solve, name) / POSES) for solve in ("live", "again"))
        assert (live.positions_m == again.positions_m).all()
