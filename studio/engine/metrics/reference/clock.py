"""Conversion of a reference to joint centres on a known clock."""

from studio.engine.metrics.reference.alignment import clock_of
from studio.engine.metrics.reference.markers import fit_joint_centres
from studio.engine.metrics.reference.reference import Markers, Reference
from studio.engine.model.poses import Poses


def on_one_clock(
    poses: Poses, reference: Reference | Markers, start_s: float | None, same_clock: bool
) -> tuple[Reference, dict[str, float] | None, tuple[float, float]]:
    """Return joint centres, the fitted offsets, and the reference's clock (offset [s], drift).

    Markers' offsets and clock depend on one another; the bare markers give a first clock.
    """
    if isinstance(reference, Reference):
        clock = (0.0, 0.0) if same_clock else clock_of(poses, reference, start_s=start_s)
        return reference, None, clock
    clock = (0.0, 0.0)
    if not same_clock:
        clock = clock_of(poses, reference.as_reference(), start_s=start_s)
        for _ in range(2):
            centres, _ = fit_joint_centres(
                poses, reference, start_s=start_s, offset_s=clock[0], drift_ppm=clock[1]
            )
            clock = clock_of(poses, centres, start_s=start_s)
    centres, offsets_mm = fit_joint_centres(
        poses, reference, start_s=start_s, offset_s=clock[0], drift_ppm=clock[1]
    )
    return centres, offsets_mm, clock
