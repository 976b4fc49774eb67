"""File format versions and migrations.

A file stores its version in `format_version` (JSON, npz). A new key with a default does not raise the version. A
change that an older program would misread raises it and adds a migration from the version before. Files without a
version count as version 0. docs/formats.md lists the content of each version.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from studio.engine.base.errors import FormatError

KEY = "format_version"
Migration = Callable[[dict[str, Any]], dict[str, Any]]


@dataclass(frozen=True)
class FileFormat:
    """A kind of file.

    Attributes:
        name: shown to the user.
        version: written to new files.
        migrations: by version, the function that turns content into that of the next version; none = no change.
        oldest: the first version that can be read.
    """

    name: str
    version: int
    migrations: Mapping[int, Migration] = field(default_factory=dict)
    oldest: int = 0

    def stamped(self, value: Mapping[str, Any]) -> dict[str, Any]:
        """Return the content of a file with the current version added."""
        return {KEY: self.version, **{key: item for key, item in value.items() if key != KEY}}

    def current(self, value: Mapping[str, Any], where: object) -> dict[str, Any]:
        """Return the content of a file of any version, migrated to the current one, without the version.

        Args:
            where: the file, for the message.

        Raises:
            FormatError: the version is no number, too old, or newer than this program's.
        """
        found = value.get(KEY, 0)
        if isinstance(found, bool) or not isinstance(found, int) or not self.oldest <= found <= self.version:
            raise FormatError(
                "file.version",
                "{path} has format version {version!r}; this program reads {kind} of version "
                "{oldest} to {newest}: use the program that wrote it, or a newer one",
                path=where,
                version=found,
                kind=self.name,
                oldest=self.oldest,
                newest=self.version,
            )
        content = {key: item for key, item in value.items() if key != KEY}
        for version in range(found, self.version):
            migrate = self.migrations.get(version)
            content = content if migrate is None else migrate(content)
        return content


SETTINGS = FileFormat("settings of a solve", 1)
METRICS = FileFormat("metrics of a solve", 1)
POSES = FileFormat("poses", 1)
TRACE = FileFormat("the trace of a solve", 1)
TRACKED = FileFormat("tracked skeletons", 2)
CALIBRATION = FileFormat("calibrations", 1)
RIG_MAPPING = FileFormat("mappings of rigs", 1)
ROBOT = FileFormat("tables of robots", 1)
ROBOT_MOTION = FileFormat("motions of robots", 1)
PERFORMER = FileFormat("profiles of performers", 1)
OUTPUTS = FileFormat("live outputs", 1)
ACCESS = FileFormat("tokens", 1)
SAVED_PRESETS = FileFormat("saved presets", 1)
PLACED = FileFormat("references beside solves", 1)
MEASURED_FIGURES = FileFormat("figures measured of a solve", 1)
KEPT_VIDEO = FileFormat("videos of takes", 1)
EDITS = FileFormat("edits of takes", 1)
TIMECODE = FileFormat("timecode of takes", 1)
CHOSEN_TIMECODE = FileFormat("chosen timecode", 1)
TRIGGERS = FileFormat("triggers", 1)
RIGID_BODIES = FileFormat("rigid bodies of other systems", 1)
BODY_TRACKS = FileFormat("rigid bodies of takes", 1)
MARKER_TRACKS = FileFormat("markers of takes", 1)
TAKE_BODIES = FileFormat("what rigid bodies of takes are", 1)
