"""Facts of a robot that a user is shown: its parts, sizes and limits. `describe` collects them."""

from msgspec import Struct


class JointFacts(Struct):
    """A hinge: its limits, and its axis in the zero pose (`turns`), `held` if no part needs it; `torque_nm` is the
    smaller limit of both directions, None where the model gives none."""

    name: str
    low_rad: float
    high_rad: float
    velocity_rad_s: float
    torque_nm: float | None
    turns: str


class RobotFacts(Struct):
    """A robot as measured; lengths in metres. `parts` gives the body of each part, `bodies` all bodies."""

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
