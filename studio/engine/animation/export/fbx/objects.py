"""The objects of an FBX file and their connections."""

import numpy as np

from studio.engine.animation.export.fbx.binary import Node

_FIRST_IDENTITY = 1_000_000


class Objects:
    """Collects objects and connections.

    Attributes:
        nodes: of the objects, in the order of adding.
        connections: child to parent.
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.connections: list[Node] = []
        self._last_identity = _FIRST_IDENTITY

    def identity(self) -> np.int64:
        self._last_identity += 1
        return np.int64(self._last_identity)

    def add(self, kind: str, name: str, tag: str, subtype: str, *children: Node) -> np.int64:
        """Add an object of a kind (`Model`, `Deformer`, ...) and return its identity."""
        identity = self.identity()
        full_name = f"{name}\x00\x01{tag}"
        self.nodes.append(Node(kind, identity, full_name, subtype, children=children, closed=True))
        return identity

    def connect(self, child: np.int64, parent: np.int64, to_property: str | None = None) -> None:
        """Connect an object to another (0 = the scene), or to a property of it."""
        values = ("OO", child, parent) if to_property is None else ("OP", child, parent, to_property)
        self.connections.append(Node("C", *values))
