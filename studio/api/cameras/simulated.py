"""The simulated stage: which camera clients it has."""

import time

SIMULATED = "simulated"

DEMO_CAMERAS: dict[str, tuple[str, int]] = {"skeletons": ("simulated", 2), "rgb": ("simulated-rgb", 3)}
"""The simulated stage's kinds of cameras, each with its source and number: they send skeletons, as depth cameras do,
or landmarks in pictures, as webcams and phones do.
"""


def simulated_sources(cameras: str = "skeletons", performers: int = 1) -> dict[str, str]:
    """Return the simulated stage's sources, arguments of `studio camera --source`, by the camera's name.

    Args:
        cameras: a kind of `DEMO_CAMERAS`.
        performers: their number on the stage; for several there is one more camera, of skeletons.
    """
    source, count = DEMO_CAMERAS[cameras]
    several = ""
    if performers > 1:
        count, several = count + 1, f":0:{performers}:{round(time.time())}"
    return {f"camera_{i}": f"{source}:{i}/{count}{several}" for i in range(count)}
