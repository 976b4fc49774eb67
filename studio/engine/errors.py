"""The tree of errors that a user can cause or meet; each message says what was given, what is allowed, what to do.

StudioError
├── SettingsError      an unknown switch or value
├── FormatError        a file or packet that cannot be read
├── CalibrationError   a calibration that is missing or was refused
├── TakeError          a take that is missing, incomplete or already there
└── NotAvailableError  something that this version does not do yet
"""


class StudioError(Exception):
    """Anything that is told to the user in one line instead of a traceback."""


class SettingsError(StudioError):
    """An unknown switch, or a value that a switch does not allow."""


class FormatError(StudioError):
    """A file or packet that is broken, cut off or of another kind."""


class CalibrationError(StudioError):
    """A calibration that is missing, or that was refused with reasons."""


class TakeError(StudioError):
    """A take that does not exist, lacks something, or would be overwritten."""


class NotAvailableError(StudioError):
    """Something that is named in the documentation but not available in this version."""
