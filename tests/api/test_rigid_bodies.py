"""Rigid bodies through the server: they move as the performer does; recorded, measured, exported."""

import math
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from studio.__main__ import main
from studio.engine.metrics.reference.reference import Markers, read_reference
from studio.engine.model.frames import StepResult
from studio.engine.model.joints import INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.offline.replay import solve_take
from studio.take.folder.evaluating import evaluate_solves
from studio.take.folder.references import HowAligned
from studio.take.folder.take import Take
from studio.take.raw.frames import read_raw
from studio.take.raw.live_log import TickEvent
from studio.take.raw.records import RawEvent
from studio.take.rigid_bodies.kept import TRACKS_FILE, take_bodies, take_tracks
from studio.take.rigid_bodies.used import distances_mm, stage_bodies
from studio.web.playback.clip import Clip
from tests.api.camera import wait_until
from tests.api.test_recording import assert_equal_bits, cameras, nothing, record, studio  # noqa: F401
from tests.engine.animation.export.test_points import read_with_c3d
from tests.live.performer import joints_m
from tests.rigid_bodies.natnet_server import PERFORMER_NUMBER, Body, Marker, NatNetServer

PLACE = {"x_m": 0.5, "y_m": -0.3, "z_m": 0.0, "yaw_deg": 90.0}
GRIP_M = np.array([0.0, 0.03, 0.10])
"""From the wand's origin to the hand, in the wand's axes."""


MARKED = {
    "LKneeOut": "left_knee", "RKneeOut": "right_knee", "HeadTop": "head", "LWristOut": "left_wrist",
    "RWristOut": "right_wrist", "Back": "chest",
}  # fmt: skip
"""The markers of the performer, each 5 cm behind its joint."""


def motive_axes(place) -> tuple[float, float, float]:
    """A place on the stage [m] where Motive has it: its origin stands at PLACE, turned by 90 degrees, y is up."""
    x, y, z = place - np.array([PLACE["x_m"], PLACE["y_m"], PLACE["z_m"]])
    return y, z, x


def markers_at(time_s: float) -> list[Marker]:
    """The performer's visible markers, and one without a name."""
    joints = joints_m(time_s)
    found: list[Marker] = [
        (PERFORMER_NUMBER, number, motive_axes(joints[INDEX[joint]] + [0, 0.05, 0]), 2)
        for number, joint in enumerate(MARKED.values(), start=1)
    ]
    return [*found, (0, 77, motive_axes(np.array([1.0, 1.0, 0.0])), 18)]


def bodies_at(time_s: float) -> list[Body]:
    """The wand in the right hand, turned with the arm, and the cap on the head, in Motive's axes."""
    joints, angle = joints_m(time_s), -(0.6 + 0.6 * math.sin(math.pi * time_s))
    turn = np.array(
        [[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]]
    )
    half_a, half_yaw = angle / 2, -math.radians(PLACE["yaw_deg"]) / 2
    places = {"Wand": joints[INDEX["right_hand"]] - turn @ GRIP_M, "Cap": joints[INDEX["head"]] + [0, 0, 0.1]}
    turns = {"Wand": (math.cos(half_a), math.sin(half_a)), "Cap": (1.0, 0.0)}
    found: list[Body] = []
    for number, (name, place) in enumerate(places.items(), start=1):
        w, b = turns[name]
        c, s = math.cos(half_yaw), math.sin(half_yaw)
        qw, qx, qy, qz = c * w, -s * b, c * b, s * w  # z-up: about z, then about y
        found.append((number, name, motive_axes(place), (qx, qz, -qy, qw), True))
    return found


@pytest.fixture
def motive(studio, cameras):  # noqa: F811
    """A NatNet server that sends where the bodies are as the cameras' performer moves."""
    server = NatNetServer((4, 1), bodies_at(0.0), list(MARKED))
    ended = threading.Event()

    def run() -> None:
        number = 0
        while not ended.wait(0.004):
            number += 1
            time_s = cameras[0].sequence / 30.0
            server.send(number, bodies_at(time_s), markers_at(time_s))

    sender = threading.Thread(target=run, daemon=True)
    sender.start()
    yield server
    ended.set()
    sender.join()
    server.close()


