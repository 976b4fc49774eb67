"""The solve: `tasks` (objective and limits for mink), `solver` (one frame of the humanoid), `twist` (damping of
straight limbs), `reseed` (restart of stuck limbs), `swing` (a pose without inverse kinematics).
"""
