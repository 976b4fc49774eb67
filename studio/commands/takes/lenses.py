"""Lenses that are given to `studio calibrate`."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_value, unknown
from studio.engine.calibration.views.seen.known_lens import KnownLens, known_field, known_focal
from studio.engine.model.calibration import LONGEST_READOUT_MS
from studio.take.folder.lens_files import lens_for, read_lenses


def given_lenses(args: argparse.Namespace, cameras: Sequence[str]) -> dict[str, KnownLens]:
    """Return the lenses of `--lens`, `--focal-px` and `--fov-deg` by camera; named cameras take precedence.

    Raises:
        FormatError: a file without a lens. SettingsError: a text that is no number.
    """
    found: dict[str, KnownLens] = {}
    texts = [
        (kind, *_parts(text)) for kind in ("fov_deg", "focal_px", "lens") for text in getattr(args, kind)
    ]
    for kind, camera, text in sorted(texts, key=lambda one: bool(one[1])):
        if kind == "lens":
            found |= _of_file(camera, text, cameras)
            continue
        known = _focal(kind, text)
        found |= dict.fromkeys([camera] if camera else cameras, known)
    return found


def given_readouts(texts: Sequence[str], cameras: Sequence[str]) -> dict[str, float]:
    """Return the times of `--readout-ms` by camera [ms]; named cameras take precedence.

    Raises:
        SettingsError: an unknown camera, or a text that is no such time.
    """
    found: dict[str, float] = {}
    for camera, text in sorted((_parts(text) for text in texts), key=lambda one: bool(one[0])):
        if camera and camera not in cameras:
            raise SettingsError(unknown("camera", camera, cameras))
        try:
            readout_ms = float(text)
        except ValueError:
            readout_ms = -1.0
        if not 0.0 <= readout_ms <= LONGEST_READOUT_MS:
            allowed = f"0 to {LONGEST_READOUT_MS:g}, in milliseconds"
            raise SettingsError(bad_value("--readout-ms", text, allowed))
        found |= dict.fromkeys([camera] if camera else cameras, readout_ms)
    return found


def _parts(text: str) -> tuple[str, str]:
    camera, equals, rest = text.partition("=")
    return (camera, rest) if equals else ("", text)


def _of_file(camera: str, file: str, cameras: Sequence[str]) -> dict[str, KnownLens]:
    if camera:
        return {camera: KnownLens(lens_for(camera, file))}
    lenses = read_lenses(file)
    if set(lenses) == {""}:
        return {name: KnownLens(lenses[""]) for name in cameras}
    mine = {name: KnownLens(lens) for name, lens in lenses.items() if name in cameras}
    if not mine:
        raise SettingsError(
            bad_value("--lens", Path(file).name, f"a file with a lens of {', '.join(cameras)}")
        )
    return mine


def _focal(kind: str, text: str) -> KnownLens:
    value, _, deviation = text.partition("+-")
    try:
        number, off = float(value), float(deviation or 0.0)
    except ValueError as error:
        option = "--" + kind.replace("_", "-")
        raise SettingsError(bad_value(option, text, "a number, such as 65, or 65+-2")) from error
    return known_focal(number, off) if kind == "focal_px" else known_field(number, off)
