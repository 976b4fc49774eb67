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
from studio.engine.animation.export.fbx.skeleton import add_performer, add_skeleton, local_turns
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

        stops.append(add_take(objects, first, motion, turn, models, orders, name, options, told)[1])
    starts = [scene.ticks_at(motion.start_s) for motion in takes]
    _write(path, objects, list(zip(names, starts, stops, strict=True)), first.frames_per_second, options)


def write_fbx_scene(
    performers: Sequence[tuple[str, LocalMotion]],
    path: str | os.PathLike[str],
    options: ExportOptions,
    *,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write several performers as a binary FBX file with one take, atomically.

    Each is a null of their name, above their skeleton and body, whose names have the performer's namespace.

    Args:
        performers: by names that are namespaces; all from the same instant on, at one rate.
        path, options, progress: as in `write_fbx`, also for errors.
    """
    objects = Objects()
    layer = None
    stops = []
    for k, (name, motion) in enumerate(performers):
        turns = local_turns(motion, motion.between or motion)
        orders = [best_order(turns[:, joint]) for joint in range(len(motion.parents))]
        top, space = add_performer(objects, name, motion), f"{name}:"
        models = add_skeleton(objects, motion, orders, space=space, under=top)
        if options.mesh:
            add_mesh(objects, motion, models, space=space, under=top)

        def told(share: float, k: int = k) -> None:
            if progress is not None:
                progress(0.9 * (k + share) / len(performers))

        layer, stop = add_take(
            objects, motion, motion, turns, models, orders, options.take_name, options, told, layer
        )
        stops.append(stop)
    first = performers[0][1]
    span = (options.take_name, scene.ticks_at(first.start_s), max(stops))
    _write(path, objects, [span], first.frames_per_second, options)


def _write(
    path: str | os.PathLike[str],
    objects: Objects,
    spans: list[tuple[str, np.int64, np.int64]],
    frames_per_second: float,
    options: ExportOptions,
) -> None:
    """Write the file; `spans`: name, start and stop of each take."""
    starts, stops = [span[1] for span in spans], [span[2] for span in spans]
    nodes = [
        *scene.header(),
        scene.global_settings(
            frames_per_second,
            min(starts),
            max(stops),
            timecode=options.timecode is not None or options.timecodes is not None,
            drop=options.timecodes is not None and options.timecodes.rate.drop,
        ),
        *scene.documents(objects.identity(), spans[0][0]),
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
