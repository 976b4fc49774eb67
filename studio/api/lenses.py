"""Lenses of cameras without depth in requests."""

from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict, Field

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_value
from studio.engine.calibration.views.seen.known_lens import KnownLens, known_field, known_focal
from studio.take.folder.lens_files import lens_among, lenses_in

_MOST_LETTERS = 1 << 20
LENSES = Field(
    default_factory=dict, description="by camera without depth, what is known of its lens; others are unknown"
)
SAME_LENS = Field(default=False, description="cameras whose lens is not given have one focal length")


class LensRequest(BaseModel):
    """One of field of view, focal length and file."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    field_deg: float | None = Field(None, description="field of view along the picture's longer side")
    focal_px: float | None = Field(None, description="focal length, in pixels of the camera's pictures")
    off: float = Field(0.0, ge=0.0, description="deviation of either, in its unit; 0: it is exactly so")
    file: str | None = Field(None, max_length=200, description="name of a lens file", examples=["Calib.toml"])
    text: str = Field("", max_length=_MOST_LETTERS, description="what the lens file holds")


def known_lenses(given: Mapping[str, LensRequest]) -> dict[str, KnownLens]:
    """Return what is known of each camera's lens, by camera.

    Raises:
        FormatError: a file without a lens of the camera. SettingsError: a number that no lens has, or not
            exactly one of the three.
    """
    return {camera: _known(camera, one) for camera, one in given.items()}


def _known(camera: str, one: LensRequest) -> KnownLens:
    values = [one.field_deg, one.focal_px, one.file]
    if sum(value is not None for value in values) != 1:
        raise SettingsError(bad_value(f"lens of {camera}", values, "one of field_deg, focal_px and file"))
    if one.file is not None:
        return KnownLens(lens_among(camera, one.file, lenses_in(one.file, one.text)))
    if one.focal_px is not None:
        return known_focal(one.focal_px, one.off)
    assert one.field_deg is not None
    return known_field(one.field_deg, one.off)
