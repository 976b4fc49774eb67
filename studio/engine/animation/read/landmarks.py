"""From labelled points to canonical joints: named joint centres, or estimates from surface markers.

Marker sets: Plug-in Gait (Vicon) and similar ones (CMU's). A centre lies inside the body by a constant share of the
leg, which is accurate enough for comparing motion, not for a clinic; a fit removes the remaining constant offset.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.read.points import NamedPoints
from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import unit
from studio.engine.model.joints import CANONICAL, INDEX, OUTPUT_INDEX, OUTPUT_OF_CANONICAL
from studio.engine.model.roles import roles_of

Array = NDArray[np.float64]

_CENTRES = {"HJC": "hip", "KJC": "knee", "AJC": "ankle", "SJC": "shoulder", "EJC": "elbow", "WJC": "wrist"}
_OTHER_NAMES = {"LASI": "LFWT", "RASI": "RFWT", "LPSI": "LBWT", "RPSI": "RBWT"}
_USUAL_LEG_M = 0.84
MARKER_ENDING = "_marker"
"""Ending of the label of a marker on a joint, such as `left_knee_marker`."""

_KNEE_HALF_M, _ANKLE_HALF_M, _ELBOW_HALF_M, _SHOULDER_BELOW_M = 0.055, 0.042, 0.040, 0.050
_LEAST_JOINTS = 3


def canonical_points(points: NamedPoints) -> Array:
    """Return the canonical joints that the points determine [m], shape (frame_count, 21, 3); NaN = unknown.

    Raises:
        FormatError: fewer than three joints are known; the message names the labels.
    """
    out = np.full((len(points.time_s), len(CANONICAL), 3), np.nan)
    out[:] = _from_markers(points)
    roles = roles_of(points.names, [-1] * len(points.names))
    named = {role: column for column, role in enumerate(roles) if role}
    named |= {
        name: column for column, name in enumerate(points.names) if name in OUTPUT_INDEX
    }  # a spine has no tree
    for name, role in OUTPUT_OF_CANONICAL.items():
        if role in named:
            out[:, INDEX[name]] = points.positions_m[:, named[role]]
    for column, label in enumerate(points.names):
        if label in INDEX:
            out[:, INDEX[label]] = points.positions_m[:, column]
        elif _joint_of(label):
            out[:, INDEX[_joint_of(label)]] = points.positions_m[:, column]
        elif label[:1] in "LR" and label[1:] in _CENTRES:
            side = "left" if label[0] == "L" else "right"
            out[:, INDEX[f"{side}_{_CENTRES[label[1:]]}"]] = points.positions_m[:, column]
    told = int(np.isfinite(out).all(axis=2).any(axis=0).sum())
    if told < _LEAST_JOINTS:
        raise FormatError(
            "animation.labels",
            "only {n} joints are told by the labels {labels}; known are the canonical joints "
            "(left_knee), markers on them (left_knee_marker), HumanIK's (LeftLeg), joint centres (LKJC) and "
            "Plug-in Gait's markers",
            n=told,
            labels=", ".join(points.names)[:300],
        )
    return out


def uses_markers(points: NamedPoints) -> bool:
    """Whether joints without a named centre are located by surface markers, or by markers on those joints."""
    return names_markers(points.names) and "left_knee" not in points.names


def names_markers(names: Sequence[str]) -> bool:
    """Whether labels without their subject name markers: Plug-in Gait's, or joints' (`left_knee_marker`)."""
    return {"LKNE", "RKNE"} <= set(names) or any(map(_joint_of, names))


def _joint_of(label: str) -> str:
    """Return the joint that a label says its marker is on; "" = none."""
    joint = label.removesuffix(MARKER_ENDING)
    return joint if joint != label and joint in INDEX else ""


def _from_markers(points: NamedPoints) -> Array:
    at = {name: points.positions_m[:, column] for column, name in enumerate(points.names)}
    for name, other in _OTHER_NAMES.items():
        if other in at:
            at.setdefault(name, at[other])
    out = np.full((len(points.time_s), len(CANONICAL), 3), np.nan)
    lateral = _pelvis(at, out)
    if lateral is not None:
        for side in ("left", "right"):
            _leg(at, out, side, lateral)
    _trunk(at, out)
    for side in ("left", "right"):
        _arm(at, out, side)
    return out


def _pelvis(at: dict[str, Array], out: Array) -> Array | None:
    """Hip joints by Bell, Pedersen & Brand, "A comparison of the accuracy of several hip center location prediction
    methods", J. Biomechanics 1990; returns the pelvis' axis to the left."""
    if not {"LASI", "RASI"} <= set(at) or not ({"LPSI", "RPSI"} <= set(at) or "SACR" in at):
        return None
    back = at["SACR"] if "SACR" in at else (at["LPSI"] + at["RPSI"]) / 2
    front = (at["LASI"] + at["RASI"]) / 2
    width = np.linalg.norm(at["LASI"] - at["RASI"], axis=1, keepdims=True)
    lateral = unit(at["LASI"] - at["RASI"])
    up = unit(np.cross(front - back, lateral))
    forward = np.cross(lateral, up)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        out[:, INDEX[f"{side}_hip"]] = front + width * (0.36 * sign * lateral - 0.19 * forward - 0.30 * up)
    out[:, INDEX["hips"]] = (out[:, INDEX["left_hip"]] + out[:, INDEX["right_hip"]]) / 2
    return lateral


