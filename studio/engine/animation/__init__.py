"""Animation files made elsewhere: reading them, and naming what their joints are.

`roles` maps joint names to HumanIK's; `gltf` and `fbx` read skeletons as `motion.Motion`, as `motion.bvh` does; `c3d`
and `trc` read points (`points`), which `landmarks` brings to canonical joints. `imported` makes poses of either. What
a library reads runs in a process of its own (`apart`), so that a broken file cannot break the program.
"""
