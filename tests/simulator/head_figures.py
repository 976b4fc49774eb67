"""Heads seen by ordinary cameras, against the truth: simulated glances, true cameras, live and finished.

A figure is the angle between a solve's head and the true one in every frame: of the whole rotation, and of the
direction of the face alone.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import matrices
from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.simulator.landmarks.heads import SimulatedHead
from studio.simulator.rig import RigCamera, look_at
from tests.simulator.finger_figures import SeenStage, seen_stage

DISTANCE_M = 2.6
RIGS_DEG = {1: (0.0,), 2: (-40.0, 40.0), 3: (0.0, -120.0, 120.0)}
"""Directions of the cameras by their number: one and two in front of the performer, three all around."""

BAR_DEG, ANYBODY_DEG = 10.0, 14.0
"""Bar of the median of several performers, as for depth cameras, and of any one: faces differ from the model's."""


def rig(count: int) -> tuple[RigCamera, ...]:
    """Return the cameras of `RIGS_DEG`."""
    return tuple(
        RigCamera(
            f"camera_{k}",
            look_at(
                np.array([DISTANCE_M * np.sin(a), -DISTANCE_M * np.cos(a), 1.2 + 0.2 * k]),
                np.array([0.0, 0.0, 1.0]),
            ),
        )
        for k, a in enumerate(np.radians(RIGS_DEG[count]))
    )


def errors_deg(stage: SeenStage, poses: Poses) -> NDArray[np.float64]:
    """Return the head's error in each frame, whole and of the face's direction, shape (F, 2) [degrees]."""
    head = SimulatedHead(stage.seed)
    found = matrices(poses.rotations_wxyz[:, OUTPUT_INDEX["Head"]])
    out = np.empty((len(found), 2))
    for row, time_s in enumerate(poses.time_s.tolist()):
        true = head.rotation(stage.motion.at(time_s), time_s)
        turn = 0.5 * (np.trace(true.T @ found[row]) - 1.0)
        out[row] = turn, true[:, 1] @ found[row][:, 1]
    return np.degrees(np.arccos(np.clip(out, -1.0, 1.0)))


def figures(stage: SeenStage, preset: str, changes: Sequence[str] = ()) -> NDArray[np.float64]:
    """Return `errors_deg` of a solve."""
    return errors_deg(
        stage, solve_frames(stage.frames, stage.calibration, parse_settings(preset, [*changes]))
    )


def main() -> None:
    """Print the errors by number of cameras."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.head_figures", description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0, help="length of the performance")
    parser.add_argument(
        "--seeds", type=int, nargs="*", default=(1, 2, 3), help="performers, glances and noise"
    )
    parser.add_argument("--cameras", type=int, nargs="*", default=tuple(RIGS_DEG), help="numbers of cameras")
    chosen = parser.parse_args()
    solves = {"live": ("studio", []), "finished": ("finish", []), "ahead": ("studio", ["look_at=far"])}
    for count in chosen.cameras:
        stages = [seen_stage(chosen.seconds, seed, rig(count)) for seed in chosen.seeds]
        for name, (preset, changes) in solves.items():
            errors = [figures(stage, preset, changes) for stage in stages]
            medians = ", ".join(f"{np.median(one[:, 0]):.1f}" for one in errors)
            whole, face = np.concatenate(errors).T
            print(
                f"{count} cameras, {name}: median {np.median(whole):.1f} degrees, 95 % "
                f"{np.percentile(whole, 95):.1f}; face's direction {np.median(face):.1f}, "
                f"95 % {np.percentile(face, 95):.1f}; by performer {medians}",
                flush=True,
            )


if __name__ == "__main__":
    main()
