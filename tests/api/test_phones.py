"""How a phone comes in as a camera: by an invitation where tokens are asked for, once, and not for long."""

import base64

from studio import wire
from studio.api.access.invitations import INVITATION_S
from studio.api.access.tokens import MAX_FAILURES
from tests.patient import connect


def invited(studio, access) -> str:
    answer = studio.http.post("/phones/invite", headers={"Authorization": f"Bearer {access.operator_token}"})
    told = answer.json()
    assert not told["secure"] and told["minutes"] == 10 and told["fingerprint"] == ""
    assert "/phone#" in told["url"] and b"<svg" in base64.b64decode(told["qr"])
    return told["url"].split("#")[1]


def comes_in(studio, invitation: str, name: str = ""):
    return studio.http.post("/phones", json={"invitation": invitation, "name": name})


def answer_to(studio, name: str, token: str) -> wire.Message:
    with connect(studio.url("link")) as socket:
        hello = wire.Hello(wire.PROTOCOL_VERSION, name, "phone", "mediapipe", "boot", token=token)
        socket.send(wire.encode(hello))
        return wire.decode(socket.recv())


def test_on_a_loopback_address_a_phone_gets_a_name(studio):
    told = studio.http.post("/phones/invite").json()
    assert told["local"] and told["minutes"] == 0 and told["url"].endswith("/phone")
    assert [comes_in(studio, "").json()["name"] for _ in range(2)] == ["phone_1", "phone_2"]
    assert comes_in(studio, "", "stand").json() == {"name": "stand", "token": ""}
    assert comes_in(studio, "", "no name").status_code == 422


def test_an_invitation_makes_one_camera(open_studio, access):
    invitation = invited(open_studio, access)
    entry = comes_in(open_studio, invitation).json()
    assert isinstance(answer_to(open_studio, entry["name"], entry["token"]), wire.Welcome)
    assert comes_in(open_studio, invitation).status_code == 401
    made = access.camera_tokens()[-1]
    assert made["label"] == entry["name"]
    access.remove_camera(made["id"])
    assert isinstance(answer_to(open_studio, entry["name"], entry["token"]), wire.Refused)


def test_an_invitation_is_over_in_time_and_with_the_operator_s_token(open_studio, access, clock):
    late, cancelled = invited(open_studio, access), invited(open_studio, access)
    clock[0] += INVITATION_S + 1
    assert comes_in(open_studio, late).status_code == 401
    cancelled = invited(open_studio, access)
    access.renew_operator()
    assert comes_in(open_studio, cancelled).status_code == 401


def test_an_invitation_lets_nobody_look_and_codes_cannot_be_guessed(open_studio, access):
    assert open_studio.http.post("/phones/invite").status_code == 401
    invitation = invited(open_studio, access)
    assert (
        open_studio.http.get("/status", headers={"Authorization": f"Bearer {invitation}"}).status_code == 401
    )
    codes = [comes_in(open_studio, f"guess {i}").status_code for i in range(MAX_FAILURES)]
    assert set(codes[:-1]) == {401} and comes_in(open_studio, invitation).status_code == 429
