"""The tree of user errors. Each message says what was given, what is allowed and what to do.

StudioError
├── SettingsError      an unknown switch or value
├── FormatError        a file or packet that cannot be read
├── CalibrationError   a calibration that is missing or was refused
├── TakeError          a take that is missing, incomplete or already there
└── NotAvailableError  a feature that this version lacks
"""


class StudioError(Exception):
    """An error shown to the user in one line instead of a traceback."""


class SettingsError(StudioError):
    """An unknown switch, or a value that a switch does not allow."""


class FormatError(StudioError):
    """A file or packet that is damaged, truncated or of another kind."""


class CalibrationError(StudioError):
    """A calibration that is missing, or that was refused with reasons."""


class TakeError(StudioError):
    """A take that does not exist, lacks something, or would be overwritten."""


class NotAvailableError(StudioError):
    """A documented feature that this version lacks."""
