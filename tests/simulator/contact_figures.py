"""How deep finished performers overlap, and how far apart hands are that hold each other, with and without the steps
of finishing that make room between performers."""

import argparse
import os
import tempfile
from pathlib import Path
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

import studio
from studio.engine.metrics.reference.reference import read_reference
from studio.engine.model.joints import OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.poses import Poses
from studio.engine.whole_take import together
from studio.engine.whole_take.finish.contact.others import Surfaces, hands_apart_m, holding, overlap_m
from studio.take.folder.evaluating import evaluate_performers
from studio.take.folder.references import HowAligned

DEEP_M = 0.02


def surfaces(poses: Poses, height_m: float) -> Surfaces:
    """The surfaces of a solve's performer."""
    times_ns = np.round(poses.time_s * 1e9).astype(np.int64)
    return Surfaces(times_ns, poses.positions_m[:, OUTPUT_OF_CANONICAL_INDEX], height_m)


def deep_percent(one: Surfaces, other: Surfaces) -> float:
    """Share of frames in which two performers overlap by more than 2 cm."""
    return 100.0 * float((overlap_m(one, other) > DEEP_M).mean())


def gap_mm(one: Surfaces, other: Surfaces, held: NDArray[np.bool_]) -> float:
    """Median distance of hands where they truly hold each other."""
    apart = hands_apart_m(one.sites, other.at(one.times_ns, 10_000_000))
    return 1e3 * float(np.median(apart[held])) if held.any() else float("nan")


def measured(take: Path, references: dict[str, Path], height_m: float, beside: int) -> str:
    """Return the figures of a solve by preset `finish` with this many steps that make room between performers."""
    with patch.object(together, "STEPS_BESIDE", beside):
        studio.solve(studio.open_take(take), "finish")
    truth = {name: read_reference(path) for name, path in references.items()}
    found = evaluate_performers(studio.open_take(take), truth, ["finish"], HowAligned())["finish"]
    one, other = (
        surfaces(studio.load_poses(studio.open_take(take), "finish", name), height_m) for name in references
    )
    true = [_true(reference, height_m) for reference in truth.values()]
    held = holding(true[0].sites, true[1].at(true[0].times_ns, 10_000_000), 1 / 120)
    near = np.clip(np.searchsorted(true[0].times_ns, one.times_ns), 0, len(held) - 1)
    mm = " ".join(f"{figures['mpjpe_mm']:.1f}" for figures in found["performers"].values())
    return (
        f"{mm} mm, deep {deep_percent(one, other):.1f} % (truth {deep_percent(*true):.1f} %), "
        f"held hands {gap_mm(one, other, held[near]):.0f} mm apart"
    )


def _true(reference, height_m: float) -> Surfaces:

    times_ns = np.round(reference.time_s * 1e9).astype(np.int64)
    return Surfaces(times_ns, reference.positions_m, height_m)


def main() -> None:
    """Print the figures of simulated pairs, with and without."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.contact_figures", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    parser.add_argument("--meeting", nargs="+", default=["embracing", "lifting"])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("motions", nargs=2)
    chosen = parser.parse_args()
    motions = [name if name == "demo" else chosen.data / "mocap" / f"{name}.bvh" for name in chosen.motions]
    for meeting in chosen.meeting:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "take"
            take = studio.simulate(motions, path, cameras=3, seed=chosen.seed, meeting=meeting)
            studio.calibrate(take)
            references = {f"performer_{k}": Path(folder) / f"take.truth.performer_{k}.csv" for k in (1, 2)}
            for beside in (0, together.STEPS_BESIDE):
                told = measured(path, references, 1.75, beside)
                print(f"{meeting} {' '.join(chosen.motions)}, {beside} steps: {told}", flush=True)


if __name__ == "__main__":
    main()
