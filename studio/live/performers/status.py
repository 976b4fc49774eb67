"""Everybody on a stage of several, as the status reports them."""

from studio.engine.base.sentences import say
from studio.engine.identity.recognised import MOST_PERFORMERS, OnStage
from studio.live.calibration.performers import has_profile
from studio.live.performers.performed import PerformedStage
from studio.live.states import PerformerState, PerformerStatus


def performers_status(stage: PerformedStage, now_ns: int) -> tuple[list[PerformerStatus], list[str]]:
    """Return everybody on the stage, and warnings about what may be lost; both empty while cameras show one body.

    Args:
        stage: the engine; called on its thread.
        now_ns: time of the server's clock [ns].
    """
    everybody = stage.on_stage()
    if not everybody:
        return [], []
    full = sum(one.performer is not None for one in everybody) >= MOST_PERFORMERS
    strangers = iter(stage.strangers.problems())
    out = [
        _stranger(next(strangers, []), full=full, everybody=stage.settings.everybody)
        if one.performer is None
        else _performer(stage, one, one.performer)
        for one in everybody
    ]
    return out, _warnings(stage, everybody, now_ns)


def _performer(stage: PerformedStage, one: OnStage, number: int) -> PerformerStatus:
    name = stage.cast.name(number)
    state: PerformerState = "undecided" if one.undecided else "here" if one.here else "away"
    message = ""
    if state == "undecided":
        message = say("performers.undecided", "cannot be told apart from another performer now")
    elif state == "away":
        message = say("performers.away", "no camera sees them")
    height = None if one.height_m is None else round(one.height_m, 4)
    return PerformerStatus(number, name, state, height, has_profile(stage.folder, name), message)


def _stranger(problems: list[str], *, full: bool, everybody: bool) -> PerformerStatus:
    if full:
        message = say("performers.full", "left out: {n} performers are followed at most", n=MOST_PERFORMERS)
        return PerformerStatus(None, "", "stranger", message=message)
    if everybody:
        seen = say(
            "performers.seen_soon", "not a performer yet: measured once a camera has shown them for 3 s"
        )
        return PerformerStatus(None, "", "measuring", message=seen)
    if not problems:
        message = say("performers.measuring", "not a performer yet: keep the T-pose")
        return PerformerStatus(None, "", "measuring", message=message)
    why = "; ".join(problems)
    message = say("performers.hold_t_pose", "not a performer yet: hold a T-pose ({why})", why=why)
    return PerformerStatus(None, "", "stranger", message=message)


def _warnings(stage: PerformedStage, everybody: list[OnStage], now_ns: int) -> list[str]:
    used = () if stage.stage_calibration is None else tuple(stage.stage_calibration.cameras)
    here = [one for one in everybody if one.here]
    out: list[str] = []
    if len(here) > MOST_PERFORMERS:
        out.append(
            say(
                "performers.many",
                "{count} people are on the stage; {most} are performers at most, and the others are left out",
                count=len(here),
                most=MOST_PERFORMERS,
            )
        )
    doubtful = [stage.cast.name(one.performer) for one in here if one.undecided and one.performer is not None]
    if doubtful:
        out.append(
            say(
                "performers.doubt",
                "{names}: not told apart now; exchange them if they go on as each other",
                names=doubtful,
            )
        )
    for one in here:
        if one.performer is not None:
            missed = [name for name in stage.sightings.unseen_by(one.performer, now_ns) if name in used]
            if missed:
                name = stage.cast.name(one.performer)
                out.append(
                    say("performers.unseen", "{name} is not seen by {cameras}", name=name, cameras=missed)
                )
    ghosts = [name for name in stage.sightings.ghosts(now_ns) if name in used]
    if ghosts:
        out.append(
            say(
                "performers.ghost",
                "{cameras}: a body that is nobody's is shown and left out, as where a device sees one person twice",
                cameras=ghosts,
            )
        )
    return out
