"""`python -m tests.simulator.finger_picture OUT.png`: a hand that opens and closes, followed or not, with the truth.

Rows: finished, live, and without `fingers`; columns: instants of one hand. Red lines are the true hand, moved so that
its wrist is at the solved wrist.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from studio.engine.animation.mannequin.performer import Mannequin
from studio.engine.model.joints import INDEX, OUTPUT_INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.review.render.figure import Projection, draw_figure
from tests.simulator.finger_figures import SeenStage, seen_stage

SECONDS, SEED, SIDE = 12.0, 11, "Right"
TIMES_S = np.linspace(2.0, 6.2, 8)
ROWS = {"finish": [], "studio": [], "studio, fingers=off": ["fingers=off"]}
CELL, PIXELS_PER_M, YAW_DEG = 220, 800.0, 25.0


def cell(stage: SeenStage, poses: Poses, mannequin: Mannequin, time_s: float) -> Image.Image:
    """Return the hand at an instant, with the true hand drawn over it."""
    row = int(np.argmin(np.abs(poses.time_s - time_s)))
    wrist = poses.positions_m[row, OUTPUT_INDEX[f"{SIDE}Hand"]]
    joints = stage.motion.at(float(poses.time_s[row]))
    knuckles = wrist + joints[INDEX["right_hand"]] - joints[INDEX["right_wrist"]]
    x, y, z = knuckles.tolist()
    view = Projection(CELL, CELL, PIXELS_PER_M, YAW_DEG, 5.0, (x, y, z), 0.5)
    pose = poses.positions_m[row], poses.rotations_wxyz[row]
    image = Image.fromarray(draw_figure(mannequin, *pose, view))
    true = stage.hands.points(joints, float(poses.time_s[row]))[int(SIDE == "Right")]
    seen = (true - true[0] + wrist - knuckles) @ view.axes().T * PIXELS_PER_M + 0.5 * CELL
    pen = ImageDraw.Draw(image)
    for finger in range(5):
        chain = [0, *range(1 + 4 * finger, 5 + 4 * finger)]
        pen.line([(float(seen[k, 0]), float(seen[k, 1])) for k in chain], fill=(200, 30, 30), width=2)
    return image


def main(path: Path) -> None:
    """Write the picture."""
    stage = seen_stage(SECONDS, SEED)
    performer = stage.calibration.performer
    assert performer is not None
    sheet = Image.new("RGB", (CELL * len(TIMES_S), CELL * len(ROWS)))
    for n, (name, changes) in enumerate(ROWS.items()):
        preset = name.partition(",")[0]
        poses = solve_frames(stage.frames, stage.calibration, parse_settings(preset, changes))
        mannequin = Mannequin.of(poses)
        for k, time_s in enumerate(TIMES_S.tolist()):
            sheet.paste(cell(stage, poses, mannequin, time_s), (CELL * k, CELL * n))
    sheet.save(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
