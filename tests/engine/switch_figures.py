"""The figures of docs/switches.md: `python -m tests.engine.switch_figures` (a minute).

Two recordings of noisy joints, preset `studio` with one switch changed. Each line has error [mm], error of
acceleration [m/s2], foot slide [cm/s] and lag [ms] of the first / the second.
"""

import os
import sys
import tempfile
from pathlib import Path

from studio.engine.calibration.calibrate import with_performer
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.reference.reference import read_reference
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.offline.tracking import calibrate_take
from studio.take.importers import import_recording
from studio.take.raw.frames import camera_frames
from studio.take.raw.kept_frames import Joined

RECORDINGS = ("punches_2", "jumps_2")
FIGURES = ("mpjpe_mm", "acceleration_error_m_s2", "foot_slide_cm_s", "latency_ms")
PRESETS = ("finish", "studio", "thesis", "raw")
CHANGED = (
    "fusion=mean",
    "ik=none",
    "ik=previous_pose",
    "ik=combined_skeleton",
    "human_limits=off",
    "flexibility=0",
    "flexibility=2",
    "relax_pose=0.1",
    "output_hz=30",
    "bone_length_limit=2",
    "bone_length_limit=10",
    "displacement_limit=before",
    "displacement_limit=after",
    "smoothing=holt:after",
    "smoothing=one_euro:before",
    "smoothing=one_euro:after",
    "floor_contact=off",
)


class Recording:
    """A recording of the outside data, imported and calibrated by the product."""

    def __init__(self, folder: Path, out: Path) -> None:
        take = import_recording(folder, out)
        calibrated = calibrate_take(take)
        frames = camera_frames(take.raw_path)
        self._calibration = with_performer(calibrated, frames)
        self._frames = Joined(list(frames.values()))
        self._start_s = take.meta["calibration_s"]
        self._reference = read_reference(folder / "truth" / "joints.csv")

    def figures(self, preset: str, *assignments: str) -> list[float]:
        """`FIGURES` of one solve."""
        poses = solve_frames(
            self._frames, self._calibration, parse_settings(preset, assignments), start_s=self._start_s
        )
        found = evaluate(poses, self._reference, start_s=self._start_s)
        return [found[name] for name in FIGURES]


def main() -> None:
    data = Path(os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data"))
    with tempfile.TemporaryDirectory() as folder:
        takes = [
            Recording(data / "noisy_joints" / f"{name}_cameras", Path(folder) / name) for name in RECORDINGS
        ]
        for preset, *changed in [(preset,) for preset in PRESETS] + [("studio", one) for one in CHANGED]:
            pairs = zip(*(take.figures(preset, *changed) for take in takes), strict=True)
            told = "   ".join(" / ".join(f"{value:.1f}" for value in pair) for pair in pairs)
            sys.stdout.write(f"{' '.join([preset, *changed]):34s}{told}\n")


if __name__ == "__main__":
    main()
