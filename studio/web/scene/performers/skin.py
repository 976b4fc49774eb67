"""Skinned meshes of the browser view, with a body's bones as cheap messages.

viser's bone handles compare every value with the last one, which costs 2.6 ms of a core for 52 bones. Their two
messages per bone, put directly into viser's queue, cost 0.3 ms. The queue keeps only the newest message of each bone,
so that a browser that connects later gets the newest pose.
"""

import numpy as np
import viser
from numpy.typing import NDArray
from viser._messages import SetBoneOrientationMessage, SetBonePositionMessage

from studio.engine.animation.mannequin import SkinnedMesh

WINDOW = 512
"""Number of messages that viser sends at once: more than a frame has, so that no browser shows half a pose."""

Rgb = tuple[int, int, int]


def send_frames_whole(server: viser.ViserServer) -> None:
    """Make viser send all messages of one drawn frame together."""
    server._websock_server.get_message_buffer().max_window_size = WINDOW


def joints_of(mesh: SkinnedMesh, tone: int) -> NDArray[np.int64]:
    """Return the joints that move the triangles of a tone, increasing."""
    vertices = np.unique(mesh.triangles[mesh.tones == tone])
    return np.unique(mesh.joint_indices[vertices][mesh.weights[vertices] > 0.0]).astype(np.int64)


class Skin:
    """The triangles of one tone of a body, in the stage frame; its bones are the body's joints."""

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        mesh: SkinnedMesh,
        rest_m: NDArray[np.float64],
        *,
        tone: int,
        joints: NDArray[np.int64],
        rgb: Rgb,
        opacity: float | None,
    ) -> None:
        """Add it to the scene in its rest pose.

        Args:
            server: the view's.
            name: of the scene's node.
            mesh: the body, stage axes.
            rest_m: the joints' rest positions in the stage's axes [m], shape (J, 3).
            tone: `BODY` or `SEAM`; joints: those with a bone: all that move its triangles, increasing.
            rgb: its colour; opacity: None = opaque.
        """
        triangles = mesh.triangles[mesh.tones == tone]
        vertices, faces = np.unique(triangles, return_inverse=True)
        indices, weights = mesh.joint_indices[vertices], mesh.weights[vertices]
        bones = np.searchsorted(joints, indices[weights > 0.0])
        shares = np.zeros((len(vertices), len(joints)), dtype=np.float32)
        rows, _ = np.nonzero(weights > 0.0)
        shares[rows, bones] = weights[weights > 0.0]
        self._joints = joints
        self._scene = server.scene
        self._handle = server.scene.add_mesh_skinned(
            name,
            mesh.vertices_m[vertices],
            faces.reshape(-1, 3),
            bone_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(joints), 1)),
            bone_positions=rest_m[self._joints],
            skin_weights=shares,
            color=rgb,
            opacity=opacity,
        )
        self._name = self._handle.name

    def pose(self, positions_m: NDArray[np.float64], rotations_wxyz: NDArray[np.float64]) -> None:
        """Show a pose; joint positions [m], shape (J, 3), and world rotations, shape (J, 4)."""
        queue = self._scene._queue_scene_message
        places, turns = positions_m[self._joints].tolist(), rotations_wxyz[self._joints].tolist()
        for bone, (place, turn) in enumerate(zip(places, turns, strict=True)):
            queue(SetBonePositionMessage(self._name, bone, tuple(place)))
            queue(SetBoneOrientationMessage(self._name, bone, tuple(turn)))

    def set_opacity(self, opacity: float | None) -> None:
        """Make it transparent, or not (None)."""
        if self._handle.opacity != opacity:
            self._handle.opacity = opacity

    def set_colour(self, rgb: Rgb) -> None:
        """Give it another colour."""
        if self._handle.color != rgb:
            self._handle.color = rgb

    def remove(self) -> None:
        """Remove it from the scene."""
        self._handle.remove()
