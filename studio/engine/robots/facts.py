"""What a user is shown of a robot, as it is told: its parts, sizes and limits. `describe` finds it out."""

from msgspec import Struct


class JointFacts(Struct):
    """A hinge: its limits, and about which axis it turns in the zero pose; `held` is one that no part needs;
    `torque_nm` the smaller of both directions' limits, None where the model gives none."""

    name: str
    low_rad: float
    high_rad: float
    velocity_rad_s: float
    torque_nm: float | None
    turns: str


class RobotFacts(Struct):
    """A robot as measured; lengths in metres. `parts` are bodies by part, `bodies` all that there are."""

    name: str
    parts: dict[str, str]
    bodies: list[str]
    joints: list[JointFacts]
    moved: int
    height_m: float
    leg_m: float
    lengths_m: dict[str, float]
    sole_m: list[float]
    mass_kg: float
    notes: list[str]
