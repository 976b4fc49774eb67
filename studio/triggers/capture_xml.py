"""`CaptureStart` and `CaptureStop`: XML in one UDP packet, as Vicon, OptiTrack, Rokoko and others send and accept it.

Source: Vicon, "UDP capture broadcast/trigger" (Tracker 3.10, Shogun 1.3): Name, Notes, Description, DatabasePath,
Delay [ms], PacketID, which identifies duplicates; a stop has RESULT; contents end with a zero byte. OptiTrack's form
has SessionName and TimeCode too. DatabasePath is not used: takes are in the studio's own folder. `Token` is the
studio's own.
"""

from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from studio.triggers.command import TriggerCommand

PORT = 1512
"""OptiTrack's port; Vicon's is 30, at which only privileged programs may listen."""

LONGEST = 8192
_GOOD = ("SUCCESS", "")
_ROOTS = {"CaptureStart": "start", "CaptureStop": "stop"}
_LONGEST_TEXT = 1000


def parse_capture(data: bytes) -> TriggerCommand | None:
    """Return the request in a packet; None if it is neither a start nor a stop."""
    if len(data) > LONGEST or b"<!" in data:  # declarations of entities are refused
        return None
    try:
        root = ElementTree.fromstring(data.rstrip(b"\0 \r\n\t").decode("utf-8"))
    except (ElementTree.ParseError, UnicodeDecodeError, ValueError, RecursionError):
        return None
    kind = _ROOTS.get(root.tag)
    if kind is None:
        return None
    said = {one.tag: one.get("VALUE", "")[:_LONGEST_TEXT].strip() for one in root}
    notes = "\n".join(text for text in (said.get("Notes", ""), said.get("Description", "")) if text)
    return TriggerCommand(
        kind="start" if kind == "start" else "stop",
        name=said.get("Name", ""),
        session=said.get("SessionName", ""),
        notes=notes,
        timecode=said.get("TimeCode", ""),
        packet=said.get("PacketID", "").lstrip("0"),  # senders that do not count send 0
        success=root.get("RESULT", "").upper() in _GOOD,
        token=said.get("Token", ""),
    )


def capture_packet(
    kind: str, *, name: str, session: str, timecode: str, packet: int, notes: str = "", token: str = ""
) -> bytes:
    """Return the packet of a start or a stop that the studio sends, with a zero byte at the end."""
    start = kind == "start"
    rows = [("Name", name)]
    if start:
        rows += [("SessionName", session), ("Notes", notes), ("Description", "")]
    rows += [("DatabasePath", ""), ("Delay", "0")]
    rows += [("TimeCode", timecode)] if timecode else []
    rows += [("PacketID", str(packet))]
    rows += [("Token", token)] if token else []
    tag = "CaptureStart" if start else "CaptureStop"
    inner = "".join(f"<{key} VALUE={quoteattr(value)}/>" for key, value in rows)
    opening = tag if start else f'{tag} RESULT="SUCCESS"'
    head = '<?xml version="1.0" encoding="UTF-8" standalone="no"?>'
    return f"{head}<{opening}>{inner}</{tag}>".encode() + b"\0"
