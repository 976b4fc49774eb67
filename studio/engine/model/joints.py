"""Joint names: canonical joints, device joint sets and their mapping, and the output skeleton.

A camera frame arrives in a device's joint set (`JOINT_SETS`). `to_canonical` maps it to the canonical joints, once.
Solves use the output skeleton (`OUTPUT_JOINTS`, HumanIK names). Metrics and references use canonical joints, by
`OUTPUT_OF_CANONICAL`.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError

_SIDE = ("shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle", "toe")

CANONICAL: tuple[str, ...] = (
    "hips", "spine", "chest", "neck", "head",
    *(f"left_{name}" for name in _SIDE),
    *(f"right_{name}" for name in _SIDE),
)  # fmt: skip
"""The canonical joints, in the order of every (..., 21, 3) array of the engine."""

INDEX: dict[str, int] = {name: i for i, name in enumerate(CANONICAL)}
JOINT_COUNT = len(CANONICAL)

PARENT_OF_CANONICAL: dict[str, str] = {
    "spine": "hips", "chest": "spine", "neck": "chest", "head": "neck",
    **{f"{s}_{child}": (f"{s}_{parent}" if parent in _SIDE else parent)
       for s in ("left", "right")
       for child, parent in (("shoulder", "chest"), ("elbow", "shoulder"), ("wrist", "elbow"),
                             ("hand", "wrist"), ("hip", "hips"), ("knee", "hip"), ("ankle", "knee"),
                             ("toe", "ankle"))},
}  # fmt: skip
"""Canonical child -> canonical parent; `hips` is the root."""

PARENTS: NDArray[np.int64] = np.array(
    [INDEX[PARENT_OF_CANONICAL[name]] if name in PARENT_OF_CANONICAL else -1 for name in CANONICAL]
)
"""Index of each canonical joint's parent, -1 for the root; a parent always comes before its child."""

LIMB_ROOTS: NDArray[np.int64] = np.array(
    [
        INDEX[f"{side}_shoulder"] if part in ("elbow", "wrist", "hand")
        else INDEX[f"{side}_hip"] if part in ("knee", "ankle", "toe")
        else INDEX[name]
        for name in CANONICAL
        for side, _, part in (name.partition("_"),)
    ]
)  # fmt: skip
"""Index of the shoulder or hip that carries each joint; of joints of the trunk, their own."""

MIRROR: NDArray[np.int64] = np.array(
    [
        INDEX[{"left": "right", "right": "left"}[name.split("_")[0]] + "_" + name.split("_")[1]]
        if "_" in name
        else INDEX[name]
        for name in CANONICAL
    ]
)
"""`positions[MIRROR]` swaps left and right joints."""

