"""Both arms lost at once: each may lie on the other's points, which then look explained, so that neither is found
alone. They are found anew together."""

from studio.engine.tracker.body import PARTS
from studio.engine.tracker.chain import Pose
from studio.engine.tracker.fit import Figure, Fitter, Points, Prior
from studio.engine.tracker.limbs import LimbSearch
from studio.engine.tracker.silhouette import Silhouette
from studio.engine.tracker.start import cost_of

ARMS: tuple[int, int] = (PARTS.index("left_arm"), PARTS.index("right_arm"))
_BETTER = 0.7
"""Another pose of both arms must leave less than this share unexplained."""
_ELSEWHERE_M = 10.0


def both_found(
    fitter: Fitter,
    search: LimbSearch,
    figure: Figure,
    pose: Pose,
    points: Points,
    silhouettes: tuple[Silhouette, ...],
    prior: Prior,
) -> Pose:
    """Return the pose with both arms elsewhere, where that explains what is seen much better.

    One arm is searched for as if the other was not there, then the other one.
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
