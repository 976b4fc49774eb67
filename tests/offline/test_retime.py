"""A take whose edits retime a part: its solve, what is looked at first, and what is offered are in one time."""

import json

import numpy as np
import pytest

from studio.engine.edits.edit import OffsetEdit, RetimeEdit
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.engine.whole_take.trace import Trace
from studio.offline.edits.first_look import look_at_edits
from studio.offline.edits.offered import offers_of_solve
from studio.offline.replay import solve_take
from studio.take.edits.change import change_edits
from studio.take.folder.solves import TRACE, time_map
from tests.web.edits.takes import solved_take


def test_a_retimed_solve_knows_its_stage_time(tmp_path):
    take = solved_take(tmp_path / "monday" / "walk")
    before = Poses.load(take.solve_folder("studio") / "poses.npz")
    begins_s = before.begins_s
    slower = RetimeEdit(id="slow", start_s=begins_s + 0.5, end_s=begins_s + 1.0, factor=2.0)
    later = {"start_s": begins_s + 1.5, "end_s": begins_s + 1.6}
    change_edits(take, [slower, OffsetEdit(id="up", joint="Hips", move_m=(0.0, 0.0, 0.3), **later)])
    folder = solve_take(take, preset("studio"), name="studio")
    poses, trace = Poses.load(folder / "poses.npz"), Trace.load(folder / TRACE)
    told = json.loads((folder / "metrics.json").read_text())
    assert told["edits"]["slow"] == {"honoured": True} and len(told["retimed"]) == 1
    times = time_map(take, "studio")
    raised = int(np.argmax(poses.positions_m[:, 0, 2]))
    assert times.stage_s(poses.time_s[raised]) == pytest.approx(begins_s + 1.55, abs=0.15)
    assert poses.time_s[-1] - before.time_s[-1] == pytest.approx(0.6, abs=0.05)  # half a second, and its ease
    np.testing.assert_allclose(trace.time_ns * 1e-9, poses.time_s, atol=1e-6)

    at_s = float(poses.time_s[raised])
    found = look_at_edits(take, preset("studio"), "studio", at_s)
    assert np.isin(found.time_s, poses.time_s).all()
    assert found.time_s[0] < at_s < found.time_s[-1]
    for one in offers_of_solve(take, "studio"):
        for edit in one.edits:
            assert times.solve_s(edit.start_s) <= one.event["peak_s"] + 0.02
