"""Figures of several performers through the whole chain: simulated, calibrated by the first one, solved, finished.

Pairs of the motions of `STUDIO_TEST_DATA/mocap` meet in every way in front of a standard rig.
"""

import argparse
import os
import tempfile
from itertools import cycle
from pathlib import Path

import numpy as np

import studio
from studio.engine.metrics.results import SeveralEvaluation
from studio.simulator.crowd.meeting import MEETINGS
from studio.take.folder.evaluating import evaluate_performers
from studio.take.folder.references import HowAligned


def figures(
    motions: list[Path], cameras: int, seed: int, meeting: str, preset: str, folder: Path
) -> SeveralEvaluation:
    """Return the figures of a solve."""
    from studio.engine.metrics.reference.reference import read_reference

    take = studio.simulate(motions, folder / "take", cameras=cameras, seed=seed, meeting=meeting)
    studio.calibrate(take)
    studio.solve(take, preset)
    names = [f"performer_{k + 1}" for k in range(len(motions))]
    references = {name: read_reference(folder / f"take.truth.{name}.csv") for name in names}
    return evaluate_performers(take, references, [preset], HowAligned())[preset]


def main() -> None:
    """Print the figures of each take, and how many were right."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.crowd_figures", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    parser.add_argument("--takes", type=int, default=50)
    parser.add_argument("--performers", type=int, default=2)
    parser.add_argument("--cameras", type=int, default=3)
    parser.add_argument("--preset", default="finish")
    chosen = parser.parse_args()
    motions = sorted((chosen.data / "mocap").glob("*.bvh"))
    rng, right, missed, errors = np.random.default_rng(7), 0, [], []
    for seed, meeting in zip(range(chosen.takes), cycle(MEETINGS), strict=False):
        mine = [motions[k] for k in rng.choice(len(motions), chosen.performers, replace=False)]
        told = f"{seed} {' '.join(path.stem for path in mine)}, {meeting}:"
        with tempfile.TemporaryDirectory() as folder:
            try:
                found = figures(mine, chosen.cameras, seed, meeting, chosen.preset, Path(folder))
            except studio.StudioError as error:
                print(told, f"refused: {error}", flush=True)
                continue
        right += found["identity_switches"] == 0
        missed.append(found["missed_percent"])
        errors.append([one["mpjpe_mm"] for one in found["performers"].values()])
        mm = " ".join(f"{error:.1f}" for error in errors[-1])
        print(
            told, f"{mm} mm, {found['identity_switches']} switches, {missed[-1]:.1f} % missed, "
            f"{found['undecided_percent']:.1f} % undecided", flush=True,
        )  # fmt: skip
    print(
        f"{right} of {chosen.takes} without a switch; missed {np.mean(missed):.1f} % on average, "
        f"{np.max(missed):.1f} at most; error {np.mean(errors):.1f} mm, median {np.median(errors):.1f}"
    )


if __name__ == "__main__":
    main()
