"""The human model: `ranges` of every degree of freedom, `skeleton` (the output joints at rest and their
forward kinematics), `model` (the MuJoCo humanoid that the solve drives)."""
