"""Small BVH files for tests."""

MIXAMO = {
    "mixamorig:Hips": (None, (0, 95, 0)),
    "mixamorig:Spine": ("mixamorig:Hips", (0, 10, -1)),
    "mixamorig:Spine1": ("mixamorig:Spine", (0, 12, 0)),
    "mixamorig:Spine2": ("mixamorig:Spine1", (0, 13, 0)),
    "mixamorig:Neck": ("mixamorig:Spine2", (0, 15, 0)),
    "mixamorig:Head": ("mixamorig:Neck", (0, 10, 2)),
    **{
        f"mixamorig:{side}{joint}": (
            f"mixamorig:{side}{parent}" if parent[0].isupper() else parent,
            (sign * x, y, z),
        )
        for side, sign in (("Left", 1), ("Right", -1))
        for joint, parent, (x, y, z) in (
            ("Shoulder", "mixamorig:Spine2", (6, 11, 0)),
            ("Arm", "Shoulder", (12, 0, 0)),
            ("ForeArm", "Arm", (28, 0, 0)),
            ("Hand", "ForeArm", (25, 0, 0)),
            ("HandMiddle1", "Hand", (9, 0, 0)),
            ("UpLeg", "mixamorig:Hips", (9, -5, 0)),
            ("Leg", "UpLeg", (0, -43, 0)),
            ("Foot", "Leg", (0, -41, 0)),
            ("ToeBase", "Foot", (0, -4, 13)),
        )
    },
}
"""A HumanIK-like skeleton in centimetres: joint -> parent and offset."""


def bvh_text(skeleton: dict, frames: list[list[float]], frame_s: float = 0.01) -> str:
    """Return a BVH: the root has six channels (XYZ position, ZXY rotation), each other joint three."""
    children: dict[str | None, list[str]] = {}
    for name, (parent, _) in skeleton.items():
        children.setdefault(parent, []).append(name)

    def joint(name: str) -> list[str]:
        parent, offset = skeleton[name]
        position = "6 Xposition Yposition Zposition" if parent is None else "3"
        lines = [("ROOT " if parent is None else "JOINT ") + name, "{"]
        lines += [
            "OFFSET " + " ".join(map(str, offset)),
            f"CHANNELS {position} Zrotation Xrotation Yrotation",
        ]
        for child in children.get(name, []):
            lines += joint(child)
        if name not in children:
            lines += ["End Site", "{", "OFFSET 0 1 0", "}"]
        return [*lines, "}"]

    (root,) = children[None]
    rows = [" ".join(map(str, row)) for row in frames]
    head = ["HIERARCHY", *joint(root), "MOTION", f"Frames: {len(frames)}", f"Frame Time: {frame_s}"]
    return "\n".join([*head, *rows, ""])


def channel_count(skeleton: dict) -> int:
    """Number of values in a frame of `bvh_text`."""
    return 3 * len(skeleton) + 3
