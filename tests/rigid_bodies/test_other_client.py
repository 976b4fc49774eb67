"""A client of NatNet that was not written here, the package natnet (MIT), beside the studio's own reader."""

import natnet
import numpy as np
import pytest
from natnet.packet_buffer import PacketBuffer

from studio.rigid_bodies.natnet import NatNetDecoder
from tests.rigid_bodies import natnet_server
from tests.rigid_bodies.test_packets import BODIES, MARKERS, VERSIONS


@pytest.mark.parametrize("version", VERSIONS)
def test_it_reads_what_the_studio_reads(version):
    decoder, theirs = NatNetDecoder(), natnet.Version(*version)
    for data in (natnet_server.server_info(version), natnet_server.model(version, BODIES)):
        decoder.feed(data)
    told = PacketBuffer(natnet_server.server_info(version)[4:])
    info = natnet.ServerInfo.read_from_buffer(told, theirs)
    assert (info.application_name, info.nat_net_protocol_version.truncate(2)) == (decoder.server, theirs)
    model = natnet.DataDescriptions.read_from_buffer(
        PacketBuffer(natnet_server.model(version, BODIES)[4:]), theirs
    )
    labels = {one.name: one.marker_names for one in model.marker_sets}[model.skeletons[0].name]
    packet = natnet_server.frame(version, 9, BODIES, MARKERS)
    frame = natnet.DataFrame.read_from_buffer(PacketBuffer(packet[4:]), theirs)
    heard = decoder.feed(packet)
    assert heard.markers is not None
    names = {one.id_num: one.name for one in model.rigid_bodies}
    for ours, one in zip(heard.bodies, frame.rigid_bodies, strict=True):
        assert (ours.name, ours.tracked) == (names[one.id_num], one.tracking_valid)
        assert ours.position_m == pytest.approx(one.pos) and ours.rotation_xyzw == pytest.approx(one.rot)
    seen = [one for one in frame.labeled_markers if not one.occluded]
    named = [one for one in seen if not one.unlabeled]
    assert np.allclose(heard.markers.positions_m, [one.pos for one in named], atol=1e-5)
    assert np.allclose(heard.markers.loose_m, [one.pos for one in seen if one.unlabeled], atol=1e-5)
    assert heard.markers.names[0] == f"{model.skeletons[0].name}:{labels[named[0].marker_id - 1]}"
    assert named[0].model_id == model.skeletons[0].id_num
