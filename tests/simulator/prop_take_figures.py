"""Figures of a prop of a simulated take: `python -m tests.simulator.prop_take_figures TAKE SOLVE PROP`.

Both what the cameras saw and what is exported, tied to the hand, are compared with `TAKE.truth.prop.csv`. The joints
of the solve and `TAKE.truth.csv` align the stage with the truth, as `studio evaluate` does.
"""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from studio.engine.metrics.reference.alignment import align
from studio.engine.metrics.reference.matching import match
from studio.engine.metrics.reference.reference import Reference, read_reference
from studio.engine.rigid_bodies.props import prop_poses
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import Take
from studio.take.rigid_bodies.kept import take_bodies
from studio.take.rigid_bodies.used import stage_bodies
from tests.engine.seeing.props.moving import errors


def main(folder: str, solve: str, name: str) -> None:
    """Print how much of the prop was seen, and how far it is from its true place."""
    take = Take.open(folder)
    table = np.genfromtxt(Path(f"{folder}.truth.prop.csv"), delimiter=",", skip_header=1)
    known, body = take_bodies(take).named(name), stage_bodies(take).tracks[name]
    assert known is not None and known.shape is not None

    def pose(time_s: float) -> tuple[np.ndarray, np.ndarray]:
        nearest = table[np.abs(table[:, 0] - time_s).argmin()]
        place = np.array([np.interp(time_s, table[:, 0], column) for column in table[:, 1:4].T])
        return place, Rotation.from_quat(nearest[4:], scalar_first=True).as_matrix()

    poses = solved_performers(take, solve)[0].poses
    reference = read_reference(Path(f"{folder}.truth.csv"))
    assert isinstance(reference, Reference)
    matched, alignment = align(match(poses, reference, start_s=float(table[0, 0])))
    off = np.linalg.norm(matched.solve_m - matched.reference_m, axis=2)
    print(f"joints of {solve}: {1e3 * np.nanmean(off):.1f} mm")
    turn = Rotation.from_matrix(alignment.T_reference_stage[:3, :3])
    truth = SimpleNamespace(shape=known.shape, pose=pose)
    tied = prop_poses(name, body, known.shape, [poses], (known.joint,) if known.joint else ())
    frames = (poses.time_s >= table[0, 0]) & (poses.time_s <= table[-1, 0])
    for what, time_s, places_m, turns in (
        ("seen", body.time_s, body.positions_m, body.rotations_wxyz),
        ("exported", poses.time_s[frames], tied.positions_m[frames, 0], tied.rotations_wxyz[frames, 0]),
    ):
        moved = SimpleNamespace(
            time_s=time_s,
            places_m=alignment.to_reference(places_m),
            rotations_wxyz=(turn * Rotation.from_quat(turns, scalar_first=True)).as_quat(scalar_first=True),
        )
        away, axis = errors(truth, moved)
        mm, deg = np.percentile(away, [50, 95]).round(1), np.percentile(axis, [50, 95]).round(1)
        print(f"{what}: {len(time_s)} instants, place {mm} mm, axis {deg} degrees (50, 95 %)")


if __name__ == "__main__":
    main(*sys.argv[1:])
