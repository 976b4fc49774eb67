"""The bodies that a mannequin can have."""

from studio.engine.base.errors import SettingsError

BODIES: tuple[str, ...] = ("standard", "slim", "blocks")
"""Bodies to choose from, the usual one first; all have the joints' proportions."""


def check_body(body: str) -> str:
    """Return the name of a body.

    Raises:
        SettingsError: there is none of this name.
    """
    if body not in BODIES:
        raise SettingsError(
            "mannequin.body", "body={body} is not allowed; allowed: {allowed}", body=body, allowed=[*BODIES]
        )
    return body
