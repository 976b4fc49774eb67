"""Endings of reference files, in a separate module that imports no reader."""

REFERENCE_KINDS: tuple[str, ...] = (
    ".csv", ".bvh", ".fbx", ".glb", ".gltf", ".c3d", ".trc", ".npz", ".txt",
)  # fmt: skip
"""Endings that `reference.read_reference` reads."""
