"""docs/protocol.md names every message and field, and its example is right."""

import re
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


def test_the_example_is_right():
    written = re.findall(r"\b[0-9a-f]{2}\b", TEXT.split("## Example")[1].split("hexadecimal:")[1])
    assert bytes.fromhex("".join(written)) == wire.encode(wire.ClockRequest(5))
