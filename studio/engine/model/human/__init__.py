"""The human model: `ranges` of every degree of freedom, `skeleton` (the output joints at rest and their
forward kinematics), `humanoid` (the MuJoCo model that the solve drives)."""
