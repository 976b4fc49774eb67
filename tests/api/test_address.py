"""Commands, links and codes for others name an address that other machines reach, or it is said that none does."""

import pytest

from studio.api.access import Access
from studio.api.address import in_url, is_any, is_loopback, own_address
from studio.api.cameras.qr import qr_picture
from studio.server.run import _url_for_others
from tests.web.playback.takes import take_with_solves


def own(port: int) -> str:
    address = own_address()
    if not address:
        pytest.skip("this machine has no address in a network")
    return f"http://{address}:{port}"


def test_a_studio_on_a_loopback_address_says_that_no_other_machine_reaches_it(studio) -> None:
    told = studio.http.get("/access").json()
    assert told["local"] and told["address"] == f"http://127.0.0.1:{studio.port}"
    assert studio.http.post("/cameras/invite", json={}).json()["local"]


def test_used_at_a_loopback_address_an_open_studio_names_its_address_in_the_network(
    open_studio, access: Access
) -> None:
    wanted = own(open_studio.port)
    take_with_solves(open_studio.sessions / "monday" / "one")
    headers = {"Authorization": f"Bearer {access.operator_token}"}

    def post(path: str, body: object) -> dict:
        answer = open_studio.http.post(path, json=body, headers=headers)
        assert answer.status_code == 201, answer.text
        return answer.json()

    told = open_studio.http.get("/access", headers=headers).json()
    assert (told["address"], told["local"]) == (wanted, False)
    invited = post("/cameras/invite", {})
    assert (invited["server"], invited["local"]) == (wanted, False)
    assert invited["url"].startswith(f"{wanted}/camera#")
    assert f"--server {wanted} --token " in post("/access/cameras", {"label": "x"})["command"]
    assert post("/access/viewers", {})["link"].startswith(f"{wanted}/signin#")
    shared = post("/takes/monday/one/solves/studio/share", {})
    code = open_studio.http.get(f"/shares/{shared['id']}/qr", headers=headers)
    assert code.content == bytes(qr_picture(wanted + shared["path"]).body)


@pytest.mark.parametrize(
    ("host", "loopback", "any_"),
    [
        ("127.0.0.1", True, False), ("::1", True, False), ("localhost", True, False), ("0.0.0.0", False, True),
        ("::", False, True), ("192.168.1.5", False, False), ("studio.example", False, False), ("", False, False),
    ],
)  # fmt: skip
def test_hosts(host: str, loopback: bool, any_: bool) -> None:
    assert (is_loopback(host), is_any(host)) == (loopback, any_)


def test_what_the_server_prints_names_no_address_that_stands_for_all() -> None:
    for host in ("0.0.0.0", "::"):
        printed = _url_for_others(f"http://{in_url(host)}:8000", host)
        assert host not in printed.split("//")[1] and printed.endswith(":8000")
    assert _url_for_others("https://studio.example:80", "studio.example") == "https://studio.example:80"
