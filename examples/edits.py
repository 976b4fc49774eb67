"""Pins a wrist of a solved take to where it was, solves the take again, and takes the edit back.

python examples/edits.py TAKE

The same goes over the network: GET, POST and PATCH /api/v1/takes/SESSION/TAKE/edits (docs/edits.md).
"""

import math
import sys
from pathlib import Path

import studio


def wrist_at(poses: studio.Poses, time_s: float) -> tuple[float, float, float]:
    """Return the place of the left wrist at a stage time [m]."""
    frame = min(range(poses.frame_count), key=lambda k: abs(poses.time_s[k] - time_s))
    x, y, z = poses.positions_m[frame, poses.joint_names.index("LeftHand")]
    return float(x), float(y), float(z)


def main(take_path: Path) -> None:
    take = studio.open_take(take_path)
    before = studio.load_poses(take)
    at_s = float(before.time_s[before.frame_count // 2])
    x, y, z = wrist_at(before, at_s)

    # As an operator who saw that the wrist was 5 cm higher, to within 1 cm.
    pin = studio.PinEdit(
        id="", start_s=at_s, end_s=at_s, joint="left_wrist", place_m=(x, y, z + 0.05), radius_m=0.01
    )
    kept = studio.change_edits(take, [pin])
    print(f"revision {kept.revision}: {[one.id for one in kept.edits]}")

    after = studio.solve(take, "studio", name="edited")
    print(f"the wrist moved by {100 * math.dist((x, y, z), wrist_at(after, at_s)):.1f} cm")

    kept = studio.undo_edits(take)
    print(f"revision {kept.revision}: {[one.id for one in kept.edits]}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
