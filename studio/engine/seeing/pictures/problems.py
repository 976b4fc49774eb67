"""Messages about problems that keep a camera's pictures from being read well."""

from studio.engine.base.sentences import Said, say

NOBODY = say("camera.nobody", "it sees no performer")


def several(people: int) -> Said:
    """Return the message that more than one person is in the picture."""
    return say(
        "camera.several",
        "{n} people are in the picture: the one nearest to its middle is followed, the others should leave it",
        n=people,
    )


def too_many_pictures(read: float, given: float) -> Said:
    """Return the message that pictures are skipped.

    Args:
        read, given: pictures per second.
    """
    return say(
        "camera.skips",
        "this machine reads {read:.0f} of {given:.0f} pictures a second and skips the others: choose the model lite, "
        "fewer cameras on this machine, or a camera with fewer or smaller pictures",
        read=read,
        given=given,
    )
