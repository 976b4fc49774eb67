"""Packets of rigid bodies: as their documentation has them, and hostile ones."""

import sys
import tracemalloc

import numpy as np
import pytest
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from scipy.spatial.transform import Rotation

from studio.engine.rigid_bodies.reading import to_stage_axes
from studio.rigid_bodies.content import PacketContent
from studio.rigid_bodies.natnet import NatNetDecoder
from studio.rigid_bodies.trackers import TrackerDecoder, unity_euler_xyzw
from tests.rigid_bodies import natnet_server

BODIES: list[natnet_server.Body] = [
    (7, "Wand", (1.0, 2.0, 3.0), (0.0, 0.0, 0.6, 0.8), True),
    (9, "Cap", (0.5, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0), False),
]
VERSIONS = ((3, 0), (3, 1), (4, 0), (4, 1), (4, 2))
MARKERS: list[natnet_server.Marker] = [
    (natnet_server.PERFORMER_NUMBER, 1, (0.1, 0.5, 0.2), 2),
    (natnet_server.PERFORMER_NUMBER, 2, (-0.1, 0.5, 0.2), 2 + 1),  # occluded
    (7, 2, (1.0, 2.0, 3.1), 2),
    (5, 1, (0.0, 1.0, 0.0), 4),
    (0, 1203, (2.0, 0.0, 1.0), 2 + 16),  # unlabelled
]


@pytest.mark.parametrize("version", VERSIONS)
def test_natnet_tells_names_and_poses(version):
    decoder = NatNetDecoder()
    assert not decoder.feed(natnet_server.frame(version, 1, BODIES))  # before its version is known
    decoder.feed(natnet_server.server_info(version))
    unnamed = [decoder.feed(natnet_server.frame(version, 1, BODIES)) for _ in range(501)]
    assert not unnamed[-2] and unnamed[-1].bodies[0].name == "body 7"  # a server that tells no names
    decoder.feed(natnet_server.model(version, BODIES))
    wand, cap = decoder.feed(natnet_server.frame(version, 2, BODIES)).bodies
    assert (decoder.server, decoder.version, decoder.refused) == ("Motive", version, 0)
    assert (wand.name, wand.position_m, wand.tracked) == ("Wand", (1.0, 2.0, 3.0), True)
    assert wand.rotation_xyzw == pytest.approx((0.0, 0.0, 0.6, 0.8))
    assert (cap.name, cap.tracked) == ("Cap", False)


@pytest.mark.parametrize("version", VERSIONS)
def test_natnet_tells_markers(version):
    decoder = NatNetDecoder()
    decoder.feed(natnet_server.server_info(version))
    decoder.feed(natnet_server.model(version, BODIES))
    heard = decoder.feed(natnet_server.frame(version, 1, BODIES, MARKERS))
    assert [one.name for one in heard.bodies] == ["Wand", "Cap"] and decoder.refused == 0
    assert heard.markers is not None
    hem = "Cape:Hem" if version >= (4, 1) else "asset 5:1"  # trained marker sets are told from 4.1 on
    assert heard.markers.names == ("Anna:LKNE", "Wand:b" if version >= (4, 0) else "Wand:2", hem)
    assert heard.markers.positions_m == ((0.1, 0.5, 0.2), (1.0, 2.0, 3.1), (0.0, 1.0, 0.0))
    assert heard.markers.loose_m == ((2.0, 0.0, 1.0),)
    alone = decoder.feed(natnet_server.frame(version, 2, BODIES)).markers
    assert alone is not None and alone.loose_m == (
        (0, 1, 2),
        (3, 4, 5),
    )  # unlabelled ones in their own section


def message(address: str, *arguments: str | float) -> OscMessageBuilder:
    builder = OscMessageBuilder(address)
    for argument in arguments:
        builder.add_arg(argument)
    return builder


