"""Whole takes of simulated performers by the preset `finish`, from skeletons to figures: who keeps their identity,
who is missed, and how far from the truth. One line for each take."""

import argparse
import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from time import process_time
from unittest.mock import patch

import studio
from studio.engine.base.errors import StudioError
from studio.engine.metrics.reference.reference import read_reference
from studio.engine.metrics.results import SeveralEvaluation
from studio.simulator import simulate
from studio.simulator.motion import stage_motion
from studio.take.folder.evaluating import evaluate_performers
from studio.take.folder.references import HowAligned
from tests.simulator.crowd_people import TAKES, WAYS, take_of


def rounds(seeds: int) -> Iterator[int]:
    """Return numbers of takes for `take_of`: each round has all ten motions, and each way twice."""
    motions = TAKES // len(WAYS)
    for turn in range(seeds):
        for motion in range(motions):
            yield motion * len(WAYS) + (motion + turn) % len(WAYS)


def finished(
    motions: Sequence[str | Path], way: str, cameras: int, seed: int, folder: Path, most_s: float
) -> SeveralEvaluation:
    """Simulate, calibrate, solve by `finish`, and return the figures; those who enter together may have any order.

    Raises:
        StudioError: the take could not be calibrated, or has other performers than were simulated.
    """

    def shortened(path: str | Path, **given):
        motion, calibration_s = stage_motion(path, **given)
        kept = slice(0, round(most_s / motion.frame_s))
        parts = {"positions_m": motion.positions_m[kept], "hands_open": motion.hands_open[kept]}
        return replace(motion, **parts), calibration_s

    with patch.object(simulate, "stage_motion", shortened):
        take = studio.simulate(motions, folder / "take", cameras=cameras, seed=seed, meeting=way)
    studio.calibrate(take)
    studio.solve(take, "finish")
    names = [f"performer_{k + 1}" for k in range(len(motions))]
    found = take.performer_names("finish")
    if sorted(found) != names:
        raise StudioError("test.performers", "{found}: {count} performers", found=found, count=len(found))
    truths = [read_reference(folder / f"take.truth.{name}.csv") for name in names]
    every = []
    for others in permutations(truths[1:]):
        references = dict(zip(names, [truths[0], *others], strict=True))
        every.append(evaluate_performers(take, references, ["finish"], HowAligned())["finish"])
    return min(every, key=lambda one: max(own["mpjpe_mm"] for own in one["performers"].values()))


def main() -> None:
    """Print the figures of each take as it is done."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.crowd_finish", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    parser.add_argument("--performers", type=int, default=2)
    parser.add_argument("--cameras", type=int, default=3)
    parser.add_argument("--takes", type=int, default=TAKES, help="how many; each ten have all motions")
    parser.add_argument("--seconds", type=float, default=10.0, help="longest performance after the T-pose")
    parser.add_argument("--seed", type=int, default=3000, help="of take 0; that of the next is one more")
    parser.add_argument("--only", type=int, nargs="+", help="numbers of takes, in place of all")
    parser.add_argument("--keep", type=Path, help="folder for the takes")
    chosen = parser.parse_args()
    for number in chosen.only or [*rounds(len(WAYS))][: chosen.takes]:
        motions, way = take_of(number, chosen.performers, chosen.data)
        began = process_time()
        with tempfile.TemporaryDirectory() as other:
            folder = Path(other) if chosen.keep is None else chosen.keep / f"{chosen.performers}_{number}"
            folder.mkdir(parents=True, exist_ok=True)
            try:
                told = _told(
                    finished(motions, way, chosen.cameras, chosen.seed + number, folder, chosen.seconds)
                )
            except StudioError as error:
                told = f"FAILED {error}"
        names = " ".join(Path(path).stem for path in motions)
        print(f"{number} {names}, {way}: {told}, {process_time() - began:.0f} s", flush=True)


def _told(figures: SeveralEvaluation) -> str:
    mm = " ".join(f"{own['mpjpe_mm']:.1f}" for own in figures["performers"].values())
    return (
        f"{figures['identity_switches']} switches, {figures['missed_percent']:.2f} % missed, "
        f"{figures['undecided_percent']:.2f} % undecided, {mm} mm"
    )


if __name__ == "__main__":
    main()
