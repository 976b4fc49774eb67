"""How well one edit corrects a fault that was put into a take on purpose.

`python -m tests.simulator.pin_figures TAKE=TRUTH ...` prints a line for each. `--simulated MOTIONS --folder TAKES`
draws two faults for each of ten simulated takes.
Each fault is solved, then corrected by one edit at the instant at which the solve is furthest off, with the true
place and 2 cm of noise, and solved again.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import Edit
from studio.engine.metrics.cleanup.solve import cleanup_figures
from studio.engine.metrics.reference.alignment import Alignment, align
from studio.engine.metrics.reference.matching import match
from studio.engine.metrics.reference.reference import Markers, Reference, read_reference
from studio.engine.model.joints import CANONICAL, INDEX, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.offline import replay
from studio.offline.tracking import calibrate_take
from studio.review.render.strip import render_strip
from studio.simulator.simulate import simulate_take
from studio.take.folder.take import Take
from studio.take.raw.frames import camera_frames
from tests.simulator.pin_faults import KINDS, LENGTHS_S, Fault, Frames, a_fault, faulty, mending

SIMULATED = (
    ("02_04", 3, 11), ("02_05", 2, 12), ("05_06", 4, 13), ("14_08", 3, 14), ("49_01", 2, 15), ("49_02", 3, 16),
    ("02_05", 4, 17), ("14_08", 2, 18), ("49_02", 2, 19), ("05_06", 3, 20),
)  # fmt: skip
"""Motion, number of cameras and seed of each simulated take."""

DRAWN = 2
"""Number of faults of each simulated take."""

OUTSIDE_S = 0.5
OUTSIDE_MM = 2.0


@dataclass(frozen=True)
class Figures:
    """Figures of one fault: errors of the joint over the faulty range [mm], clean, faulty and mended; the 99th
    percentile of how far the edit moved joints outside the range [mm], and the same without moves towards the solve
    without the fault; clean-up events inside, faulty and mended; the duration of the mended solve relative to the
    faulty one."""

    fault: Fault
    clean_mm: float
    before_mm: float
    after_mm: float
    outside_mm: float
    outside_worse_mm: float
    events: tuple[int, int]
    ratio: float

    @property
    def mended(self) -> bool:
        """Whether the error is at most a third of what it was."""
        return self.after_mm <= self.before_mm / 3.0

    @property
    def harmed(self) -> bool:
        """Whether the fault at least doubled the error; otherwise there is little to correct."""
        return self.before_mm >= 2.0 * self.clean_mm


class Bench:
    """A take with its truth, and its solve without faults."""

    def __init__(self, take: Take, truth: Reference, preset: str) -> None:
        self._take, self._truth, self._preset = take, truth, preset
        self._frames: Frames = camera_frames(take.raw_path)
        self._calibration = take.calibration()
        self.clean, _ = self._solved(self._frames)
        matched, alignment = align(match(self.clean, truth, start_s=self._start_s))
        del matched
        self._alignment: Alignment = alignment

    @property
    def _start_s(self) -> float:
        return float(self._take.meta["calibration_s"] or 0.0)

    def _solved(self, frames: Frames, edits: tuple[Edit, ...] = ()) -> tuple[Poses, float]:
        began = time.process_time()
        with tempfile.TemporaryDirectory(), patch.object(replay, "camera_frames", lambda path: dict(frames)):
            folder = replay.solve_take(
                self._take, parse_settings(self._preset), name="bench", to_disk=False, edits=edits
            )
        return Poses.load(folder / "poses.npz"), time.process_time() - began

    def true_m(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """The true joints in the stage frame of the solves [m], shape (time_count, 21, 3)."""
        return self._alignment.to_stage(self._truth.at(time_s))

    def errors_m(self, poses: Poses, begin_s: float, end_s: float) -> tuple[NDArray, NDArray]:
        """Times, shape (frame_count,), and errors of the joints [m], shape (frame_count, 21)."""
        rows = (poses.time_s >= begin_s) & (poses.time_s <= end_s)
        joints = poses.positions_m[rows][:, OUTPUT_OF_CANONICAL_INDEX]
        times = poses.time_s[rows]
        return times, np.linalg.norm(joints - self.true_m(times), axis=2)

    def _moved_m(self, after: Poses, before: Poses) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """How far joints were moved [m], shape (frame_count, joint_count); and the same, limited to their distance
        from the solve without a fault."""
        from_before, from_clean = (
            np.linalg.norm(after.positions_m - other.positions_m, axis=2) for other in (before, self.clean)
        )
        return from_before, np.minimum(from_before, from_clean)

    def events(self, poses: Poses, begin_s: float, end_s: float) -> int:
        """Number of clean-up events in a range."""
        found = cleanup_figures(poses, self._truth, self._alignment)["cleanup_events"] or []
        return sum(e["start_s"] <= end_s + OUTSIDE_S and e["end_s"] >= begin_s - OUTSIDE_S for e in found)

    def measured(self, kind: str, seed: int, picture: Path | None = None) -> Figures:
        """Return the figures of a fault of a kind; `picture`: file for the solves without it, with it, and mended."""
        rng = np.random.default_rng(seed)
        span = float(self.clean.time_s[0]), float(self.clean.time_s[-1])
        fault = a_fault(kind, rng, span, list(self._frames), self.true_m)
        frames = faulty(self._frames, self._calibration, fault)
        before, before_s = self._solved(frames)
        times, off = self.errors_m(before, fault.begin_s, fault.end_s)
        clean = self.errors_m(self.clean, fault.begin_s, fault.end_s)[1]
        joint = INDEX[fault.joint] if fault.joint else int(np.nanargmax((off - clean).mean(axis=0)))
        at_s = float(times[np.nanargmax(off[:, joint])])
        edit = mending(fault, at_s, self.true_m(np.array([at_s]))[0, joint], rng)
        after, after_s = self._solved(frames, (edit,))
        mended = self.errors_m(after, fault.begin_s, fault.end_s)[1]
        if picture is not None:
            rows = {"without the fault": [self.clean], "with it": [before], "mended by one edit": [after]}
            render_strip(rows, picture, times_s=np.linspace(fault.begin_s, fault.end_s, 7).tolist())
        outside = (after.time_s < fault.begin_s - OUTSIDE_S) | (after.time_s > fault.end_s + OUTSIDE_S)
        moved, worse = (1e3 * float(np.percentile(m[outside], 99)) for m in self._moved_m(after, before))
        clean_mm, before_mm, after_mm = (
            1e3 * float(np.nanmean(one[:, joint])) for one in (clean, off, mended)
        )
        return Figures(
            Fault(kind, fault.begin_s, fault.end_s, CANONICAL[joint], fault.camera, fault.shift_m),
            clean_mm,
            before_mm,
            after_mm,
            moved,
            worse,
            (self.events(before, fault.begin_s, fault.end_s), self.events(after, fault.begin_s, fault.end_s)),
            after_s / before_s,
        )


def simulated(motions: Path, folder: Path, later: int = 0) -> Iterator[tuple[Take, int]]:
    """Yield ten simulated takes of real motions, with their seeds, which are larger by `later` than usual; takes in
    the folder are reused."""
    for motion, cameras, first in SIMULATED:
        seed = first + later
        path = folder / f"{motion}_{cameras}_{seed}"
        if not path.exists():
            simulate_take(motions / f"{motion}.bvh", path, cameras=cameras, seed=seed)
            made = Take.open(path)
            made.add_calibration(calibrate_take(made), use=True)
        yield Take.open(path), seed


def jobs(args: argparse.Namespace) -> Iterator[tuple[Take, Path, list[tuple[str, int]]]]:
    """Yield takes with their truths, and the kinds and seeds of their faults."""
    kinds = args.kinds.split(",")
    for text in args.takes:
        path, _, truth = str(text).partition("=")
        yield Take.open(path), Path(truth), [(kind, seed) for kind in kinds for seed in range(args.seeds)]
    if args.simulated is not None:
        for take, seed in simulated(args.simulated, args.folder, args.later):
            drawn = np.random.default_rng(seed).choice(kinds, size=DRAWN, replace=False).tolist()
            yield take, take.path.with_name(f"{take.path.name}.truth.csv"), [(kind, seed) for kind in drawn]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("takes", nargs="*", type=Path, metavar="TAKE=TRUTH")
    parser.add_argument("--simulated", type=Path, metavar="MOTIONS", help="folder of CMU motions (.bvh)")
    parser.add_argument("--folder", type=Path, help="of the simulated takes")
    parser.add_argument(
        "--later", type=int, default=0, help="added to their seeds: other noise, other faults"
    )
    parser.add_argument("--preset", default="finish")
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="for a picture of each fault")
    args, every = parser.parse_args(), []
    if args.pictures is not None:
        args.pictures.mkdir(parents=True, exist_ok=True)
    for take, truth, faults in jobs(args):
        reference = read_reference(truth)
        assert not isinstance(reference, Markers)
        bench = Bench(take, reference, args.preset)
        for kind, seed in faults:
            if bench.clean.time_s[-1] - bench.clean.time_s[0] < LENGTHS_S[kind] + 2.0:
                continue  # the take is too short for it
            picture = args.pictures and args.pictures / f"{take.path.name}_{kind}_{seed}.png"
            one = bench.measured(kind, seed, picture)
            every.append(one)
            print(
                f"{take.path.name:26} {kind:8} {one.fault.joint:12} {one.fault.begin_s:6.2f} s  "
                f"{one.clean_mm:5.0f} {one.before_mm:5.0f} > {one.after_mm:5.0f} mm "
                f"{'ok' if one.mended else 'NO' if one.harmed else '-':3} outside {one.outside_mm:5.2f} "
                f"({one.outside_worse_mm:.2f}) mm  "
                f"events {one.events[0]} > {one.events[1]}  ratio {one.ratio:.2f}",
                flush=True,
            )
    harmed = [one for one in every if one.harmed]
    print(
        f"at most a third: {sum(one.mended for one in every)} of {len(every)} "
        f"(of those that the fault harmed: {sum(one.mended for one in harmed)} of {len(harmed)}); "
        f"outside at most {OUTSIDE_MM:g} mm: {sum(one.outside_mm <= OUTSIDE_MM for one in every)}; "
        f"no event more: {sum(one.events[1] <= one.events[0] for one in every)}"
    )


if __name__ == "__main__":
    main()