def test_trackers_of_vmc_and_vrchat():
    decoder = TrackerDecoder()
    bundle = OscBundleBuilder(IMMEDIATELY)
    bundle.add_content(message("/VMC/Ext/Tra/Pos", "LHR-1", 0.1, 1.0, 0.2, 0.0, 0.6, 0.0, 0.8).build())
    bundle.add_content(message("/VMC/Ext/Hmd/Pos", "HMD", 0.0, 1.7, 0.0, 0.0, 0.0, 0.0, 1.0).build())
    bundle.add_content(message("/VMC/Ext/Bone/Pos", "Hips", *[0.0] * 6, 1.0).build())
    tracker, headset = decoder.feed(bundle.build().dgram)
    assert (tracker.name, headset.name) == ("LHR-1", "HMD")
    assert tracker.rotation_xyzw == pytest.approx((0.0, 0.6, 0.0, 0.8))
    assert decoder.feed(message("/tracking/trackers/3/rotation", 10.0, 20.0, 30.0).build().dgram) == []
    (third,) = decoder.feed(message("/tracking/trackers/3/position", 1.0, 2.0, 3.0).build().dgram)
    assert (third.name, third.position_m) == ("tracker 3", (1.0, 2.0, 3.0))
    assert third.rotation_xyzw == pytest.approx(unity_euler_xyzw(10.0, 20.0, 30.0))
    assert decoder.refused == 0
    decoder.feed(message("/tracking/trackers/9/position", 1.0, 2.0, 3.0).build().dgram)
    assert decoder.feed(message("/nothing", 1.0).build().dgram) == [] and decoder.refused == 1


def test_unity_s_angles_are_about_z_then_x_then_y():
    expected = Rotation.from_euler("zxy", [30.0, 10.0, 20.0], degrees=True).as_quat()
    np.testing.assert_allclose(unity_euler_xyzw(10.0, 20.0, 30.0), expected, atol=1e-12)


@pytest.mark.parametrize("axes", ["y_up", "z_up", "unity"])
def test_axes_turn_points_and_rotations_alike(axes):
    """A point carried by a body lies at the same place, whichever axes it was carried in."""
    random = np.random.default_rng(0)
    turns = Rotation.random(20, random_state=0)
    places, point = random.normal(size=(20, 3)), random.normal(size=3)

    def stage(points: np.ndarray) -> np.ndarray:
        return to_stage_axes(points, np.tile([0.0, 0.0, 0.0, 1.0], (len(points), 1)), axes)[0]

    carried = stage(places + turns.apply(point))
    found, wxyz = to_stage_axes(places, turns.as_quat(), axes)
    own = stage(point[None])[0]
    again = found + Rotation.from_quat(wxyz[:, [1, 2, 3, 0]]).apply(own)
    np.testing.assert_allclose(again, carried, atol=1e-12)


def hostile(seeds: list[bytes], count: int):
    """Packets that are cut, changed, lengthened or random."""
    random = np.random.default_rng(1)
    for k in range(count):
        data = bytearray(seeds[k % len(seeds)])
        for place in random.integers(0, len(data), k % 7):
            data[place] = random.integers(0, 256)
        cut = int(random.integers(0, len(data) + 1)) if k % 3 == 0 else len(data)
        yield bytes(data[:cut]) + (random.bytes(int(random.integers(0, 400))) if k % 5 == 0 else b"")
        if k % 4 == 0:
            yield random.bytes(int(random.integers(0, 600)))


@pytest.mark.parametrize("kind", ["natnet 3.0", "natnet 4.1", "osc"])
def test_ten_thousand_hostile_packets_do_no_harm(kind):
    version = (4, 1) if kind.endswith("4.1") else (3, 0)
    good = [natnet_server.frame(version, 1, BODIES, MARKERS), natnet_server.model(version, BODIES)]
    good.append(natnet_server.server_info(version))
    decoder: NatNetDecoder | TrackerDecoder = NatNetDecoder()
    if kind == "osc":
        pose = [0.1, 1.0, 0.2, 0.0, 0.6, 0.0, 0.8]
        good = [
            message("/VMC/Ext/Tra/Pos", "LHR-1", *pose).build().dgram,
            message("/tracking/trackers/3/rotation", 10.0, 20.0, 30.0).build().dgram,
            message("/tracking/trackers/3/position", 1.0, 2.0, 3.0).build().dgram,
        ]
        decoder = TrackerDecoder()
    for data in good[::-1]:
        decoder.feed(data)
    packets = list(hostile(good, 8200))
    assert len(packets) > 10_000
    found = [decoder.feed(data) for data in packets[:2000]]
    tracemalloc.start()
    for data in packets[2000:]:
        found[0] = decoder.feed(data)
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 100_000, f"{grown} bytes are held on {sys.platform}"
    assert decoder.refused > 3000
    for heard in found:
        for one in heard.bodies if isinstance(heard, PacketContent) else heard:
            assert np.isfinite([*one.position_m, *one.rotation_xyzw]).all() and len(one.name) <= 64
        if isinstance(heard, PacketContent) and heard.markers is not None:
            assert np.isfinite([*heard.markers.positions_m, *heard.markers.loose_m]).all()
            assert all(len(name) <= 140 for name in heard.markers.names)
    for data in good[::-1]:
        decoder.feed(data)  # it still reads what is right
    assert decoder.feed(good[0] if kind != "osc" else good[2])
