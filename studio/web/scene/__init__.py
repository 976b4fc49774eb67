"""The content of the 3D view, as nodes of viser's scene.

`scene` holds the layers and `drawing` draws the newest step into them. Besides the `performers` these are cameras
(`frusta`), their points (`clouds`), rigid bodies (`bodies`), `pins`, the `gizmo` and the `operator`'s view. All use
`balls` and `palette`.
"""
