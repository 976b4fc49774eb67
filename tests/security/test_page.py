"""Texts that hold HTML, wherever a person or a camera may put one, stay texts on every page."""

import pytest
from playwright.sync_api import expect

from studio.api.app import create_app
from studio.api.takes.find import Finder
from studio.live import LiveStage
from studio.take.library.slate import Slate, change_slate
from studio.web import mount
from tests import patient
from tests.api.camera import Camera
from tests.live.performer import calibration
from tests.web.browser import quiet_page
from tests.web.playback.takes import take_with_solves
from tests.web.stages import serving

pytestmark = pytest.mark.browser
EVIL = "<img src=x onerror='window.hacked=1'><script>window.hacked=1</script>"
EVIL_NAME = "a&quot;' onerror=&apos;alert(1)"


@pytest.fixture
def studio(tmp_path):
    """Address of a studio whose every text is evil, and the token of a blind test."""
    sessions = tmp_path / "sessions"
    take = take_with_solves(sessions / "monday" / "one")
    take.add_calibration(calibration(["camera_0"]), use=True)
    change_slate(sessions, "monday", "one", Slate(performer=EVIL, notes=EVIL, name=EVIL_NAME))
    stage = LiveStage(sessions)
    stage.start()
    app = create_app(stage, sessions)
    view = mount(app, stage, sessions=sessions, takes=Finder(stage, sessions), jobs=app.state.jobs)
    with serving(app) as url, patient.Client(base_url=f"{url}/api/v1", timeout=60) as http:
        sides = {
            side: {"take": f"monday/{EVIL_NAME}", "solve": solve, "condition": EVIL[:60]}
            for side, solve in (("a", "studio"), ("b", "live"))
        }
        pair = {"title": EVIL, "start_s": 0.0, "end_s": 1.0, **sides}
        rules = {"repeats": 0, "ask_name": True}
        made = http.post("/blind", json={"title": EVIL, "question": EVIL, "pairs": [pair], "rules": rules})
        yield url, made, http
    view.close()
    stage.close()


def test_html_in_texts_is_shown_and_not_run(studio, chromium):
    url, made, http = studio
    assert made.status_code < 300, made.text
    token = made.json()["token"]
    key = http.post(f"/vote/{token}/join", json={"name": EVIL[:60]}).json()["voter"]
    vote = {"choice": "left", "comment": EVIL}
    http.put(f"/vote/{token}/0", json=vote, headers={"X-Voter": key}).raise_for_status()
    http.post("/outputs", json={"kind": "rokoko", "actor": EVIL[:60], "enabled": False}).raise_for_status()
    http.post("/access/cameras", json={"label": EVIL[:60]}).raise_for_status()
    with Camera(url.replace("http", "ws") + "/api/v1/link", 0) as camera:
        camera.greet(device=EVIL, serial=EVIL[:60])
        for _ in range(3):
            camera.send_frame()
        for path, ready in (
            ("/", "body[data-connection=open]"),
            ("/blind", "body"),
            (f"/vote/{token}", "body"),
        ):
            with quiet_page(chromium) as page:
                page.goto(url + path)
                page.wait_for_selector(ready)
                if path == "/":
                    expect(page.locator("body")).to_contain_text(EVIL_NAME[:10])
                page.wait_for_timeout(1500)
                assert page.evaluate("window.hacked") is None, path
                assert page.locator("img[src=x]").count() == 0, path
                assert page.locator("script:text('hacked')").count() == 0, path


def test_no_script_writes_html():
    """Pages make elements and set texts; none of the ways to parse a text as HTML is in their modules."""
    from pathlib import Path

    import studio.web

    static = Path(studio.web.__file__).parent / "static"
    ways = (
        "innerHTML",
        "outerHTML",
        "insertAdjacentHTML",
        "document.write",
        "eval(",
        "new Function",
        "srcdoc",
    )
    for module in static.rglob("*.js"):
        if "vendor" not in module.parts:
            text = module.read_text(encoding="utf-8")
            assert not [way for way in ways if way in text], module.name
    for template in static.parent.glob("templates/*.html"):
        assert "|safe" not in template.read_text(encoding="utf-8").replace(" ", ""), template.name
