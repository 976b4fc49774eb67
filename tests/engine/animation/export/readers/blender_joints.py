"""Run by Blender's Python (bpy), once for many files: what Blender reads from FBX, BVH and GLB files.

python blender_joints.py JOBS.json

JOBS.json is a list of `{"file", "out", "frames"}` and, for BVH, `scale` (metres per unit); FBX files with `importer`
= `native` are read by Blender's newer importer. Each file is imported into an empty scene. `out` (.npz) gets names,
parents, world matrices of the bones in the rest pose and at `frames` (after the first one, fractions allowed) [m,
Blender's axes: z up], the frame rate and the actions. If there is a mesh, it also gets its vertices in the world, at
rest and at the first and last of `frames`.
"""

import json
import sys

import bpy
import numpy as np


def _import(job):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    file = job["file"]
    if file.endswith(".bvh"):
        bpy.ops.import_anim.bvh(
            filepath=file, global_scale=job.get("scale", 0.01), axis_forward="-Z", axis_up="Y", update_scene_fps=True,
            update_scene_duration=True, rotate_mode="NATIVE",
        )  # fmt: skip
    elif file.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=file)
    elif job.get("importer") == "native":
        bpy.ops.wm.fbx_import(filepath=file)
    else:
        bpy.ops.import_scene.fbx(filepath=file)


def _matrices(rig, bones, rest):
    if rest:
        return [rig.matrix_world @ rig.data.bones[name].matrix_local for name in bones]
    return [rig.matrix_world @ rig.pose.bones[name].matrix for name in bones]


def _vertices(mesh):
    graph = bpy.context.evaluated_depsgraph_get()
    shaped = mesh.evaluated_get(graph)
    data = shaped.to_mesh()
    out = np.array([list(shaped.matrix_world @ v.co) for v in data.vertices])
    shaped.to_mesh_clear()
    return out


def _read(job):
    _import(job)
    rig = next(o for o in bpy.data.objects if o.type == "ARMATURE")
    meshes = [o for o in bpy.data.objects if o.type == "MESH" and o.find_armature()]  # no custom bone shapes
    bones = [bone.name for bone in rig.data.bones]
    parents = [bones.index(b.parent.name) if b.parent else -1 for b in rig.data.bones]
    action = rig.animation_data.action
    first = action.frame_range[0]
    scene = bpy.context.scene
    out = {
        "names": np.array(bones),
        "parents": np.array(parents),
        "fps": scene.render.fps / scene.render.fps_base,
        "unit": scene.unit_settings.scale_length,
        "actions": np.array(sorted(a.name for a in bpy.data.actions)),
        "frame_range": np.array(list(action.frame_range)),
        "rest": np.array([np.array(m) for m in _matrices(rig, bones, True)]),
    }
    poses = []
    for k, frame in enumerate(job["frames"]):
        at = first + frame
        scene.frame_set(int(at // 1), subframe=float(at % 1))
        poses.append([np.array(m) for m in _matrices(rig, bones, False)])
        if meshes and k in (0, len(job["frames"]) - 1):
            out[f"mesh_{k}"] = _vertices(meshes[0])
    out["poses"] = np.array(poses)
    if meshes:
        rig.data.pose_position = "REST"
        bpy.context.view_layer.update()
        out["mesh_rest"] = _vertices(meshes[0])
        rig.data.pose_position = "POSE"
    np.savez(job["out"], **out)


for job in json.load(open(sys.argv[1])):
    _read(job)
