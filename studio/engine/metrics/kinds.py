"""Endings of the files that are references; apart, so that naming them loads no reader."""

REFERENCE_KINDS: tuple[str, ...] = (
    ".csv", ".bvh", ".fbx", ".glb", ".gltf", ".c3d", ".trc", ".npz", ".txt",
)  # fmt: skip
"""What `reference.read_reference` reads."""
