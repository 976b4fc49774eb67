"""docs/protocol.md names every message and field, and its example is right."""

import re
import struct
from pathlib import Path
from typing import get_args

import msgspec

from studio import wire

TEXT = (Path(__file__).parents[2] / "docs" / "protocol.md").read_text(encoding="utf-8")


def test_every_message_and_field_is_described():
    for kind in get_args(wire.Message):
        tag = kind.__struct_config__.tag
        section = TEXT.split(f"\n### {tag}\n", 1)
        assert len(section) == 2, f"docs/protocol.md lacks the message {tag}"
        table = section[1].split("\n#", 1)[0]
        described = re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)
        assert described == ["type", *(field.name for field in msgspec.structs.fields(kind))]


SKELETON = wire.SkeletonFrame(104, 5, struct.pack("<3f", -1.0, 0.5, 3.0), struct.pack("<f", 1.0))
EXAMPLES = [
    wire.ClockRequest(5),
    wire.Recording(True, "day/take_001", "0a1b", 7),
    wire.Kept("0a1b", "b1", 100, 99),
    SKELETON,
    wire.Late("0a1b", "b1", wire.encode(SKELETON)),
    wire.Ack("0a1b", "b1", 131, [(104, 106)]),
]


def test_the_examples_are_right():
    section = TEXT.split("## Example")[1].split("\n## ")[0]
    blocks = re.findall(r"(?:^    (?:[0-9a-f]{2} ?)+$\n?)+", section, re.MULTILINE)
    assert [bytes.fromhex(block) for block in blocks] == [wire.encode(message) for message in EXAMPLES]
