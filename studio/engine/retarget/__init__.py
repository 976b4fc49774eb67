"""Exports onto a user's own rig.

`files` reads a rig (`rig`), `mapping` says which bone is what, `facts` tells about both; `rest` lays the rest pose as
a T-pose. `transfer` moves the motion onto the rig (`skeleton`), with feet and hands by `limbs` and `floor`; `onto`
writes it, and `glb` keeps what else a GLB holds.
"""
