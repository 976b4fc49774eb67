"""The index at the end of a `raw.mcap`, without its frames."""

from pathlib import Path

from mcap.reader import make_reader
from mcap.summary import Summary

from studio.take.raw.reader import DAMAGE


def topics_of(summary: Summary) -> set[str]:
    """Return the topics of a file that have messages."""
    found = summary.statistics
    return {
        channel.topic
        for channel in summary.channels.values()
        if found is None or found.channel_message_counts.get(channel.id)
    }


def indexed_topics(path: Path) -> set[str] | None:
    """Return the topics of a `raw.mcap` that have messages; None if it is missing, unfinished or damaged."""
    try:
        with open(path, "rb") as file:
            summary = make_reader(file).get_summary()
    except DAMAGE:
        return None
    return None if summary is None else topics_of(summary)
