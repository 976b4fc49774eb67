"""Makes a take of the embedded performer seen by two simulated cameras, solves it, and writes an FBX.

python examples/first_solve.py OUT
"""

import sys
from pathlib import Path

import studio


def main(out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    take = studio.simulate("demo", out / "take", cameras=2, seed=1)

    calibration = studio.calibrate(take)
    for name, camera in calibration.cameras.items():
        print(f"{name}: {camera.verdict}, {camera.residual_median_mm} mm from the reference camera")

    poses = studio.solve(take, "studio")
    wrist = poses.positions_m[:, poses.joint_names.index("LeftHand")]  # stage frame: metres, z up
    print(f"{poses.frame_count} frames; the left wrist reaches {wrist[:, 2].max():.2f} m")

    file = studio.export(poses, out / "performer.fbx", target="unreal")
    print(f"{file}: {file.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