MEASURED_JOINTS: tuple[str, ...] = (
    "hips", "neck", "head",
    *(f"{side}_{name}" for side in ("left", "right")
      for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")),
)  # fmt: skip
"""The joints of the mean `mpjpe_mm`: 15 with the neck."""

USUAL_TRUNK = (0.119, 0.970)
"""Places of hips and neck that nothing shows, on the line from the middle of the hip joints (0) to the middle of the
shoulders (1): those of HumanIK's default character. Its hips are 6.3 cm above its hip joints, its neck is 1.6 cm
below its shoulders, and 52.9 cm lie between those."""


def _kinect_v2() -> tuple[str, ...]:
    return (
        "SpineBase", "SpineMid", "Neck", "Head",
        "ShoulderLeft", "ElbowLeft", "WristLeft", "HandLeft",
        "ShoulderRight", "ElbowRight", "WristRight", "HandRight",
        "HipLeft", "KneeLeft", "AnkleLeft", "FootLeft",
        "HipRight", "KneeRight", "AnkleRight", "FootRight",
        "SpineShoulder", "HandTipLeft", "ThumbLeft", "HandTipRight", "ThumbRight",
    )  # fmt: skip


def _both(pairs: dict[str, str], pattern: str) -> dict[str, str]:
    """Left and right entries: device name by `pattern` -> canonical name."""
    return {
        pattern.format(side=side.capitalize(), SIDE=side.upper(), name=device): f"{side}_{canonical}"
        for side in ("left", "right")
        for device, canonical in pairs.items()
    }


_LIMBS = {"Shoulder": "shoulder", "Elbow": "elbow", "Wrist": "wrist", "Hand": "hand",
          "Hip": "hip", "Knee": "knee", "Ankle": "ankle", "Foot": "toe"}  # fmt: skip

JOINT_SETS: dict[str, tuple[str, ...]] = {
    "canonical": CANONICAL,
    "openni": (
        "head", "neck", "torso", "left_shoulder", "left_elbow", "left_hand",
        "right_shoulder", "right_elbow", "right_hand", "left_hip", "left_knee", "left_foot",
        "right_hip", "right_knee", "right_foot",
    ),
    "kinect-v1": (
        "HipCenter", "Spine", "ShoulderCenter", "Head",
        "ShoulderLeft", "ElbowLeft", "WristLeft", "HandLeft",
        "ShoulderRight", "ElbowRight", "WristRight", "HandRight",
        "HipLeft", "KneeLeft", "AnkleLeft", "FootLeft",
        "HipRight", "KneeRight", "AnkleRight", "FootRight",
    ),
    "kinect-v2": _kinect_v2(),
    "azure-kinect": (
        "PELVIS", "SPINE_NAVEL", "SPINE_CHEST", "NECK",
        "CLAVICLE_LEFT", "SHOULDER_LEFT", "ELBOW_LEFT", "WRIST_LEFT", "HAND_LEFT", "HANDTIP_LEFT", "THUMB_LEFT",
        "CLAVICLE_RIGHT", "SHOULDER_RIGHT", "ELBOW_RIGHT", "WRIST_RIGHT", "HAND_RIGHT", "HANDTIP_RIGHT",
        "THUMB_RIGHT",
        "HIP_LEFT", "KNEE_LEFT", "ANKLE_LEFT", "FOOT_LEFT", "HIP_RIGHT", "KNEE_RIGHT", "ANKLE_RIGHT", "FOOT_RIGHT",
        "HEAD", "NOSE", "EYE_LEFT", "EAR_LEFT", "EYE_RIGHT", "EAR_RIGHT",
    ),
    "mediapipe": (
        "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer",
        "left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder", "right_shoulder",
        "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_pinky", "right_pinky",
        "left_index", "right_index", "left_thumb", "right_thumb", "left_hip", "right_hip", "left_knee", "right_knee",
        "left_ankle", "right_ankle", "left_heel", "right_heel", "left_foot_index", "right_foot_index",
    ),
}  # fmt: skip
"""Device joint sets by name, each in the order in which the device's frames list them."""

# Device joint -> canonical joint. A canonical joint of several device joints is their mean.
_MAPS: dict[str, dict[str, str]] = {
    "canonical": {name: name for name in CANONICAL},
    "openni": {
        "head": "head", "neck": "neck", "torso": "spine",
        **{f"{s}_{d}": f"{s}_{c}" for s in ("left", "right") for d, c in (
            ("shoulder", "shoulder"), ("elbow", "elbow"), ("hand", "wrist"), ("hip", "hip"),
            ("knee", "knee"), ("foot", "ankle"))},
    },
    "kinect-v1": {"HipCenter": "hips", "Spine": "spine", "ShoulderCenter": "neck", "Head": "head",
                  **_both(_LIMBS, "{name}{side}")},
    "kinect-v2": {"SpineBase": "hips", "SpineMid": "spine", "SpineShoulder": "chest", "Neck": "neck",
                  "Head": "head", **_both(_LIMBS, "{name}{side}")},
    "azure-kinect": {"PELVIS": "hips", "SPINE_NAVEL": "spine", "SPINE_CHEST": "chest", "NECK": "neck",
                     "HEAD": "head", **_both({k.upper(): v for k, v in _LIMBS.items()}, "{name}_{SIDE}")},
    "mediapipe": {
        "left_ear": "head", "right_ear": "head",
        **{f"{s}_{d}": f"{s}_{c}" for s in ("left", "right") for d, c in (
            ("shoulder", "shoulder"), ("elbow", "elbow"), ("wrist", "wrist"), ("index", "hand"), ("pinky", "hand"),
            ("hip", "hip"), ("knee", "knee"), ("ankle", "ankle"), ("foot_index", "toe"))},
    },
}  # fmt: skip


def _matrix(joint_set: str) -> NDArray[np.float64]:
    """Averaging matrix (canonical, device): each row sums to 1, or to 0 for a joint the device lacks."""
    names, mapping = JOINT_SETS[joint_set], _MAPS[joint_set]
    matrix = np.zeros((JOINT_COUNT, len(names)))
    for column, name in enumerate(names):
        if name in mapping:
            matrix[INDEX[mapping[name]], column] = 1.0
    if joint_set == "openni":  # it has no pelvis joint: use the middle of the hip joints
        for side in ("left", "right"):
            matrix[INDEX["hips"]] += matrix[INDEX[f"{side}_hip"]]
    total = matrix.sum(axis=1, keepdims=True)
    matrix = np.divide(matrix, total, out=np.zeros_like(matrix), where=total > 0)
    return on_trunk(matrix) if joint_set == "mediapipe" else matrix  # mediapipe has neither hips nor neck


def on_trunk(joints: NDArray[np.float64], shares: tuple[float, float] = USUAL_TRUNK) -> NDArray[np.float64]:
    """Return joints with hips and neck on the line from the middle of the hip joints to that of the shoulders.

    Args:
        joints: canonical joints in any frame, of any number of values each, shape (..., 21, n); NaN = unseen.
        shares: places of the hips and the neck on that line, as `USUAL_TRUNK`.
    """
    out = joints.copy()
    low, high = (
        (joints[..., INDEX[f"left_{name}"], :] + joints[..., INDEX[f"right_{name}"], :]) / 2
        for name in ("hip", "shoulder")
    )
    for name, share in zip(("hips", "neck"), shares, strict=True):
        out[..., INDEX[name], :] = (1.0 - share) * low + share * high
    return out


_MATRICES = {name: _matrix(name) for name in JOINT_SETS}
_USED = {name: matrix > 0 for name, matrix in _MATRICES.items()}


def to_canonical(
    joint_set: str, positions: NDArray[np.floating], confidence: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a device's joints as canonical joints.

    Args:
        joint_set: a key of `JOINT_SETS`.
        positions: device joints [m] in any one frame, shape (device_joint_count, 3); NaN = unseen.
        confidence: shape (device_joint_count,), 0..1; 0 = unseen.

    Returns:
        Positions, shape (21, 3), NaN where the device lacks or did not see the joint, and confidence, shape (21,),
        the lowest of a canonical joint's device joints, 0 where unseen.

    Raises:
        FormatError: unknown joint set or a wrong number of joints.
    """
    if joint_set not in _MATRICES:
        raise FormatError(
            "joints.unknown_set",
            "unknown joint set {name!r}; known: {known}",
            name=joint_set,
            known=[*JOINT_SETS],
        )
    matrix = _MATRICES[joint_set]
    positions = np.asarray(positions, dtype=np.float64)
    if positions.shape != (matrix.shape[1], 3):
        raise FormatError(
            "joints.shape",
            "joint set {name!r} has {n} joints of 3 numbers; got shape {shape}",
            name=joint_set,
            n=matrix.shape[1],
            shape=positions.shape,
        )
    confidence = np.asarray(confidence, dtype=np.float64)
    seen = np.isfinite(positions).all(axis=1) & (confidence > 0.0)
    if joint_set == "canonical":
        out, conf = positions.copy(), confidence.copy()
    else:
        used = _USED[joint_set]
        out = matrix @ np.where(seen[:, None], positions, 0.0)
        conf = np.where(used, confidence, np.inf).min(axis=1)
        seen = used.any(axis=1) & ~(used & ~seen).any(axis=1)
    out[~seen] = np.nan
    conf[~seen] = 0.0
    conf = np.fmax(np.minimum(conf, 1.0), 0.0)  # NaN counts as confidence 0
    return out, conf


FINGERS: tuple[str, ...] = ("Thumb", "Index", "Middle", "Ring", "Pinky")


def _output() -> dict[str, str | None]:
    parents: dict[str, str | None] = {"Hips": None, "Spine": "Hips", "Spine1": "Spine", "Spine2": "Spine1",
                                      "Neck": "Spine2", "Head": "Neck"}  # fmt: skip
    for side in ("Left", "Right"):
        parents |= {f"{side}Shoulder": "Spine2", f"{side}Arm": f"{side}Shoulder",
                    f"{side}ForeArm": f"{side}Arm", f"{side}Hand": f"{side}ForeArm"}  # fmt: skip
        for finger in FINGERS:
            for k in (1, 2, 3):
                name = f"{side}Hand{finger}"
                parents[f"{name}{k}"] = f"{side}Hand" if k == 1 else f"{name}{k - 1}"
    for side in ("Left", "Right"):
        parents |= {f"{side}UpLeg": "Hips", f"{side}Leg": f"{side}UpLeg",
                    f"{side}Foot": f"{side}Leg", f"{side}ToeBase": f"{side}Foot"}  # fmt: skip
    return parents


OUTPUT_PARENT: dict[str, str | None] = _output()
"""Output joint -> its parent; depth-first, parents before children."""

OUTPUT_JOINTS: tuple[str, ...] = tuple(OUTPUT_PARENT)
OUTPUT_INDEX: dict[str, int] = {name: i for i, name in enumerate(OUTPUT_JOINTS)}
OUTPUT_PARENTS: NDArray[np.int64] = np.array(
    [-1 if parent is None else OUTPUT_INDEX[parent] for parent in OUTPUT_PARENT.values()]
)

OUTPUT_OF_CANONICAL: dict[str, str] = {
    "hips": "Hips", "spine": "Spine1", "chest": "Spine2", "neck": "Neck", "head": "Head",
    **{f"{side}_{canonical}": f"{side.capitalize()}{output}" for side in ("left", "right")
       for canonical, output in (("shoulder", "Arm"), ("elbow", "ForeArm"), ("wrist", "Hand"),
                                 ("hand", "HandMiddle1"), ("hip", "UpLeg"), ("knee", "Leg"),
                                 ("ankle", "Foot"), ("toe", "ToeBase"))},
}  # fmt: skip
"""Canonical joint -> its output joint."""

OUTPUT_OF_CANONICAL_INDEX: NDArray[np.int64] = np.array(
    [OUTPUT_INDEX[OUTPUT_OF_CANONICAL[name]] for name in CANONICAL]
)
