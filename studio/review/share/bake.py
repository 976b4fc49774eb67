"""A solve as a small GLB for the replay page: the mannequin, linear keys at 30 Hz, 16-bit rotations."""

from collections.abc import Sequence

import numpy as np

from studio.engine.animation.clip.clip import clip
from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.together import on_one_clock
from studio.engine.animation.export.glb import GltfDocument
from studio.engine.animation.mannequin import mannequin
from studio.engine.identity.recognised import performer_key
from studio.engine.model.performers.colours import performer_colour
from studio.engine.model.poses import Poses

KEYS_HZ = 30.0
"""Rate of the keys. Linear keys at this rate are within a millimetre of the motion on average."""


def replay_glb(
    poses: Poses | Sequence[Poses], *, start_s: float | None = None, end_s: float | None = None
) -> bytes:
    """Return the part of a solve from `start_s` to `end_s` [s from its first frame] as a GLB file, with all its
    performers.

    Raises:
        FormatError: poses that cannot be exported.
        SettingsError: there is no frame in that part.
    """
    performers = [poses] if isinstance(poses, Poses) else on_one_clock(poses)
    document = GltfDocument(packed=True)
    for number, one in enumerate(performers, 1):
        rate = min(KEYS_HZ, 1.0 / float(np.median(np.diff(one.time_s)))) if one.frame_count > 1 else KEYS_HZ
        options = ExportOptions(
            fps=rate, interpolation="linear", start_s=start_s, end_s=end_s, take_name="replay", mesh=True
        )
        motion = clip(one, options)
        if len(performers) == 1:
            document.add_skeleton(motion)
            document.add_mesh(mannequin(motion))
            document.add_animation(motion, "linear")
        else:
            linear = [(part / 255.0) ** 2.2 for part in performer_colour(number)]  # glTF's colours are linear
            document.add_performer(performer_key(number), motion, mannequin(motion), "linear", [*linear, 1.0])
    return b"".join(document.finished())
