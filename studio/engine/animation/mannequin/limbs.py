"""Arms and legs: one tube each from the girdle to the wrist or ankle, with a ball in every joint.

The tube bends smoothly at elbow and knee. The ball in it lies under the groove at rest and keeps the joint's volume
in a sharp bend. Shoulders, hips, wrists and ankles are separate balls, so that a limb can twist without distorting
the surface.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.loft import Sections, capped_places, course, dome, loft, smoothstep
from studio.engine.animation.mannequin.mesh import BODY, SEAM, MannequinPart
from studio.engine.animation.mannequin.rig import MannequinRig

Array = NDArray[np.float64]

_GROOVE_WIDE, _GROOVE_DEEP = 0.008, 0.0035


@dataclass(frozen=True)
class LimbShape:
    """Shape of a limb. Radii are metres at a stature of 1.75 m. Places are 0 at the root, 1 at the middle joint
    and 2 at the far one.

    Attributes:
        roles: joints, root to end, without their side.
        profile: (place, radius across, radius before, radius behind).
        balls: place -> radius, of the joints' balls.
        sectors: of the tube and of the balls that are seen.
        start, stop: distance from the root to the tube's start, and from the tube's end to the end joint [m].
        dome: length of the rounding at its root, relative to its radius there.
        front: direction of the limb's front in the rest pose.
        part: its name in a `Build`.
    """

    roles: tuple[str, str, str]
    profile: tuple[tuple[float, float, float, float], ...]
    balls: dict[int, float]
    sectors: int
    start: float
    stop: float
    dome: float
    front: tuple[float, float, float]
    part: str

    def factors(self, rig: MannequinRig, place: Array) -> Array:
        """Return the build's factors of the radii at places."""
        return course(list(getattr(rig.build, self.part)), place)


ARM = LimbShape(
    roles=("Arm", "ForeArm", "Hand"),
    profile=(
        (0.0, 0.052, 0.052, 0.052), (0.2, 0.053, 0.051, 0.053), (0.42, 0.049, 0.048, 0.048),
        (0.65, 0.043, 0.045, 0.044), (0.85, 0.040, 0.040, 0.040), (1.0, 0.040, 0.039, 0.040),
        (1.2, 0.046, 0.043, 0.043), (1.45, 0.040, 0.037, 0.037), (1.8, 0.028, 0.025, 0.025),
        (2.0, 0.027, 0.023, 0.023),
    ),
    balls={0: 0.0485, 1: 0.0345, 2: 0.0255},
    sectors=20,
    start=-0.022,
    stop=0.012,
    dome=0.85,
    front=(0.0, 0.0, 1.0),
    part="arm",
)  # fmt: skip

LEG = LimbShape(
    roles=("UpLeg", "Leg", "Foot"),
    profile=(
        (0.0, 0.084, 0.090, 0.096), (0.2, 0.084, 0.091, 0.090), (0.45, 0.077, 0.085, 0.080),
        (0.75, 0.062, 0.068, 0.064), (0.93, 0.054, 0.058, 0.055), (1.0, 0.053, 0.059, 0.054),
        (1.1, 0.053, 0.054, 0.060), (1.28, 0.059, 0.050, 0.074), (1.5, 0.051, 0.045, 0.063),
        (1.75, 0.038, 0.037, 0.042), (1.88, 0.034, 0.036, 0.037), (2.0, 0.034, 0.037, 0.038),
    ),
    balls={0: 0.070, 1: 0.0485, 2: 0.0355},
    sectors=16,
    start=-0.012,
    stop=0.012,
    dome=0.75,
    front=(0.0, 0.0, 1.0),
    part="leg",
)  # fmt: skip


def limb(rig: MannequinRig, shape: LimbShape, side: str) -> list[MannequinPart]:
    """Return the tube and the balls of one limb."""
    roles = [f"{side}{name}" for name in shape.roles]
    return [_tube(rig, shape, roles), *(_ball(rig, shape, roles, k) for k in shape.balls)]


