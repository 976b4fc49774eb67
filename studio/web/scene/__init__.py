"""The content of the 3D view: characters, skeletons, cameras, targets, and viewpoints."""
