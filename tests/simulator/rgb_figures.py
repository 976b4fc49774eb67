"""The whole chain of ordinary cameras, against the truth: simulated, calibrated by the walk, finished.

Each motion of `STUDIO_TEST_DATA/mocap` with some seeds, in front of the standard rigs of 2, 3 and 4 cameras. The
performer's height is given, and nothing else of the body or the cameras.
"""

import argparse
import os
import tempfile
from itertools import product
from pathlib import Path

import numpy as np

import studio
from studio.simulator.landmarks.body import stature_m
from studio.simulator.motion import stage_motion

SEEDS = (1, 2, 3)
RIGS = (2, 3, 4)


def error_mm(motion: Path, cameras: int, seed: int, folder: Path) -> tuple[float, float]:
    """Return the finished solve's mean error of the joints, aligned as a whole; and the same without hips and neck.

    Landmarks show neither: they are placed as in HumanIK's default character, and the recordings have them elsewhere.
    """
    take = studio.simulate(motion, folder / "take", cameras=cameras, tracker="rgb", seed=seed)
    studio.calibrate(take, height_m=stature_m(stage_motion(motion)[0].offsets_m))
    studio.solve(take, "finish", name="finish")
    found = studio.evaluate(take, folder / "take.truth.csv", ["finish"])
    figures = found["finish"]
    others = [
        figures["per_joint_mm"][one] for one in figures["matched_joints"] if one not in ("hips", "neck")
    ]
    return float(figures["mpjpe_mm"]), float(np.mean(others))


def main() -> None:
    """Print the errors by rig."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.rgb_figures", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    parser.add_argument("--seeds", type=int, default=len(SEEDS), help="how many seeds")
    parser.add_argument("--cameras", type=int, nargs="*", default=RIGS, help="the rigs")
    chosen = parser.parse_args()
    motions = sorted((chosen.data / "mocap").glob("*.bvh"))
    for cameras in chosen.cameras:
        errors = []
        for motion, seed in product(motions, SEEDS[: chosen.seeds]):
            with tempfile.TemporaryDirectory() as folder:
                try:
                    errors.append(error_mm(motion, cameras, seed, Path(folder)))
                    told = f"{errors[-1][0]:.1f} mm, without hips and neck {errors[-1][1]:.1f}"
                except studio.StudioError as error:
                    told = f"refused: {error}"
                print(f"{cameras} cameras, {motion.stem}, seed {seed}: {told}", flush=True)
        (mean, others), worst = np.mean(errors, axis=0), np.max(errors, axis=0)[0]
        print(
            f"{cameras} cameras: mean {mean:.1f} mm, worst {worst:.1f}, without hips and neck {others:.1f}; "
            f"{len(errors)} of {len(motions) * chosen.seeds} solved",
            flush=True,
        )


if __name__ == "__main__":
    main()
