"""Everything that the 3D view draws of one performer.

`figure` holds all of it: `character` (the mannequin, with `skin` for its meshes and `contact` for its shadows),
`skeletons` and trails, `effectors` (the solve's targets), `ghost` (a second solve) and `robot`. `names` places the
performers' names.

In: poses and joints in the stage frame. Out: nodes of viser's scene.
"""
