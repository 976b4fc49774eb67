"""The verdict on ordinary cameras that were calibrated from a walk, with reasons and advice."""

from dataclasses import dataclass

from studio.engine.base.sentences import Said, say
from studio.engine.calibration.quality.verdict import GOOD_OFFSET_SD_S, clock_uncertain
from studio.engine.calibration.views.judging.figures import BodyMotion
from studio.engine.calibration.views.judging.result import Rests, Uncertain

GOOD_MRAD, MOST_MRAD = 9.0, 15.0
"""Mean residual of a camera: 7 mrad is usual; 26 and more come from people whose landmarks are guessed."""
GOOD_PLACE_M, MOST_PLACE_M, MOST_OF_TWO_M = 0.06, 0.25, 0.09
"""Limits of a place's uncertainty; stricter for two cameras, because no third shows errors common to both."""
GOOD_TURN_DEG, MOST_TURN_DEG = 1.5, 3.0
GOOD_FOCAL, GOOD_FOCAL_ON_SPOT, MOST_FOCAL = 0.03, 0.02, 0.15
LEAST_KNEES = 0.4
LEAST_ALIKE = 0.25
LEAST_PARALLAX_DEG = 10.0
LEAST_LIMBS_M = 0.06
LEAST_TRAVEL_M = 0.3
LEAST_UPRIGHT = 0.6


@dataclass(frozen=True)
class ViewFacts:
    """Input of a camera's verdict.

    Attributes:
        rests: residuals of its landmarks.
        uncertain: standard deviations of its parameters.
        focal_sought: whether its focal length was not given.
        knees: share of the frames with a body in which the knees are seen.
        alike: correlation of its motion with that of the most similar camera.
        parallax_deg: largest angle, seen from the performer, to another camera.
        motion: the performer's.
        cameras: number of cameras.
        twin: an earlier camera with the same place and direction.
    """

    rests: Rests
    uncertain: Uncertain
    focal_sought: bool
    knees: float
    alike: float
    parallax_deg: float
    motion: BodyMotion
    cameras: int
    twin: str | None = None


def verdict(facts: ViewFacts) -> tuple[str, tuple[Said, ...]]:
    """Return `good`, `usable` or `refused`, and the reasons, for one camera."""
    refused, doubts = _of_performer(facts), []
    if facts.alike < LEAST_ALIKE:
        refused.append(motion_differs())
    if facts.twin is not None:
        refused.append(same_picture(facts.twin))
    if facts.parallax_deg < LEAST_PARALLAX_DEG:
        refused.append(
            say(
                "views.beside",
                "it stands beside the other camera ({degrees:.0f} degrees, seen from the performer): place the "
                "cameras further apart, a quarter of a circle is best",
                degrees=facts.parallax_deg,
            )
        )
    if not facts.rests.mean_mrad <= GOOD_MRAD:
        wrong = not facts.rests.mean_mrad <= MOST_MRAD
        (refused if wrong else doubts).append(
            say(
                "views.disagrees",
                "its landmarks miss the performer found by all cameras by {mrad:.0f} mrad ({most:.0f} at most): let "
                "one performer alone walk, the whole body in every picture",
                mrad=facts.rests.mean_mrad,
                most=MOST_MRAD,
            )
        )
    _judge_uncertain(facts, refused, doubts)
    if refused:
        return "refused", tuple(refused + doubts)
    return ("usable", tuple(doubts)) if doubts else ("good", ())


def _of_performer(facts: ViewFacts) -> list[Said]:
    """Return what in the performer's motion prevents a calibration."""
    reasons = []
    if facts.knees < LEAST_KNEES:
        reasons.append(knees_unseen(facts.knees))
    if facts.motion.upright < LEAST_UPRIGHT:
        reasons.append(
            say("views.seated", "the performer sits or crouches: stand up and walk through the whole stage")
        )
    if facts.motion.limbs_m < LEAST_LIMBS_M and facts.motion.travel_m < LEAST_TRAVEL_M:
        reasons.append(still())
    return reasons


def _judge_uncertain(facts: ViewFacts, refused: list[Said], doubts: list[Said]) -> None:
    uncertain = facts.uncertain
    on_spot = facts.motion.travel_m < LEAST_TRAVEL_M
    if facts.focal_sought and uncertain.focal_share > (GOOD_FOCAL_ON_SPOT if on_spot else GOOD_FOCAL):
        percent = uncertain.focal_share * 100
        (refused if uncertain.focal_share > MOST_FOCAL else doubts).append(
            say(
                "views.focal_on_spot",
                "the performer stayed on one spot, so the focal length is known to {percent:.0f} % only: walk "
                "through the whole stage, near to the camera and far from it",
                percent=percent,
            )
            if on_spot
            else say(
                "views.focal_uncertain",
                "the focal length is known to {percent:.0f} % only: walk for longer, near to the camera and far "
                "from it",
                percent=percent,
            )
        )
    if uncertain.place_m > GOOD_PLACE_M or uncertain.turn_deg > GOOD_TURN_DEG:
        most = MOST_PLACE_M if facts.cameras > 2 else MOST_OF_TWO_M
        wrong = uncertain.place_m > most or uncertain.turn_deg > MOST_TURN_DEG
        (refused if wrong else doubts).append(
            say(
                "views.place_uncertain",
                "its place is known to {cm:.0f} cm and {degrees:.1f} degrees only: walk for longer through the whole "
                "stage, add a camera, or give the focal lengths",
                cm=uncertain.place_m * 100,
                degrees=uncertain.turn_deg,
            )
        )
    if uncertain.ahead_s > GOOD_OFFSET_SD_S:
        doubts.append(clock_uncertain(uncertain.ahead_s))


def knees_unseen(share: float) -> Said:
    return say(
        "views.knees_unseen",
        "the knees are seen in {percent:.0f} % of its pictures only: place the camera so that the whole body, "
        "standing, is in the picture",
        percent=share * 100,
    )


def still() -> Said:
    return say("views.still", "the performer stood still: walk through the whole stage")


def motion_differs() -> Said:
    return say(
        "views.motion_differs",
        "the motion in its pictures is not that of the other cameras: let all cameras see one performer at the same "
        "time",
    )


def same_picture(other: str) -> Said:
    return say(
        "views.same_picture",
        "it shows the same pictures as {other}: give each client a camera of its own",
        other=other,
    )
