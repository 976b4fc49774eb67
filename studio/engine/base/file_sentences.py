"""Errors for files that cannot be read or written, the same in all rooms."""

from pathlib import Path

from studio.engine.base.sentences import Said, say, system_says


def unreadable(path: Path, error: OSError) -> Said:
    """Return the error for a file that the system does not let be read, with the reason."""
    return say("file.unreadable", "cannot read {path}: {error}", path=path, error=system_says(error))


def unreadable_give_other(path: Path, error: OSError) -> Said:
    """Return the same for a file from the user, who can give another one."""
    return say(
        "file.unreadable_give_other",
        "cannot read {path}: {error}; give another file",
        path=path,
        error=system_says(error),
    )


def damaged(path: Path, error: object) -> Said:
    """Return the error for a damaged file that the studio makes itself, with the advice to delete it."""
    return say("timecode.damaged", "{path} is damaged: {error}; delete it", path=path, error=error)


def too_large(path: Path, most: int) -> Said:
    """Return the error for a file of more than `most` bytes, the most that can be read."""
    return say(
        "file.too_large",
        "{path} has {n} bytes; at most {most} can be read",
        path=path,
        n=path.stat().st_size,
        most=most,
    )


def unwritable(path: Path, error: OSError) -> Said:
    """Return the error for a file that the system does not let be written, with the usual remedy."""
    return say(
        "file.unwritable_free_space",
        "cannot write {path}: {error}; free some space",
        path=path,
        error=system_says(error),
    )
