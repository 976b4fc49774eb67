"""The replay page: its content, its size, and that it requests nothing."""

import base64
import gzip
import json
import re

import numpy as np
import pygltflib
import pytest

from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import OUTPUT_JOINTS
from studio.review.share.bake import KEYS_HZ, replay_glb
from studio.review.share.bundle import STATIC, bundle, packed
from studio.review.share.page import policy, replay_page
from tests.poses_factory import random_poses


def unpacked(page: str, block: str) -> str:
    return re.search(rf'<script type="[^"]+" id="{block}">(.*?)</script>', page, re.DOTALL)[1]


def test_the_file_holds_modules_motion_and_an_escaped_title() -> None:
    poses = random_poses(np.random.default_rng(1), seconds=2.0)
    page = replay_page(poses, title="</script><b>&'").decode()
    assert "<b>" not in page and "&lt;/script&gt;&lt;b&gt;" in page
    motion = gzip.decompress(base64.b64decode(unpacked(page, "motion")))
    assert motion[:4] == b"glTF"
    modules = [name for name, _ in json.loads(unpacked(page, "modules"))]
    assert modules[0] == "vendor/three/three.core.js" and modules[-1] == "vote/share_page.js"
    assert not re.search(r'(src|href)="', page) and len(page) < 1_000_000


def test_the_policy_allows_the_script_that_is_in_the_file() -> None:
    page = replay_page(random_poses(np.random.default_rng(1), seconds=0.5), title="x").decode()
    script = re.search(r"<script>(.*?)</script>", page, re.DOTALL)[1]
    assert policy(script).replace("'", "&#39;") in page
    assert "connect-src" not in page and "default-src &#39;none&#39;" in page


def test_modules_come_after_what_they_import() -> None:
    seen: set[str] = set()
    for name, text in bundle(STATIC / "vote" / "share_page.js"):
        wanted = set(re.findall(r'"module:([^"]+)"', text))
        assert wanted <= seen, name
        seen.add(name)
    assert "vendor/three/addons/loaders/GLTFLoader.js" in seen
    core = dict(bundle(STATIC / "vote" / "share_page.js"))["vendor/three/three.core.js"]
    assert "@license" in core and "SPDX-License-Identifier: MIT" in core


def test_packing_is_alike_every_time() -> None:
    assert packed("motion") == packed(b"motion")


def test_the_motion_has_thirty_keys_a_second_within_a_hundredth_of_a_degree() -> None:
    poses = random_poses(np.random.default_rng(2), seconds=2.0)
    document = pygltflib.GLTF2.load_from_bytes(replay_glb(poses))
    animation = document.animations[0]
    times = document.accessors[animation.samplers[0].input]
    assert times.count == 2 * KEYS_HZ + 1 and times.max == pytest.approx([2.0])
    rotations = [channel for channel in animation.channels if channel.target.path == "rotation"]
    assert len(rotations) == len(OUTPUT_JOINTS)
    accessor = document.accessors[animation.samplers[rotations[0].sampler].output]
    assert accessor.componentType == pygltflib.SHORT and accessor.normalized
    start = document.bufferViews[accessor.bufferView].byteOffset
    xyzw = np.frombuffer(document.binary_blob(), np.int16, 4 * accessor.count, start).reshape(-1, 4) / 32767
    assert np.allclose(np.abs(xyzw[:, 3]), np.abs(poses.rotations_wxyz[::2, 0, 0]), atol=1e-4)


def test_a_part_of_it() -> None:
    poses = random_poses(np.random.default_rng(3), seconds=2.0)
    document = pygltflib.GLTF2.load_from_bytes(replay_glb(poses, start_s=0.5, end_s=1.5))
    assert document.accessors[document.animations[0].samplers[0].input].max == pytest.approx([1.0])
    with pytest.raises(SettingsError):
        replay_glb(poses, start_s=5.0)
