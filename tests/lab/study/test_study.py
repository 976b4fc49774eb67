"""A study in short: planned, run on two processes, resumed, written down."""

import json
from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, SettingsError
from studio.lab.study.page import write_study
from studio.lab.study.plan import PRESETS, THESIS, Cell, Study, StudyRecording, Variant, make_plan
from studio.lab.study.results import Results
from studio.lab.study.run import CELLS, read_cells, run_study
from studio.lab.study.thesis_tables import COMPONENTS, TABLES
from studio.simulator.joints.interference import disturb
from tests.refused import refused


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """Two recordings of a few solves each, run."""
    out = tmp_path_factory.mktemp("study")
    raw, finish = (one for one in PRESETS if one.name in ("raw", "finish"))
    solves = [raw, *(one for one in THESIS if one.name in ("previous_pose", "limits_relax"))]
    cells = [Cell(StudyRecording("punches", "", 1, False, 0), one) for one in solves]
    cells += [Cell(StudyRecording("punches", "", 2, True, 0), one) for one in (raw, finish)]
    study = Study(("punches",), (1, 2), 1, tuple(cells))
    shares = []
    assert run_study(study, out, processes=2, progress=shares.append) == len(cells)
    assert shares[0] == 0.0 and shares[-1] == 1.0
    return study, out


def test_a_study_goes_on_where_it_was(small):
    study, out = small
    first = json.loads((out / CELLS / f"{study.cells[0].key}.json").read_text())
    assert run_study(study, out) == 0
    damaged = out / CELLS / f"{study.cells[0].key}.json"
    damaged.write_text("{")
    assert run_study(study, out, processes=1) == 1
    again = json.loads(damaged.read_text())
    assert again["figures"] == first["figures"]


def test_cells_have_figures_and_what_a_switch_moved(small):
    study, out = small
    cells = {(cell["variant"], cell["cameras"]): cell for cell in read_cells(study, out)}
    assert len(cells) == 5 and not any(cell["problem"] for cell in cells.values())
    moved, frames = cells["limits_relax", 1]["moved_10cm"]
    assert 0 < moved <= frames
    figures = cells["finish", 2]["figures"]
    assert figures["mpjpe_mm"] < cells["raw", 1]["figures"]["mpjpe_mm"]
    assert set(figures["thesis_joints"]) == {"elbow", "shoulder"}


def test_the_page_says_what_was_measured(small):
    study, out = small
    path = write_study(study, read_cells(study, out), {("everything", "one camera, raw"): (9, 10)}, out)
    html = path.read_text()
    for table in ("5.1", "5.2", "5.3", "5.6"):
        assert f"<h2>{table} " in html
    assert "thesis 14.4" in html and "single recording" in html and "(3437 of 6227)" in html
    assert (out / "plots" / "table_5_1_absolute_difference_cm.svg").is_file()
    told = json.loads((out / "study.json").read_text())
    assert told["cells"] == told["cells_done"] == 5 and told["cpu_s"] > 0


def test_every_table_and_component_is_in_a_plan():
    planned = {
        (cell.variant.name, cell.recording.cameras, cell.recording.interference)
        for cell in make_plan((), cameras=(1, 2, 3, 4), seeds=1, unit_m=None).cells
    }
    conditions = [condition for table in TABLES for condition in table.conditions]
    conditions += [condition for one in COMPONENTS for condition in (one.condition, one.base)]
    for condition in conditions:
        assert (condition.variant, condition.cameras, condition.interference) in planned, condition


def test_keys_follow_all_that_matters(tmp_path):
    cell = Cell(StudyRecording("punches", "", 2, True, 0), Variant("a", "studio"))
    others = [
        replace(cell, recording=replace(cell.recording, seed=1)),
        replace(cell, recording=replace(cell.recording, interference=False)),
        replace(cell, variant=Variant("a", "studio", ("ik=none",))),
    ]
    assert len({one.key for one in (cell, *others)}) == 4
    for folder in ("one", "two"):  # a file may lie anywhere
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "m.bvh").write_text("motion")
    plans = [
        make_plan((tmp_path / folder / "m.bvh",), cameras=(1,), seeds=1, unit_m=None)
        for folder in ("one", "two")
    ]
    assert [cell.key for cell in plans[0].cells] == [cell.key for cell in plans[1].cells]


def test_a_plan_refuses_what_it_cannot_do(tmp_path):
    with refused(FormatError, "study.no_motion"):
        make_plan((tmp_path / "x.bvh",), cameras=(1,), seeds=1, unit_m=None)
    with refused(SettingsError, "study.seeds", n=0):
        make_plan((), cameras=(1,), seeds=0, unit_m=None)


def test_interference_grows_with_the_cameras():
    joints = np.tile([0.0, 0.0, 3.5], (600, 21, 1))
    sure = np.full((600, 21), 0.9)
    lost, noise = [], []
    for cameras in (1, 2, 3, 4):
        seen, confidence = disturb(joints, sure, cameras, np.random.default_rng(1))
        there = np.isfinite(seen).all(axis=(1, 2))
        lost.append(1.0 - there.mean())
        noise.append(float(np.std(seen[there] - joints[there])))
        assert (confidence[~there] == 0.0).all()
    assert lost[:3] == [0.0, 0.0, 0.0] and lost[3] > 0.5
    assert noise[0] == 0.0 < noise[1] < noise[2]


def cell_of(variant: str, cameras: int, seed: int, value: float) -> dict:
    figures = dict.fromkeys(("absolute_difference_cm", "shortest_distance_cm", "spike_difference", "deviations",
                             "mpjpe_mm", "cleanup_events_per_min", "latency_ms"), value)  # fmt: skip
    return {"motion": "m", "seed": seed, "cameras": cameras, "interference": cameras > 1, "variant": variant,
            "problem": "", "figures": figures}  # fmt: skip


def test_words_follow_from_figures():
    from studio.lab.study.words import findings, headline

    rng = np.random.default_rng(0)
    cells = []
    for seed in range(8):
        noise = float(rng.normal(0, 0.1))
        cells += [cell_of("raw", 1, seed, 10 + noise), cell_of("raw", 2, seed, 8 + noise)]
        cells += [cell_of("raw", 3, seed, 7 + noise), cell_of("thesis", 2, seed, 5 + noise)]
    results = Results(cells)
    told = {one.text.split(":")[0]: one.verdict for one in findings(TABLES[0], results)}
    assert told["2 cameras, absolute difference"] == "agrees"  # both fall
    assert told["3 cameras, absolute difference"] == "differs"  # falls here, rises there
    assert "which is reached" in headline(results)[0]
    change = results.change(TABLES[0].base, TABLES[0].conditions[1], "mpjpe_mm")
    assert change is not None and change.direction == -1 and change.count == 8
