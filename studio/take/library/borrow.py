"""Use of another calibration: an earlier one of the take, or that of another take with the same cameras."""

from dataclasses import replace

from studio.engine.base.errors import CalibrationError
from studio.engine.model.calibration import Calibration
from studio.take.folder.take import Take, read_calibration


def use_calibration(take: Take, number: int) -> None:
    """Put a stored calibration of a take in use.

    Raises:
        CalibrationError: there is none with this number, it cannot be read, or it was refused.
    """
    if number not in take.calibration_numbers():
        raise CalibrationError(
            "take.no_such_calibration",
            "take {take} has no calibration {number}; it has: {numbers}",
            take=take.path,
            number=number,
            numbers=[str(one) for one in take.calibration_numbers()] or ["none"],
        )
    found = read_calibration(take.calibration_path(number))
    if found.refused:
        raise CalibrationError(
            "take.calibration_was_refused",
            "calibration {number} of {take} was refused: {reasons}. Use another, or calibrate anew",
            number=number,
            take=take.path,
            reasons=found.reasons(),
        )
    take.meta["calibration"] = number
    take.save_meta()


def borrow_calibration(take: Take, other: Take) -> int:
    """Use another take's camera poses and performer, under the next number, which is returned.

    The clocks stay the take's own, because every recording has its own clocks; a take without any gets the other's.

    Raises:
        CalibrationError: the other take has none in use, lacks one of the take's cameras, or had another device under
            its name.
    """
    borrowed = other.calibration()
    missing = sorted(set(take.camera_names) - set(borrowed.cameras))
    if missing:
        raise CalibrationError(
            "calibration.borrow_lacks",
            "the calibration of {take} has no {names}; it has: {others}. Borrow from a take with "
            "the same cameras",
            take=other.path,
            names=[*missing],
            others=[*borrowed.cameras],
        )
    serials = {camera["name"]: camera.get("serial", "") for camera in other.meta["cameras"]}
    for camera in take.meta["cameras"]:
        mine, its = camera.get("serial", ""), serials.get(camera["name"], "")
        if mine and its and mine != its:
            raise CalibrationError(
                "take.other_device",
                "{name} is another device in {take} (serial {its}, here {mine}); borrow from a take "
                "with the same cameras",
                name=camera["name"],
                take=other.path,
                its=its,
                mine=mine,
            )
    own = take.calibration().cameras if take.meta["calibration"] is not None else {}
    cameras = {
        name: replace(camera, clock=own[name].clock if name in own else camera.clock, disagrees=())
        for name, camera in borrowed.cameras.items()
        if name in take.camera_names
    }
    reference = borrowed.reference if borrowed.reference in cameras else next(iter(cameras))
    return take.add_calibration(Calibration(reference, cameras, borrowed.performer), use=True)
