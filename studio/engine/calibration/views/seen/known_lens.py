"""A camera's lens as known before calibration."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import radians, sin

import numpy as np

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_value
from studio.engine.model.cameras.lens import Lens, usual_lens

_FIELDS_DEG = (5.0, 170.0)
_LARGEST_SHARE = 0.5


@dataclass(frozen=True)
class KnownLens:
    """A camera's lens, or its focal length alone; one of the first three attributes is given.

    Attributes:
        lens: the whole lens, for pictures of its size or of the same shape.
        focal_px: focal length [pixel] in the camera's pictures.
        field_deg: field of view along the longer side of the picture [degrees].
        share: relative deviation of the focal length; 0 = exact.

    Raises:
        SettingsError: a number that no lens has.
    """

    lens: Lens | None = None
    focal_px: float | None = None
    field_deg: float | None = None
    share: float = 0.0

    def __post_init__(self) -> None:
        if self.focal_px is not None and not 1.0 <= self.focal_px <= 1e6:
            raise SettingsError(bad_value("focal length", self.focal_px, "1 to 1000000, in pixels"))
        if self.field_deg is not None and not _FIELDS_DEG[0] <= self.field_deg <= _FIELDS_DEG[1]:
            allowed = f"{_FIELDS_DEG[0]:g} to {_FIELDS_DEG[1]:g} degrees along the longer side"
            raise SettingsError(bad_value("field of view", self.field_deg, allowed))
        if not 0.0 <= self.share <= _LARGEST_SHARE:
            allowed = f"0 to {_LARGEST_SHARE:g}, as a share of the focal length"
            raise SettingsError(bad_value("deviation of the focal length", self.share, allowed))

    def of(self, camera: str, width: int, height: int) -> Lens:
        """Return the lens for a camera's pictures [pixels].

        Raises:
            SettingsError: a lens for pictures of another shape.
        """
        if self.lens is not None:
            sized = self.lens.sized(width, height)
            if sized is None:
                raise SettingsError(
                    "views.lens_shape",
                    "the lens of {name} is for pictures of {lens_width} x {lens_height}, and its pictures are "
                    "{width} x {height}: give one for that shape",
                    name=camera,
                    lens_width=self.lens.width,
                    lens_height=self.lens.height,
                    width=width,
                    height=height,
                )
            return sized
        focal = self.focal_px
        if focal is None:
            assert self.field_deg is not None
            focal = 0.5 * max(width, height) / float(np.tan(np.radians(0.5 * self.field_deg)))
        usual = usual_lens(width, height)
        return Lens(focal, focal, usual.cx, usual.cy, width, height)


@dataclass(frozen=True)
class KnownLenses:
    """Known lenses of a stage, by camera, and whether the other cameras have one focal length."""

    lenses: Mapping[str, KnownLens] = field(default_factory=dict)
    same: bool = False


def known_focal(focal_px: float, off_px: float = 0.0) -> KnownLens:
    """Return a lens of this focal length and its deviation [pixel].

    Raises:
        SettingsError: a number that no lens has.
    """
    return replace(KnownLens(focal_px=focal_px), share=abs(off_px / focal_px))


def known_field(field_deg: float, off_deg: float = 0.0) -> KnownLens:
    """Return a lens of this field of view along the picture's longer side, and its deviation [degrees].

    Raises:
        SettingsError: a number that no lens has.
    """
    # f = w / 2 / tan(a / 2), so df / f = da / sin(a)
    return replace(KnownLens(field_deg=field_deg), share=abs(radians(off_deg) / sin(radians(field_deg))))


def check_lenses(given: Iterable[str], without_depth: Collection[str]) -> None:
    """Check that lenses are given only for cameras without depth.

    Raises:
        SettingsError: a name is not that of a camera without depth.
    """
    strange = [name for name in given if name not in without_depth]
    if strange:
        raise SettingsError(
            "calibration.lens_of_none",
            "a lens for {name}: no such camera without depth; allowed: {names}",
            name=strange[0],
            names=[*without_depth] or ["none"],
        )
