"""The solve: `tasks` (what mink minimises), `limits` (what it may not exceed), `solver` (one frame of the
humanoid following the joints), `swing` (a pose without inverse kinematics)."""
