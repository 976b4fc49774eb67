"""An operator's knowledge of rigid bodies: the place of their system, and the use and shape of each."""

from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.base.quaternions import multiply, rotate
from studio.engine.base.value_sentences import bad_setting
from studio.engine.model.joints import INDEX
from studio.engine.model.rigid_body import RigidShape

USES = ("reference", "prop", "evidence")
MOST_BODIES = 64
_LONGEST = 64
_SIZES = {"box": 3, "cylinder": 2, "sphere": 1}
_CM = (0.1, 1000.0)
_FARTHEST_M = 1000.0


class BodyPlace(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Place of another system's origin on the stage [m], and its turn about the vertical [degrees]."""

    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0
    yaw_deg: float = 0.0

    def moved(
        self, positions_m: NDArray[np.float64], rotations_wxyz: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return places, shape (n, 3), and rotations, shape (n, 4), of that system in the stage frame."""
        turns = np.broadcast_to(self._turn, rotations_wxyz.shape)
        return self.moved_points(positions_m), multiply(turns, rotations_wxyz)

    def moved_points(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points of that system, shape (n, 3), in the stage frame."""
        turns = np.broadcast_to(self._turn, (len(points_m), 4))
        return rotate(turns, points_m) + np.array([self.x_m, self.y_m, self.z_m])

    @property
    def _turn(self) -> NDArray[np.float64]:
        half = np.radians(self.yaw_deg) / 2
        return np.array([np.cos(half), 0.0, 0.0, np.sin(half)])


class KnownBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Use and shape of a rigid body.

    Attributes:
        name: its name in its system.
        use: `reference`: solves are measured against it; `prop`: an object, exported as one; `evidence`: it holds its
            joint in place in solves.
        joint: the canonical joint that it sits on, or the hand that holds it; "" = none.
        performer: the performer with this joint.
        shape: None = unknown.
    """

    name: str
    use: Literal["reference", "prop", "evidence"] = "prop"
    joint: str = ""
    performer: str = "performer_1"
    shape: RigidShape | None = None


class Tie(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Measured place of a body on its joint.

    Attributes:
        offset_m: from the body's origin to the joint, in the body's axes [m].
        residual_mm: median distance between the joint and its place by the body.
    """

    offset_m: tuple[float, float, float]
    residual_mm: float


class TakeBodies(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The rigid bodies of a take.

    Attributes:
        place: place of their system.
        bodies: use and shape of each; a body that is not listed is only shown.
        later_s: time added to the arrival of their readings [s], for the delay of the network and their system.
        ties: places of bodies on their joints, by name; measured against a solve.
        calibration: number of the take's calibration for which the place holds; None = the stage's own.
        markers: the canonical joints on which markers sit, by the marker's name.
    """

    place: BodyPlace = BodyPlace()
    bodies: tuple[KnownBody, ...] = ()
    later_s: float = 0.0
    ties: dict[str, Tie] = {}
    calibration: int | None = None
    markers: dict[str, str] = {}

    def named(self, name: str) -> KnownBody | None:
        """Return a body's use and shape; None if it is not listed."""
        return next((one for one in self.bodies if one.name == name), None)


def shape_of(text: str) -> RigidShape:
    """Return the shape of a text such as `cylinder:3,60` (cm); `cylinder:3,60,x` lies along x.

    Raises:
        SettingsError: it is none.
    """
    kind, _, rest = text.partition(":")
    sizes, axis = rest.split(","), "z"
    if kind == "cylinder" and len(sizes) == 3:
        axis = sizes.pop()
    try:
        value = {"kind": kind, "size_cm": [float(one) for one in sizes], "axis": axis}
        shape = msgspec.convert(value, RigidShape)
    except (ValueError, msgspec.ValidationError) as error:
        allowed = "box:X,Y,Z, cylinder:DIAMETER,LENGTH[,AXIS] or sphere:DIAMETER in cm"
        raise bad_value("shape", text[:80], allowed) from error
    _check_shape(shape)
    return shape


def check_bodies(bodies: tuple[KnownBody, ...], place: BodyPlace) -> None:
    """Check bodies and the place of their system.

    Raises:
        SettingsError: a value that is not allowed.
    """
    if len(bodies) > MOST_BODIES:
        raise bad_value("bodies", len(bodies), f"up to {MOST_BODIES}")
    if len({one.name for one in bodies}) < len(bodies):
        raise bad_value("bodies", ", ".join(one.name for one in bodies)[:200], "each name once")
    numbers = (place.x_m, place.y_m, place.z_m)
    if not all(abs(one) <= _FARTHEST_M for one in numbers) or not abs(place.yaw_deg) <= 360.0:
        raise bad_value("place", place, f"up to {_FARTHEST_M:g} m and 360 degrees")
    for one in bodies:
        if not 1 <= len(one.name) <= _LONGEST or not one.name.isprintable():
            raise bad_value("name", one.name[:80], f"1 to {_LONGEST} letters, digits and signs")
        if one.joint and one.joint not in INDEX:
            raise bad_value("joint", one.joint[:80], ", ".join(INDEX))
        if one.use != "prop" and not one.joint:
            raise bad_value("joint", "", f"a joint, as {one.name} is used as {one.use}")
        if one.shape is not None:
            _check_shape(one.shape)


def _check_shape(shape: RigidShape) -> None:
    count = _SIZES[shape.kind]
    if len(shape.size_cm) != count or not all(_CM[0] <= edge <= _CM[1] for edge in shape.size_cm):
        raise bad_value(
            "size_cm", ",".join(f"{edge:g}" for edge in shape.size_cm),
            f"{count} numbers of {_CM[0]:g} to {_CM[1]:g} for a {shape.kind}",
        )  # fmt: skip


def bad_value(name: str, value: object, allowed: str) -> SettingsError:
    """Return the error for a value that is not allowed."""
    shown = value if isinstance(value, int) else str(value)[:200]
    return SettingsError(bad_setting(name, shown, allowed))
