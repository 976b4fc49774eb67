"""Rigs over the API: uploaded, mapped, used for exports."""

from studio.engine.animation.read.gltf_file import GltfFile
from tests.api.test_routes import assert_error
from tests.engine.animation.retarget.rigs import write_rig
from tests.poses_factory import t_pose


def test_a_rig_is_sent_mapped_and_exported_onto(recorded, tmp_path):
    assert recorded.http.get("/rigs").json() == []
    rig = write_rig(tmp_path / "hero.glb", t_pose(2), "vrm", "child", True).read_bytes()
    answer = recorded.http.put("/rigs/hero.glb", content=rig)
    assert answer.status_code == 201, answer.text
    facts = answer.json()
    assert facts["problem"] is None and facts["bones"]["LeftUpLeg"] == "leftUpperLeg"
    assert recorded.http.get("/rigs").json() == ["hero.glb"]
    bones = {**facts["bones"], "Head": None}
    facts = recorded.http.put("/rigs/hero.glb/mapping", json={"bones": bones}).json()
    assert "head" in facts["unmapped"] and recorded.http.get("/rigs/hero.glb/mapping").json() == facts
    request = {"format": "glb", "rig": "hero.glb"}
    answer = recorded.http.get("/takes/tests/one/solves/live/export", params=request)
    assert answer.status_code == 200, answer.text
    assert 'filename="one_live_hero.glb"' in answer.headers["content-disposition"]
    out = tmp_path / "out.glb"
    out.write_bytes(answer.content)
    assert {node["name"] for node in GltfFile(out).tree["nodes"]} >= {"hips", "leftUpperLeg"}


def test_what_does_not_go(studio, tmp_path):
    rig = write_rig(tmp_path / "hero.glb", t_pose(2)).read_bytes()
    assert_error(studio.http.put("/rigs/hero.obj", content=rig), 422, "format", "rig.name")
    assert_error(studio.http.put("/rigs/hero.glb", content=rig[:300]), 422, "format", "gltf.cut_off")
    assert_error(studio.http.get("/rigs/hero.glb/mapping"), 404, "not_found")
    assert studio.http.put("/rigs/hero.glb", content=rig).status_code == 201
    wrong = studio.http.put("/rigs/hero.glb/mapping", json={"bones": {"Hips": "tail"}})
    assert_error(wrong, 422, "format", "rig.no_such_bone")
    assert studio.http.get("/rigs/hero.glb/mapping").json()["mapping"] == "by name"
