"""MotionBuilder shows the live character of Capture Studio: a skeleton with HumanIK names, driven by VMC over UDP.

Add an output of the kind `vmc` in the studio. Drop this file on MotionBuilder's viewer, or run it in its Python
editor with the path of this folder:

    import sys; sys.path.append(r"<path>/examples/receivers")
    import for_motionbuilder
    for_motionbuilder.start()             # a skeleton below "capture_studio", ready to be characterised
    for_motionbuilder.start(record=True)  # also sets keys while the transport plays
    for_motionbuilder.stop()
"""

import vmc
from pyfbsdk import (
    FBFindModelByLabelName,
    FBModelNull,
    FBModelSkeleton,
    FBModelTransformationType,
    FBSystem,
    FBVector3d,
)

GROUP = "capture_studio"
_MOVE, _TURN = FBModelTransformationType.kModelTranslation, FBModelTransformationType.kModelRotation
_running = []


def make_skeleton():
    """Return the bones by name, made in the T-pose where they are not there yet."""
    found = {name: FBFindModelByLabelName(f"{GROUP}:{name}") for name in vmc.NAMES.values()}
    root = FBFindModelByLabelName(f"{GROUP}:Root")
    if root is None:
        root = FBModelNull(f"{GROUP}:Root")
        root.Show = True
    for name in found:
        if found[name] is None:
            bone = FBModelSkeleton(f"{GROUP}:{name}")
            bone.Show = True
            parent = vmc.parent_of(name)
            bone.Parent = found[parent] if parent else root
            found[name] = bone
    return found


def show(bones, frame, record=False):
    """Pose the skeleton as a frame says."""
    for name, bone in frame.bones.items():
        model = bones[name]
        model.SetVector(FBVector3d(*bone.position_cm), _MOVE, False)
        model.SetVector(FBVector3d(*vmc.euler_xyz_deg(bone.rotation_wxyz)), _TURN, False)
        if record:
            model.Translation.SetAnimated(True)
            model.Rotation.SetAnimated(True)
            model.Translation.Key()
            model.Rotation.Key()
    FBSystem().Scene.Evaluate()


def start(port=vmc.PORT, host="127.0.0.1", record=False):
    """Show what comes at this address from now on."""
    stop()
    bones, channel, reader = make_skeleton(), vmc.listen(port, host), vmc.VmcReader()

    def step(control, event):
        frame = vmc.newest(channel, reader)
        if frame is not None:
            show(bones, frame, record)

    FBSystem().OnUIIdle.Add(step)
    _running.append((step, channel))


def stop():
    """Listen no more; the skeleton stays."""
    while _running:
        step, channel = _running.pop()
        FBSystem().OnUIIdle.Remove(step)
        channel.close()


if __name__ in ("__main__", "builtins"):
    start()