def markers_are_a_reference(take: Take, step: StepResult, folder: Path, capsys) -> None:
    """The markers are shown in the replay, put on joints, written, and measured against."""
    assert step.markers is not None and len(step.markers.named_m) == len(MARKED)
    assert step.markers.named_m[2] == pytest.approx(
        [0.0, 0.05, 1.64], abs=1e-3
    )  # of the head, which stands still
    path, file = str(take.path), folder / "markers.csv"
    for name, joint in MARKED.items():
        assert main(["rigid", path, "set", f"Anna:{name}", f"joint={joint}"]) == 0
    assert main(["rigid", path, "set", "Anna:Back", "joint=head"]) == 2
    assert main(["rigid", path, "markers", str(file)]) == 0
    assert main(["rigid", path, "markers", str(folder / "markers.c3d"), "Anna"]) == 0
    assert main(["rigid", path, "markers", str(file), "Nobody"]) == 2
    reference = read_reference(file)
    assert isinstance(reference, Markers) and set(reference.joints) == set(MARKED.values())
    figures = evaluate_solves(take, reference, ["live"], HowAligned(False, "rigid", None))["live"]
    assert figures["mpjpe_mm"] < 40
    assert set(figures["alignment"]["marker_offsets_mm"] or {}) == set(MARKED.values())
    labels, places_mm, _, _ = read_with_c3d(folder / "markers.c3d")
    assert labels == [f"Anna:{joint}_marker" for joint in MARKED.values()]
    assert places_mm[0, 2] == pytest.approx([0.0, 50.0, 1640.0], abs=1.0)
    capsys.readouterr()


def seen_before(take: Take, name: str, ticks: list[TickEvent], later_s: float) -> np.ndarray:
    """Whether a body came within 0.1 s before each tick, however late the tick was made."""
    times_s = take_tracks(take).tracks[name].time_s + later_s
    at_s = np.array([one.stage_time_ns for one in ticks]) * 1e-9 - 0.01  # clocks are refined meanwhile
    last = np.searchsorted(times_s, at_s) - 1
    return (last >= 0) & (at_s - times_s[np.maximum(last, 0)] < 0.1)


