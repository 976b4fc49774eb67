"""Blender shows the live character of Capture Studio: an armature with HumanIK names, driven by the WebSocket stream.

In a running Blender: open this file in the text editor and run it, or

    blender --python examples/receivers/for_blender.py -- [ws://127.0.0.1:8000/api/v1/stream]

Without a window, 300 frames as keys in a file:

    blender --background --python examples/receivers/for_blender.py -- URL --frames 300 --out live.blend
"""

import argparse
import sys
import threading
from pathlib import Path

import bpy
from mathutils import Quaternion, Vector

sys.path.append(str(Path(__file__).resolve().parent))
from stream import URL, Frame, Skeleton, Stream, read

NAME = "capture_studio"
_LEAF_M = 0.03


class Armature:
    """An armature in the T-pose of a frame's performer, which frames pose."""

    def __init__(self, skeleton: Skeleton, frame: Frame) -> None:
        self._parents = skeleton.parents
        self._names = skeleton.names
        rest = self._t_pose(frame)
        data = bpy.data.armatures.new(NAME)
        self.object = bpy.data.objects.new(NAME, data)
        bpy.context.scene.collection.objects.link(self.object)
        bpy.context.view_layer.objects.active = self.object
        bpy.ops.object.mode_set(mode="EDIT")
        for joint, name in enumerate(self._names):
            bone = data.edit_bones.new(name)
            bone.head, bone.tail = rest[joint], rest[joint] + self._along(joint, rest)
            if self._parents[joint] >= 0:
                bone.parent = data.edit_bones[self._names[self._parents[joint]]]
        bpy.ops.object.mode_set(mode="OBJECT")
        self._rest = [data.bones[name].matrix_local.to_quaternion() for name in self._names]
        self._heads = rest
        self._bones = [self.object.pose.bones[name] for name in self._names]
        for bone in self._bones:
            bone.rotation_mode = "QUATERNION"

    def _t_pose(self, frame: Frame) -> list[Vector]:
        """Return where the joints are in the T-pose: offsets stay, whatever a frame's rotations are."""
        places: list[Vector] = []
        for joint, parent in enumerate(self._parents):
            place = Vector(frame.positions_m[joint])
            if parent >= 0:
                turn = Quaternion(frame.rotations_wxyz[parent]).inverted()
                place = places[parent] + turn @ (place - Vector(frame.positions_m[parent]))
            places.append(place)
        return places

    def _along(self, joint: int, rest: list[Vector]) -> Vector:
        """Return a bone's direction and length: to its first child, of a leaf as its parent's."""
        children = [k for k, parent in enumerate(self._parents) if parent == joint]
        if children:
            along = rest[children[0]] - rest[joint]
        else:
            along = rest[joint] - rest[self._parents[joint]]
            along = along.normalized() * _LEAF_M
        return along if along.length > 1e-4 else Vector((0, 0, _LEAF_M))

    def show(self, frame: Frame) -> None:
        """Pose the armature as a frame says."""
        turns = [Quaternion(one) for one in frame.rotations_wxyz]
        for joint, (bone, parent) in enumerate(zip(self._bones, self._parents, strict=True)):
            local = turns[joint] if parent < 0 else turns[parent].inverted() @ turns[joint]
            bone.rotation_quaternion = self._rest[joint].inverted() @ local @ self._rest[joint]
            if parent < 0:
                moved = Vector(frame.positions_m[joint]) - self._heads[joint]
                bone.location = self._rest[joint].inverted() @ moved

    def set_keys(self, number: int) -> None:
        """Set keys of the pose at a frame's number."""
        for joint, bone in enumerate(self._bones):
            bone.keyframe_insert("rotation_quaternion", frame=number)
            if self._parents[joint] < 0:
                bone.keyframe_insert("location", frame=number)


class Newest:
    """The first performer's newest frame, read on a thread: Blender's objects are for its main thread alone."""

    def __init__(self, url: str) -> None:
        self.skeleton: Skeleton | None = None
        self.frame: Frame | None = None
        self.problem = ""
        threading.Thread(target=self._run, args=(url,), daemon=True).start()

    def _run(self, url: str) -> None:
        try:
            for text in Stream(url).texts():
                message = read(text)
                if isinstance(message, Skeleton):
                    self.skeleton = message
                else:
                    self.frame = message[0]
            self.problem = "the stream has ended"
        except (OSError, ValueError, KeyError) as error:
            self.problem = str(error)


def follow(url: str) -> None:
    """Show what comes, 60 times a second, until the stream ends."""
    newest = Newest(url)
    armature: Armature | None = None
    shown: Frame | None = None

    def step() -> float | None:
        nonlocal armature, shown
        frame = newest.frame
        if frame is not None and frame is not shown and newest.skeleton is not None:
            armature = armature or Armature(newest.skeleton, frame)
            armature.show(frame)
            shown = frame
        if newest.problem:
            print(f"Capture Studio: {newest.problem}")
            return None
        return 1 / 60

    bpy.app.timers.register(step)


def keep(url: str, frames: int, out: str) -> None:
    """Set keys of so many frames, one after the other at the scene's rate, and save the file."""
    skeleton, armature, count = None, None, 0
    scene = bpy.context.scene
    first_s = 0.0
    stream = Stream(url)
    for text in stream.texts():
        message = read(text)
        if isinstance(message, Skeleton):
            skeleton = message
            continue
        if skeleton is None:
            continue
        if armature is None:
            armature, first_s = Armature(skeleton, message[0]), message[0].time_s
        armature.show(message[0])
        fps = scene.render.fps / scene.render.fps_base
        last = 1 + (message[0].time_s - first_s) * fps
        armature.set_keys(last)
        scene.frame_end = max(1, round(last))
        count += 1
        if count == frames:
            break
    stream.close()
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(out).resolve()))
    print(f"{count} frames in {out}")


def main(words: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="for_blender.py")
    parser.add_argument("url", nargs="?", default=URL)
    parser.add_argument("--frames", type=int, default=0)
    parser.add_argument("--out", default="live.blend")
    chosen = parser.parse_args(words)
    if chosen.frames:
        keep(chosen.url, chosen.frames, chosen.out)
    else:
        follow(chosen.url)


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else [])