def _leg(at: dict[str, Array], out: Array, side: str, lateral: Array) -> None:
    letter, sign = side[0].upper(), 1.0 if side == "left" else -1.0
    if not {f"{letter}KNE", f"{letter}ANK"} <= set(at):
        return
    hip, knee, ankle = out[:, INDEX[f"{side}_hip"]], at[f"{letter}KNE"], at[f"{letter}ANK"]
    size = _size(np.linalg.norm(hip - knee, axis=1) + np.linalg.norm(knee - ankle, axis=1))
    outward = sign * lateral
    out[:, INDEX[f"{side}_knee"]] = knee - _KNEE_HALF_M * size * unit(_across(outward, knee - hip))
    if {f"{letter}TOE", f"{letter}HEE"} <= set(at):
        foot = at[f"{letter}TOE"] - at[f"{letter}HEE"]
        outward = sign * np.cross([0.0, 0.0, 1.0], foot)
    out[:, INDEX[f"{side}_ankle"]] = ankle - _ANKLE_HALF_M * size * unit(_across(outward, ankle - knee))
    if f"{letter}TOE" in at:
        out[:, INDEX[f"{side}_toe"]] = at[f"{letter}TOE"]


def _trunk(at: dict[str, Array], out: Array) -> None:
    for joint, names in (("neck", ("C7", "CLAV")), ("chest", ("T10", "STRN")),
                         ("head", ("LFHD", "RFHD", "LBHD", "RBHD"))):  # fmt: skip
        if set(names) <= set(at):
            out[:, INDEX[joint]] = np.mean([at[name] for name in names], axis=0)


def _arm(at: dict[str, Array], out: Array, side: str) -> None:
    letter, sign = side[0].upper(), 1.0 if side == "left" else -1.0
    shoulder, elbow = at.get(f"{letter}SHO"), at.get(f"{letter}ELB")
    ends = [at[name] for name in (f"{letter}WRA", f"{letter}WRB") if name in at]
    if ends:
        out[:, INDEX[f"{side}_wrist"]] = np.mean(ends, axis=0)
    if f"{letter}FIN" in at:
        out[:, INDEX[f"{side}_hand"]] = at[f"{letter}FIN"]
    if shoulder is None:
        return
    down = unit(out[:, INDEX["hips"]] - out[:, INDEX["neck"]])
    down = np.where(np.isfinite(down), down, [0.0, 0.0, -1.0])
    out[:, INDEX[f"{side}_shoulder"]] = shoulder + _SHOULDER_BELOW_M * down
    if elbow is None:
        return
    out[:, INDEX[f"{side}_elbow"]] = elbow
    if ends:  # the marker lies on the hinge's axis, which a straight arm does not show
        upper, lower = elbow - out[:, INDEX[f"{side}_shoulder"]], out[:, INDEX[f"{side}_wrist"]] - elbow
        hinge = np.cross(unit(upper), unit(lower))
        bent = np.minimum(np.linalg.norm(hinge, axis=1, keepdims=True) / 0.3, 1.0)
        out[:, INDEX[f"{side}_elbow"]] = elbow + _ELBOW_HALF_M * sign * bent * unit(hinge)


def _across(vectors: Array, axis: Array) -> Array:
    """Return the component of the vectors perpendicular to the axis."""
    along = unit(axis)
    return vectors - (vectors * along).sum(axis=1, keepdims=True) * along


def _size(leg_m: Array) -> float:
    """Scale of the performer by the leg, 1 = an adult of 1.75 m."""
    return float(np.nanmedian(leg_m)) / _USUAL_LEG_M if np.isfinite(leg_m).any() else 1.0
