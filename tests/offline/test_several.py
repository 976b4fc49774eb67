"""Takes of two people, from their files to figures and exports, by the commands."""

import json
from pathlib import Path

import pytest

from studio.__main__ import main
from studio.engine.animation.motion.motion import Motion
from studio.engine.animation.read.files import read_animation
from studio.take.folder.take import Take

BARS = {
    "jump_punches_2_cameras": (32.0, 28.0),
    "punches_jacks_3_cameras": (25.0, 22.0),
    "ballet_punches_4_cameras": (28.0, 25.0),
}
"""Largest error of each performer [mm], by preset `studio` and `finish`."""


SHORTEST = "jump_punches_2_cameras"
"""It has the fewest cameras; the others are long."""


@pytest.mark.parametrize(
    "recording",
    [name if name == SHORTEST else pytest.param(name, marks=pytest.mark.long) for name in BARS],
)
def test_everybody_stays_themselves(recording, tmp_path, test_data, capsys):
    source = test_data / "two_performers" / recording
    if not source.is_dir():
        pytest.skip(f"no {source}")
    folder = tmp_path / "take"
    assert main(["import", str(source), "--out", str(folder)]) == 0
    assert main(["calibrate", str(folder)]) == 0
    presets = dict(zip(("studio", "finish"), BARS[recording], strict=True))
    for preset in presets:
        assert main(["solve", str(folder), "--preset", preset]) == 0
    take = Take.open(folder)
    assert take.solve_names() == ["finish", "studio"]
    assert take.performer_names("finish") == ["performer_1", "performer_2"]
    truth = {"performer_1": source / "truth" / "a", "performer_2": source / "truth" / "b"}
    references = [f"--reference={name}={of / 'joints.csv'}" for name, of in truth.items()]
    assert main(["evaluate", str(folder), *references, "--json", str(tmp_path / "f.json")]) == 0
    solves = json.loads((tmp_path / "f.json").read_text())["solves"]
    for preset, most_mm in presets.items():
        errors = [one["mpjpe_mm"] for one in solves[preset]["performers"].values()]
        assert len(errors) == 2 and max(errors) <= most_mm, (preset, errors)
        assert solves[preset]["identity_switches"] == 0
        assert solves[preset]["missed_percent"] <= 2 and solves[preset]["undecided_percent"] <= 5
    _exported(folder, tmp_path / "out", capsys)


def _exported(folder: Path, out: Path, capsys) -> None:
    """Each performer is a file of its own, or the one that is asked for."""
    out.mkdir()
    assert main(["export", str(folder), "--format", "bvh", "--out", str(out / "all.bvh")]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["all-performer_1.bvh", "all-performer_2.bvh"]
    one = ["export", str(folder), "--format", "bvh", "--out", str(out / "one.bvh"), "--performer"]
    assert main([*one, "performer_2"]) == 0
    assert (out / "one.bvh").read_bytes() == (out / "all-performer_2.bvh").read_bytes()
    motion = read_animation(out / "one.bvh")
    assert isinstance(motion, Motion) and len(motion.joint_names) > 20
    capsys.readouterr()
    assert main([*one, "performer_3"]) == 1
    assert "performer_1" in capsys.readouterr().err


DEPTH = "depth_punches_jacks_3_azure_kinect"
LIMBS = [
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
]
MOST_DEPTH_MM = {"points": 42.0, "per_camera": 42.0}


@pytest.mark.long
@pytest.mark.parametrize("tracker", MOST_DEPTH_MM)
def test_two_before_depth_cameras_stay_themselves(tracker, tmp_path, test_data):
    source = test_data / "two_performers" / DEPTH
    if not source.is_dir():
        pytest.skip(f"no {source}")
    folder, figures = tmp_path / "take", tmp_path / "f.json"
    assert main(["import", str(source), "--out", str(folder)]) == 0
    assert main(["solve", str(folder), "--preset", "studio", "--set", f"tracker={tracker}"]) == 0
    found = []
    for first, second in (("a", "b"), ("b", "a")):  # both were there from the beginning: any order will do
        truth = {"performer_1": first, "performer_2": second}
        references = [
            f"--reference={name}={source / 'truth' / of / 'joints.csv'}" for name, of in truth.items()
        ]
        assert main(["evaluate", str(folder), *references, "--json", str(figures)]) == 0
        found.append(json.loads(figures.read_text())["solves"]["studio"])
    best = min(found, key=lambda one: sum(_limbs_mm(own) for own in one["performers"].values()))
    errors = [_limbs_mm(own) for own in best["performers"].values()]
    assert len(errors) == 2 and max(errors) <= MOST_DEPTH_MM[tracker], errors
    assert best["identity_switches"] == 0 and best["missed_percent"] <= 2


def _limbs_mm(own) -> float:
    return sum(own["per_joint_mm"][name] for name in LIMBS) / len(LIMBS)