def test_bodies_are_shown_recorded_measured_and_exported(studio, cameras, motive, tmp_path, capsys):  # noqa: F811
    assert studio.http.get("/rigid-bodies").json()["status"]["natnet"]["on"] is False
    wanted = {"name": "Wand", "joint": "right_hand", "shape": {"kind": "cylinder", "size_cm": [3, 60]}}
    changed = {"natnet": True, "natnet_port": motive.port, "place": PLACE, "bodies": [wanted]}
    answer = studio.http.patch("/rigid-bodies", json=changed)
    assert answer.status_code == 200, answer.text

    def seen() -> bool:
        bodies = studio.http.get("/status").json()["bodies"]
        return [one["name"] for one in bodies["bodies"] if one["seen"]] == ["Cap", "Wand"]

    wait_until(seen, "bodies are seen by their names")
    assert studio.http.get("/rigid-bodies").json()["status"]["markers"] == len(MARKED)
    take, _ = record(studio, cameras, *[nothing] * 4)
    live = studio.stage.results.get()[1]
    cap = next(one for one in live.bodies if one.name == "Cap")
    assert cap.position_m == pytest.approx([0.0, 0.0, 1.74], abs=0.02)
    assert live.markers is not None and live.markers.loose_m[0] == pytest.approx([1.0, 1.0, 0.0], abs=1e-4)

    # recorded as they came, and sent again
    tracks = take_tracks(take).tracks
    assert set(tracks) == {"Wand", "Cap"} and take_bodies(take).bodies[0].name == "Wand"
    count = len(tracks["Wand"].time_s)
    assert count > 100
    (take.path / TRACKS_FILE).unlink()
    assert len(take_tracks(Take.open(take.path)).tracks["Wand"].time_s) == count
    clip = Clip.load(take, "live")
    step = clip.step(len(clip.poses.time_s) // 2)
    assert {one.name for one in step.bodies} == {"Wand", "Cap"}
    markers_are_a_reference(take, step, tmp_path, capsys)

    # used as evidence
    path = str(take.path)
    for words in (["set", "Wand", "use=evidence"], ["set", "Cap", "use=evidence", "joint=head"]):
        assert main(["rigid", path, *words]) == 0
    assert main(["rigid", path, "measure", "live"]) == 0
    told = capsys.readouterr().out
    assert "cylinder:3,60,z" in told and "turned by" in told
    known = take_bodies(take)
    assert known.place.yaw_deg == pytest.approx(90.0, abs=3.0)
    apart = {"live": distances_mm(take, "live")["Wand"]}
    solve_take(take, preset("studio"), name="studio")
    apart["studio"] = distances_mm(take, "studio")["Wand"]
    assert np.median(apart["studio"]) < np.median(apart["live"])
    assert main(["rigid", path, "reference", str(tmp_path / "rigid.csv")]) == 0
    assert "right_hand" in (tmp_path / "rigid.csv").read_text().splitlines()[0]

    # as evidence live, as it was measured in that take
    answer = studio.http.patch("/rigid-bodies", json={"like_take": f"tests/{take.path.name}"})
    assert answer.status_code == 200, answer.text
    assert set(answer.json()["settings"]["ties"]) == {"Wand", "Cap"}
    assert answer.json()["measured"] == [f"tests/{take.path.name}"]
    again, _ = record(studio, cameras, *[nothing] * 2)
    events = [one.event for one in read_raw(again.raw_path) if isinstance(one, RawEvent)]
    ticks = [one for one in events if isinstance(one, TickEvent)]
    both = np.array([seen_before(again, name, ticks, known.later_s) for name in ("Wand", "Cap")]).all(axis=0)
    assert both.sum() > 20, "bodies came for ticks"
    told = np.array([set(one.pinned.get("performer_1", {})) == {"right_hand", "head"} for one in ticks])
    assert told[both].all(), f"{told[both].sum()} of {both.sum()} ticks at which both were seen are pinned"
    apart["pinned"] = distances_mm(again, "live")["Wand"]
    assert np.median(apart["pinned"]) < np.median(apart["live"])
    solve_take(again, preset("studio"), name="again", as_live=True)
    assert_equal_bits(again, "again")

    # a prop of its own
    main(["rigid", path, "set", "Wand", "use=prop"])
    for kind in ("fbx", "bvh", "glb", "usd"):
        file = tmp_path / f"wand.{kind}"
        assert (
            main(
                ["export", path, "--solve", "studio", "--prop", "Wand", "--format", kind, "--out", str(file)]
            )
            == 0
        )
        assert kind == "usd" or b"Wand_end" in file.read_bytes()
    lines = (tmp_path / "wand.bvh").read_text().splitlines()
    assert "ROOT Wand" in lines
    track, poses = stage_bodies(take).tracks["Wand"], Poses.load(take.solve_folder("studio") / "poses.npz")
    x, y, z = track.filled_at(poses.time_s[-1:])[0][0]
    tied = np.array(lines[-1].split()[:3], float) / 100
    assert tied == pytest.approx([x, z, -y], abs=0.03)  # y is up in the file, and the hand holds it
    both = str(tmp_path / "both.fbx")
    words = [
        "export",
        path,
        "--solve",
        "studio",
        "--prop",
        "Wand",
        "--together",
        "--format",
        "fbx",
        "--out",
        both,
    ]
    assert main(words) == 0
    capsys.readouterr()


WRONG = (
    {"osc_port": 0}, {"natnet_server": "a b"}, {"natnet_multicast": "10.0.0.1"}, {"natnet_up": "x"},
    {"place": {"x_m": 1e9}}, {"place": {"w_m": 1.0}}, {"bodies": [{"name": ""}]},
    {"bodies": [{"name": "a", "use": "evidence"}]}, {"bodies": [{"name": "a"}, {"name": "a"}]},
    {"bodies": [{"name": "a", "shape": {"kind": "box", "size_cm": [1]}}]},
)  # fmt: skip


def test_wrong_values_are_refused_and_hostile_packets_counted(studio, motive):  # noqa: F811
    for wrong in WRONG:
        answer = studio.http.patch("/rigid-bodies", json=wrong)
        assert answer.status_code == 422 and answer.json()["error"]["message"], answer.text
    assert studio.http.get("/rigid-bodies").json()["settings"]["bodies"] == []
    studio.http.patch("/rigid-bodies", json={"natnet": True, "natnet_port": motive.port})
    assert motive.asked_names.wait(60)
    random, sent = np.random.default_rng(1), 0

    def refused() -> bool:
        nonlocal sent
        for _ in range(20):
            motive.send_raw(b"\x07\x00" + random.bytes(int(random.integers(2, 1200))))
            sent += 1
        time.sleep(0.01)
        status = studio.http.get("/rigid-bodies").json()["status"]["natnet"]
        return status["refused"] > 300 and status["packets"] > 10 and status["problem"] == ""

    wait_until(refused, "hostile packets are counted, and others heard")
