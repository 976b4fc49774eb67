"""Recovery of both arms at once. If each arm lies on the other's points, all points appear explained, and a search
for one arm finds nothing.
"""

from studio.engine.seeing.fitting.chain import Pose
from studio.engine.seeing.fitting.cones import PARTS
from studio.engine.seeing.fitting.fit import BodyShape, Fitter, MeasuredPoints, Prior
from studio.engine.seeing.images.silhouette import Silhouette
from studio.engine.seeing.search.limbs import LimbSearch
from studio.engine.seeing.search.start import cost_of

ARMS: tuple[int, int] = (PARTS.index("left_arm"), PARTS.index("right_arm"))
_BETTER = 0.7
"""Maximum residual of a new pose of both arms, as a share of the present residual."""
_ELSEWHERE_M = 10.0


def both_found(
    fitter: Fitter,
    search: LimbSearch,
    figure: BodyShape,
    pose: Pose,
    points: MeasuredPoints,
    silhouettes: tuple[Silhouette, ...],
    prior: Prior,
) -> Pose:
    """Return the pose with both arms moved, if that reduces the residual enough.

    The first arm is searched without the other, then the other arm.
    """
    first, second = (limb for limb in search.limbs if limb.part in ARMS)
    distance = fitter.match(figure, pose, points)[-1]
    before = cost_of(search, figure, pose, distance, points, silhouettes)
    distance[:, second.part] = _ELSEWHERE_M
    found, _ = search.search(first, figure, pose, distance, points, silhouettes, prior)
    distance = fitter.match(figure, found, points)[-1]
    found, _ = search.search(second, figure, found, distance, points, silhouettes, prior)
    distance = fitter.match(figure, found, points)[-1]
    after = cost_of(search, figure, found, distance, points, silhouettes)
    return found if after < _BETTER * before else pose
