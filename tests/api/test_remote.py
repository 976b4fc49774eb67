"""The invitation of a phone: on a loopback address none is needed; elsewhere it signs one browser in, once."""

import base64

from studio.api.access.invitations import INVITATION_S
from tests import patient


def test_without_tokens_the_address_is_this_machine_s(studio):
    told = studio.http.post("/remote").json()
    assert told["local"] and told["minutes"] == 0
    assert told["url"] == f"http://127.0.0.1:{studio.port}/remote"
    assert base64.b64decode(told["qr"]).startswith(b"<?xml") or b"<svg" in base64.b64decode(told["qr"])


def invited(studio, access) -> str:
    answer = studio.http.post("/remote", headers={"Authorization": f"Bearer {access.operator_token}"})
    told = answer.json()
    assert not told["local"] and told["minutes"] == 10 and "/signin?next=/remote#" in told["url"]
    return told["url"].split("#")[1]


def sign_in(studio, token: str) -> int:
    return studio.http.post("/access/signin", json={"token": token}).status_code


def test_an_invitation_signs_in_once(open_studio, access):
    token = invited(open_studio, access)
    root = f"http://127.0.0.1:{open_studio.port}"
    with patient.Client(base_url=root) as phone:
        assert phone.post("/api/v1/access/signin", json={"token": token}).status_code == 204
        assert phone.get("/api/v1/status").status_code == 200
        assert phone.get("/api/v1/access").json()["role"] == "operator"
    assert sign_in(open_studio, token) == 401


def test_an_invitation_is_over_in_time_and_with_the_operator_s_token(open_studio, access, clock):
    late, cancelled = invited(open_studio, access), invited(open_studio, access)
    access.renew_operator()
    assert sign_in(open_studio, cancelled) == 401
    late = invited(open_studio, access)
    clock[0] += INVITATION_S + 1
    assert sign_in(open_studio, late) == 401


def test_nobody_else_can_invite_or_use_it_as_a_password(open_studio, access):
    assert open_studio.http.post("/remote").status_code == 401
    token = invited(open_studio, access)
    assert open_studio.http.get("/status", headers={"Authorization": f"Bearer {token}"}).status_code == 401