def _ball(rig: MannequinRig, shape: LimbShape, roles: list[str], k: int) -> MannequinPart:
    radii = np.full(3, shape.balls[k] * rig.girth) * shape.factors(rig, np.array([float(k)]))
    if k == 1:  # visible only in a sharp bend
        return ball(rig, roles[k], rig.at(roles[k]), radii, BODY, 12, 7)
    return ball(rig, roles[k], rig.at(roles[k]), radii, SEAM, shape.sectors, 9)


def ball(
    rig: MannequinRig, role: str, centre: Array, radii: Array, tone: int, sectors: int = 14, rings: int = 7
) -> MannequinPart:
    """Return an ellipsoid that follows one joint; radii along x, y and z [m], shape (3,)."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, rings)
    ring = np.cos(turn)
    ring[[0, -1]] = 0.0
    ones = np.ones(rings)
    sections = Sections(
        centres=centre + np.outer(np.sin(turn) * radii[1], [0.0, 1.0, 0.0]),
        across=np.outer(ones, [0.0, 0.0, 1.0]),
        front=np.outer(ones, [1.0, 0.0, 0.0]),
        wide=ring * radii[2],
        fore=ring * radii[0],
        aft=ring * radii[0],
        power=2.0 * ones,
    )
    points, triangles, _ = loft(sections, sectors)
    return MannequinPart(points, triangles, rig.weights({role: 1.0}, len(points)), tone)


def _tube(rig: MannequinRig, shape: LimbShape, roles: list[str]) -> MannequinPart:
    root, middle, end = (rig.at(role) for role in roles)
    lengths = np.linalg.norm([middle - root, end - middle], axis=1)
    g = rig.girth
    reach = float(lengths.sum())
    start, stop = shape.start * g, reach - min(shape.stop * g, 0.2 * lengths[1])
    first, last = (shape.profile[k][1] * g for k in (0, -1))
    caps = (shape.dome * first, 0.35 * last)
    at = capped_places(start, stop, *caps, 7)
    bend = lengths[0] + _GROOVE_WIDE * g * np.array([-4, -2, -0.7, 0, 0.7, 2, 4])
    at = np.unique(np.concatenate([at, bend]))
    place = np.where(at < lengths[0], at / lengths[0], 1.0 + (at - lengths[0]) / lengths[1])
    radii = [course([(row[0], row[k]) for row in shape.profile], place) * g for k in (1, 2, 3)]
    groove = _GROOVE_DEEP * g * np.exp(-(((at - lengths[0]) / (0.5 * _GROOVE_WIDE * g)) ** 2))
    round_off = dome(at, start, stop, *caps) * shape.factors(rig, place)
    wide, fore, aft = ((radius - groove) * round_off for radius in radii)
    along = _along(at, (root, middle, end), lengths)
    tangents = _tangents(at, (root, middle, end), lengths, 1.5 * wide.max())
    across: Array = np.cross(np.array(shape.front), tangents)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    sections = Sections(along, across, np.cross(tangents, across), wide, fore, aft, np.full(len(at), 2.2))
    points, triangles, section = loft(sections, shape.sectors)
    lower = smoothstep(at, lengths[0], 0.9 * float(np.interp(lengths[0], at, fore)))[section]
    weights = rig.weights({roles[0]: 1.0 - lower, roles[1]: lower}, len(points))
    return MannequinPart(points, triangles, weights, BODY)


def _along(at: Array, joints: tuple[Array, Array, Array], lengths: Array) -> Array:
    places = [0.0, lengths[0], lengths.sum()]
    return np.stack([np.interp(at, places, [joint[k] for joint in joints]) for k in range(3)], axis=1)


def _tangents(at: Array, joints: tuple[Array, Array, Array], lengths: Array, blend: float) -> Array:
    """Directions along the limb, turning smoothly where it bends at rest."""
    upper = (joints[1] - joints[0]) / lengths[0]
    lower = (joints[2] - joints[1]) / lengths[1]
    share = smoothstep(at, lengths[0], blend)[:, None]
    tangents = (1 - share) * upper + share * lower
    return tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
