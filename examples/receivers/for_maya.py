"""Maya shows the live character of Capture Studio: joints with HumanIK names, driven by VMC over UDP.

Add an output of the kind `vmc` in the studio. In Maya's script editor (Python 3), with the path of this folder:

    import sys; sys.path.append(r"<path>/examples/receivers")
    import for_maya
    for_maya.start()             # joints below "capture_studio"
    for_maya.start(record=True)  # also sets a key at Maya's current time, while it plays
    for_maya.stop()
"""

import maya.api.OpenMaya as om
import vmc
from maya import cmds

GROUP = "capture_studio"
_callbacks = []


def make_joints():
    """Make the joints in the T-pose, in centimetres, where they are not there yet."""
    if cmds.objExists(GROUP):
        return
    cmds.group(empty=True, name=GROUP)
    for name in vmc.NAMES.values():
        cmds.select(clear=True)
        joint = cmds.joint(name=f"{GROUP}_{name}", rotationOrder="xyz")
        parent = vmc.parent_of(name)
        cmds.parent(joint, f"{GROUP}_{parent}" if parent else GROUP, relative=True)


def show(frame, record=False):
    """Pose the joints as a frame says."""
    for name, bone in frame.bones.items():
        joint = f"{GROUP}_{name}"
        cmds.setAttr(f"{joint}.translate", *bone.position_cm)
        cmds.setAttr(f"{joint}.rotate", *vmc.euler_xyz_deg(bone.rotation_wxyz))
    if record:
        joints = [f"{GROUP}_{name}" for name in frame.bones]
        cmds.setKeyframe(joints, attribute=["translate", "rotate"])


def start(port=vmc.PORT, host="127.0.0.1", record=False):
    """Show what comes at this address from now on."""
    stop()
    make_joints()
    channel, reader = vmc.listen(port, host), vmc.VmcReader()

    def step(elapsed, last, data):
        frame = vmc.newest(channel, reader)
        if frame is not None:
            show(frame, record)

    _callbacks.append((om.MTimerMessage.addTimerCallback(1 / 60, step), channel))


def stop():
    """Listen no more; the joints stay."""
    while _callbacks:
        callback, channel = _callbacks.pop()
        om.MMessage.removeCallback(callback)
        channel.close()
