"""TRC: joint centres and surface markers for OpenSim: text, millimetres, y up, tabs; a gap is empty."""

import os

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.skeleton import to_file_axes
from studio.engine.animation.export.points import points_of
from studio.engine.base.files import write_atomically
from studio.engine.model.poses import Poses


def write_trc(poses: Poses, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the poses as a TRC file, atomically; the first frame is frame 1, at time 0.

    Raises:
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    points = points_of(poses)
    rate, frames, labels = poses.frames_per_second, poses.frame_count, points.labels
    values = (to_file_axes(points.positions_m) * 1000.0 + 0.0).reshape(frames, -1)
    header = [
        f"PathFileType\t4\t(X/Y/Z)\t{os.path.basename(os.fspath(path))}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:.6g}\t{rate:.6g}\t{frames}\t{len(labels)}\tmm\t{rate:.6g}\t1\t{frames}",
        "Frame#\tTime\t" + "".join(f"{label}\t\t\t" for label in labels),
        "\t\t" + "".join(f"X{k}\tY{k}\tZ{k}\t" for k in range(1, len(labels) + 1)),
        "",
    ]
    row = "%d\t%.6f\t" + "\t".join(["%.4f"] * values.shape[1]) + "\n"
    with write_atomically(path) as file:
        file.write("\n".join([*header, ""]).encode())
        for frame in range(frames):
            text = row % (frame + 1, frame / rate, *values[frame].tolist())
            file.write(text.replace("nan", "").encode())
