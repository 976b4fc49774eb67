"""What is said of files that cannot be read or written, alike in all rooms."""

from pathlib import Path

from studio.engine.base.sentences import Said, say, system_says


def unreadable(path: Path, error: OSError) -> Said:
    """Return that the system does not let a file be read, and why."""
    return say("file.unreadable", "cannot read {path}: {error}", path=path, error=system_says(error))


def unreadable_give_other(path: Path, error: OSError) -> Said:
    """Return the same of a file that the user gave, who can give another."""
    return say(
        "file.unreadable_give_other",
        "cannot read {path}: {error}; give another file",
        path=path,
        error=system_says(error),
    )


def damaged(path: Path, error: object) -> Said:
    """Return that a file that the studio makes itself is damaged, and to delete it."""
    return say("timecode.damaged", "{path} is damaged: {error}; delete it", path=path, error=error)


def too_large(path: Path, most: int) -> Said:
    """Return that a file has more than `most` bytes, which are all that can be read."""
    return say(
        "file.too_large",
        "{path} has {n} bytes; at most {most} can be read",
        path=path,
        n=path.stat().st_size,
        most=most,
    )


def unwritable(path: Path, error: OSError) -> Said:
    """Return that the system does not let a file be written, and what helps mostly."""
    return say(
        "file.unwritable_free_space",
        "cannot write {path}: {error}; free some space",
        path=path,
        error=system_says(error),
    )
