"""The free joint of a robot's base, as MuJoCo writes it."""

FREE = 7
"""Number of values of the free base in a configuration: position [m], then quaternion wxyz."""

FREE_DOFS = 6
"""Its degrees of freedom."""
