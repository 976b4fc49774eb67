"""FBX: binary 7400, a skeleton of LimbNodes with animation curves, one stack per take, and a skinned body.

Centimetres, y up, facing +z, a T-pose of zero rotations in the BindPose (bones with their own axes have them as
pre-rotation). `skeleton` makes the bones, `mesh` the body, `curves` the animation, from the records of
`binary`; `scene` has the file's settings.
"""

import os
from collections.abc import Callable, Sequence

import numpy as np

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.curves.euler import best_order
from studio.engine.animation.export.fbx import scene
from studio.engine.animation.export.fbx.binary import Node, write_nodes
from studio.engine.animation.export.fbx.curves import add_take
from studio.engine.animation.export.fbx.mesh import add_mesh
from studio.engine.animation.export.fbx.objects import Objects
from studio.engine.animation.export.fbx.skeleton import add_skeleton, local_turns
from studio.engine.base.errors import SettingsError
from studio.engine.base.files import write_atomically


def write_fbx(
    motions: LocalMotion | Sequence[LocalMotion],
    path: str | os.PathLike[str],
    options: ExportOptions,
    *,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write one or several takes of a skeleton as a binary FBX file, atomically.

    Args:
        motions: a take, or several with the same joints and rate; the rest pose is the first one's. Repeated names
            are numbered.
        path: of the file; an existing one is replaced.
        options: `interpolation`, `mesh` and `key_error_cm` are used.
        progress: receives the share done.

    Raises:
        SettingsError: takes that cannot share a file.
        FormatError: no body fits the skeleton.
        StudioError: the file cannot be written.
    """
    takes = [motions] if isinstance(motions, LocalMotion) else list(motions)
    _check_alike(takes)
    first = takes[0]
    turns = [local_turns(first, motion.between or motion) for motion in takes]
    orders = [
        best_order(np.concatenate([turn[:, joint] for turn in turns])) for joint in range(len(first.parents))
    ]
    objects = Objects()
    models = add_skeleton(objects, first, orders)
    if options.mesh:
        add_mesh(objects, first, models)
    names = _distinct([motion.name for motion in takes])
    stops = []
    for k, (motion, turn, name) in enumerate(zip(takes, turns, names, strict=True)):

        def told(share: float, k: int = k) -> None:
            if progress is not None:
                progress(0.9 * (k + share) / len(takes))

        stops.append(add_take(objects, first, motion, turn, models, orders, name, options, told))
    starts = [scene.ticks_at(motion.start_s) for motion in takes]
    spans = list(zip(names, starts, stops, strict=True))
    nodes = [
        *scene.header(),
        scene.global_settings(
            first.frames_per_second, min(starts), max(stops), timecode=options.timecode is not None
        ),
        *scene.documents(objects.identity(), names[0]),
        scene.definitions(objects.nodes),
        Node("Objects", children=objects.nodes),
        Node("Connections", children=objects.connections),
        scene.takes(spans),
    ]
    with write_atomically(path) as file:
        write_nodes(file, nodes)


def _check_alike(takes: list[LocalMotion]) -> None:
    first = takes[0]
    for motion in takes[1:]:
        if motion.joint_names != first.joint_names or motion.parents.tolist() != first.parents.tolist():
            raise SettingsError(
                "export.other_joints",
                "take {take}: its skeleton has other joints than that of {other}; export it to a "
                "file of its own",
                take=motion.name,
                other=first.name,
            )
        if motion.frames_per_second != first.frames_per_second:
            raise SettingsError(
                "export.other_rate",
                "take {take}: {fps:g} frames a second, {other} has {rate:g}; give one rate with fps",
                take=motion.name,
                fps=motion.frames_per_second,
                other=first.name,
                rate=first.frames_per_second,
            )


def _distinct(names: list[str]) -> list[str]:
    out: list[str] = []
    for name in names:
        number, chosen = 2, name
        while chosen in out:
            chosen = f"{name} {number}"
            number += 1
        out.append(chosen)
    return out
