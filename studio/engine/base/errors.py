"""The tree of user errors. Each message gives the given value, the allowed ones and the remedy.

StudioError
├── SettingsError      an unknown switch or value
├── FormatError        a file or packet that cannot be read
├── CalibrationError   a calibration that is missing or was refused
├── TakeError          a take that is missing, incomplete or already there
└── NotAvailableError  a feature that this version lacks
"""

from studio.engine.base.sentences import Said, Value, say


class StudioError(Exception):
    """An error shown to the user in one line instead of a traceback.

    It is raised with a sentence, or with the arguments of `say`: a code, English and the values in it.
    """

    def __init__(self, sentence: str = "", english: str = "", /, **values: object) -> None:
        super().__init__(say(sentence, english, **values) if english else sentence)

    @property
    def sentence(self) -> str:
        """Its text: a `Said`, unless another program raised it with a bare text."""
        return self.args[0] if self.args and isinstance(self.args[0], Said) else str(self)

    @property
    def code(self) -> str:
        """Code of its sentence, such as `take.in_use`; the name of its class if it was raised with a bare text."""
        return getattr(self.sentence, "code", type(self).__name__)

    @property
    def values(self) -> dict[str, Value]:
        """The values in the sentence, by name."""
        return getattr(self.sentence, "values", {})


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
