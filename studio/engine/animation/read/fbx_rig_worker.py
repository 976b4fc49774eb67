"""Worker of `apart` that reads the skeleton of an FBX with ufbx: nodes and their rest pose, without animation."""

from pathlib import Path
from typing import Any

import numpy as np

from studio.engine.animation.read.apart import work
from studio.engine.animation.read.fbx_worker import (
    bind_matrices,
    load_scene,
    transform_arrays,
    transform_row,
    tree_of,
)


def read(path: Path) -> dict[str, Any]:
    """Return names, parents, which nodes are bones, bind matrices, and the nodes' own transforms."""
    scene = load_scene(path)
    nodes = list(scene.nodes)
    own = np.array([[transform_row(node.local_transform) for node in nodes]])
    return {**tree_of(nodes), "rest": bind_matrices(scene, nodes), **transform_arrays("own_", own)}


if __name__ == "__main__":
    work(read)
