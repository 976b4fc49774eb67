"""Drawings of errors on a body: a diagram with each joint's mean error, and stick figures of single frames."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.proportions import AUTHORED_OFFSETS
from studio.engine.model.joints import CANONICAL, INDEX, PARENTS
from studio.review.report.svg import COLOURS, FAINT, GRID, INK, REFERENCE, drawing, line, number, text
from studio.review.report.words import ENGLISH, Words

_GOOD, _BAD = np.array([46, 139, 87]), np.array([184, 65, 62])


def _t_pose() -> NDArray[np.float64]:
    """Joints of a standing body, x and z [m], shape (21, 2); the arms are lowered a little, for the labels."""
    joints = np.zeros((len(CANONICAL), 3))
    for joint, parent in enumerate(PARENTS):
        joints[joint] = AUTHORED_OFFSETS[joint] + (joints[parent] if parent >= 0 else 0.0)
    return joints[:, [0, 2]]


def body_diagram(title: str, per_joint_mm: dict[str, float], *, most_mm: float, say: Words = ENGLISH) -> str:
    """Return a body, seen from the front, with a disc and the mean error at each measured joint.

    Args:
        title: above it.
        per_joint_mm: mean errors by canonical joint.
        most_mm: error drawn red; the same in adjacent diagrams.
        say: the reader's words.
    """
    width, height, scale = 430.0, 330.0, 155.0
    flat = _t_pose()
    places = np.stack([width / 2 + scale * flat[:, 0], height - 18 - scale * flat[:, 1]], axis=1)
    parts = [text(8, 16, title, size=12, bold=True)]
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            (x1, y1), (x2, y2) = places[joint], places[parent]
            parts.append(line(x1, y1, x2, y2, stroke=GRID, width=7))
    for name, error in per_joint_mm.items():
        x, y = places[INDEX[name]]
        share = float(np.clip(error / max(most_mm, 1e-9), 0.0, 1.0))
        red, green, blue = np.round(_GOOD + share * (_BAD - _GOOD)).astype(int)
        parts.append(
            f'<circle cx="{number(x)}" cy="{number(y)}" r="{number(4 + 6 * share)}" '
            f'fill="rgb({red},{green},{blue})"><title>{say.joint(name)}: {error:.1f} mm</title></circle>'
        )
        parts.append(_label(name, x, y, error))
    parts.append(text(width - 8, height - 6, say("mm, from the front"), size=9.5, fill=FAINT, anchor="end"))
    return drawing(width, height, parts, title)


def _label(name: str, x: float, y: float, error: float) -> str:
    arm = name.split("_")[-1] in ("shoulder", "elbow", "wrist", "hand")
    if arm:
        return text(x, y - 13, f"{error:.0f}", size=10, fill=INK, anchor="middle")
    side = -14 if name.startswith("right") else 14
    return text(x + side, y + 3.5, f"{error:.0f}", size=10, anchor="end" if side < 0 else "start")


def stick_figures(
    title: str, solve_m: NDArray[np.float64], reference_m: NDArray[np.float64], colour: str = COLOURS[0]
) -> str:
    """Return a pose drawn over the reference's, from the front and from the performer's left.

    Args:
        title: above it.
        solve_m: canonical joints, reference frame [m], shape (21, 3); NaN = missing.
        reference_m: joints of the reference, drawn dark.
        colour: of the solve.
    """
    width, height, scale = 300.0, 250.0, 105.0
    known = reference_m[np.isfinite(reference_m).all(axis=1)]
    middle, foot = known.mean(axis=0), known[:, 2].min()
    parts = [text(6, 15, title, size=11, bold=True)]
    for view, axis in enumerate((0, 1)):
        sign = 1.0 if axis == 0 else -1.0
        centre = width * (0.27 + 0.46 * view)
        for joints, stroke, wide in ((reference_m, REFERENCE, 2.2), (solve_m, colour, 2.2)):
            across = centre + sign * scale * (joints[:, axis] - middle[axis])
            up = height - 14 - scale * (joints[:, 2] - foot)
            for joint, parent in enumerate(PARENTS):
                if parent >= 0 and np.isfinite([across[joint], across[parent]]).all():
                    parts.append(
                        line(across[joint], up[joint], across[parent], up[parent], stroke=stroke, width=wide)
                    )
    return drawing(width, height, parts, title)
