"""Stored receivers of live output."""

import json
from pathlib import Path

from studio.streams.targets import FILE, load_targets


def test_joint_targets_with_a_rate_of_earlier_versions_are_read(tmp_path: Path) -> None:
    of = {"id": "arm", "kind": "robot", "robot": "g1", "port": 14600}
    stored = [{**of, "id": str(hz), "rate_hz": hz} for hz in (30.0, 60.0, 120.0)]
    (tmp_path / FILE).write_text(json.dumps({"format_version": 1, "targets": stored}))
    assert [target.rate_hz for target in load_targets(tmp_path)] == [50.0, 60.0, 100.0]
