"""Readers of foreign animation files.

`gltf`, `fbx` and `motion.bvh` read skeletons as `motion.Motion`. `c3d` and `trc` read points (`points`), and
`landmarks` computes canonical joints from them. `imported` makes poses of either. Libraries run in a separate process
(`apart`), so that a damaged file cannot crash the program.
"""
