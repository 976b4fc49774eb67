"""A take that was recorded with a wrong calibration takes another take's."""

from dataclasses import replace

from studio.engine.calibration.result import Calibration
from studio.engine.errors import CalibrationError
from studio.take.take import Take


def borrow_calibration(take: Take, other: Take) -> int:
    """Put another take's camera places and performer in use, under the next number, which comes back.

    The clocks stay the take's own, as every recording has clocks of its own; without any they come along too.

    Raises:
        CalibrationError: the other take has none in use, lacks one of the take's cameras, or had another device under
            its name.
    """
    borrowed = other.calibration()
    missing = sorted(set(take.camera_names) - set(borrowed.cameras))
    if missing:
        raise CalibrationError(
            f"the calibration of {other.path} has no {', '.join(missing)}; it has: {', '.join(borrowed.cameras)}. "
            "Borrow from a take with the same cameras"
        )
    serials = {camera["name"]: camera.get("serial", "") for camera in other.meta["cameras"]}
    for camera in take.meta["cameras"]:
        mine, its = camera.get("serial", ""), serials.get(camera["name"], "")
        if mine and its and mine != its:
            raise CalibrationError(
                f"{camera['name']} is another device in {other.path} (serial {its}, here {mine}); "
                "borrow from a take with the same cameras"
            )
    own = take.calibration().cameras if take.meta["calibration"] is not None else {}
    cameras = {
        name: replace(camera, clock=own[name].clock if name in own else camera.clock)
        for name, camera in borrowed.cameras.items()
        if name in take.camera_names
    }
    reference = borrowed.reference if borrowed.reference in cameras else next(iter(cameras))
    return take.add_calibration(Calibration(reference, cameras, borrowed.performer), use=True)
