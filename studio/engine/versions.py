"""The version that every file of the program carries, and how the content of an older one is brought up to date.

A file says its version in `format_version` (JSON, npz). Keys that are added with a default leave it as it is; it is
raised where an older program would misread the file, together with a migration from the version before. Files from
before they had a version count as version 0. What each version holds is in docs/formats.md.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from studio.engine.errors import FormatError

KEY = "format_version"
Migration = Callable[[dict[str, Any]], dict[str, Any]]


@dataclass(frozen=True)
class FileFormat:
    """A kind of file.

    Attributes:
        name: as a person knows it.
        version: of the files that are written.
        migrations: by version, how content of it becomes content of the next; a version without one is the next
            already.
        oldest: the first version that is read.
    """

    name: str
    version: int
    migrations: Mapping[int, Migration] = field(default_factory=dict)
    oldest: int = 0

    def stamped(self, value: Mapping[str, Any]) -> dict[str, Any]:
        """Return the content of a file with the version that is written."""
        return {KEY: self.version, **{key: item for key, item in value.items() if key != KEY}}

    def current(self, value: Mapping[str, Any], where: object) -> dict[str, Any]:
        """Return the content of a file of any version as the newest has it, without the version.

        Args:
            where: the file, for the message.

        Raises:
            FormatError: a version that is no number, is too old, or newer than this program's.
        """
        found = value.get(KEY, 0)
        if isinstance(found, bool) or not isinstance(found, int) or not self.oldest <= found <= self.version:
            raise FormatError(
                f"{where} has format version {found!r}; this program reads {self.name} of version "
                f"{self.oldest} to {self.version}: use the program that wrote it, or a newer one"
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
TRACKED = FileFormat("tracked skeletons", 1)
CALIBRATION = FileFormat("calibrations", 1)
RIG_MAPPING = FileFormat("mappings of rigs", 1)
PERFORMER = FileFormat("profiles of performers", 1)
OUTPUTS = FileFormat("live outputs", 1)
ACCESS = FileFormat("tokens", 1)
SAVED_PRESETS = FileFormat("saved presets", 1)
PLACED = FileFormat("references beside solves", 1)
