"""Exports onto a user's own rig.

`files` reads a rig (`rig`), `mapping` gives its bones roles, `facts` describes both, and `rest` turns the rest pose
into a T-pose. `transfer` moves the motion onto the rig (`skeleton`), with feet and hands by `limbs` and `floor`.
`onto` writes it, and `glb` keeps the rest of a GLB.
"""
