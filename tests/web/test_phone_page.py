"""Phones as cameras: Chromium with real videos as its camera, from the QR code's address to the recorded take."""

import ssl
from collections import defaultdict
from urllib.parse import urlsplit

import msgspec
import numpy as np
import pytest
from playwright.sync_api import expect

from studio.__main__ import main
from studio.api.app import create_app
from studio.api.takes.find import Finder
from studio.live import LiveStage
from studio.take.raw.frames import RawFrame, read_raw
from studio.web import mount
from studio.wire import landmark_arrays
from tests import patient
from tests.acceptance.processes import wait_until
from tests.acceptance.test_open_to_network import open_program
from tests.web.browser import quiet_page, until
from tests.web.phones import SIZE, as_camera, as_counter, phone
from tests.web.stages import serving

pytestmark = pytest.mark.browser

FEED = """async ([name, boot_id]) => {
  const { Link, nowNs } = await import("/static/phone/link.js");
  const { Spool } = await import("/static/phone/spool.js");
  const { landmarkMessage } = await import("/static/phone/message.js");
  const { pack } = await import("/static/phone/msgpack.js");
  const spool = new Spool();
  await spool.open();
  const joints = { joint_set: "mediapipe", device: "phone" };
  const hello = { type: "hello", protocol_version: 2, name, boot_id, token: "", ...joints };
  const url = location.origin.replace("http", "ws") + "/api/v1/link";
  window.link = new Link({ url, hello, spool, status: () => ({}), changed: (state) => { window.state = state; } });
  const landmarks = Array.from({ length: 33 }, (_, i) => ({ x: 0.3 + i / 100, y: i / 40, visibility: 0.9 }));
  const hands = { left: null, right: landmarks.slice(0, 21) }, world = landmarks.map(() => ({ x: 0, y: 0, z: 0 }));
  const found = { landmarks, world, hands, width: 360, height: 640 };
  let sequence = 0;
  window.feed = (count) => {
    for (let i = 0; i < count; i += 1) link.frame(sequence, pack(landmarkMessage(sequence++, nowNs() + i, found)));
  };
  link.connect();
}"""
"""A phone's link without its camera: `feed(count)` makes frames."""


@pytest.fixture
def studio(tmp_path):
    """A real studio: its address, its routes, its folder of takes."""
    sessions = tmp_path / "sessions"
    stage = LiveStage(sessions)
    stage.start()
    app = create_app(stage, sessions)
    view = mount(app, stage, sessions=sessions, takes=Finder(stage, sessions), jobs=app.state.jobs)
    with serving(app) as url, patient.Client(base_url=f"{url}/api/v1") as http:
        yield url, http, sessions
        app.state.local_cameras.close()
        app.state.devices.close()
    view.close()
    stage.close()


def frames_of(sessions):
    """Frames of the only take, by camera and start of its client."""
    found = defaultdict(list)
    for record in read_raw(next(sessions.glob("*/*/raw.mcap"))):
        if isinstance(record, RawFrame):
            found[record.camera].append(record)
    return found


def test_two_phones_from_the_code_to_the_take(tmp_path, chromium, test_data, capsys):
    """Over TLS with the studio's own certificate, let in by invitations, and no other host is asked for anything."""
    sessions = tmp_path / "sessions"
    assert main(["certificate", "--sessions", str(sessions)]) == 0
    assert "fingerprint" in capsys.readouterr().out
    videos = test_data / "rgb" / "pose2sim_single"
    cameras = [as_camera(videos / f"cam0{n}.mp4", tmp_path / f"{n}.mjpeg") for n in (1, 3)]
    trusted = ssl.create_default_context(cafile=sessions / "certificate.pem")
    with (
        open_program(sessions) as (url, operator, _, errors),
        patient.Client(
            base_url=f"{url}/api/v1/", verify=trusted, headers={"Authorization": f"Bearer {operator}"}
        ) as http,
        phone(chromium, cameras[0]) as left,
        phone(chromium, cameras[1]) as right,
    ):
        phones = {"left": left, "right": right}
        for name, one in phones.items():
            invitation = http.post("phones/invite").json()
            assert invitation["secure"] and not invitation["local"] and invitation["minutes"] == 10
            one.start(invitation["url"], name)
        for one in phones.values():
            one.sends(5)
        assert set(http.get("status").json()["cameras"]) == {"left", "right"}
        http.post("record/start", json={}).raise_for_status()
        for one in phones.values():
            expect(one.page.locator("#recording")).to_be_visible()
        wanted = [(one, one.frames() + 15) for one in phones.values()]  # both go on while one is waited for
        for one, frames in wanted:
            one.sends(frames)
        http.post("record/stop").raise_for_status()
        for one in phones.values():
            expect(one.page.locator("#recording")).to_be_hidden()
            asked = {urlsplit(address).netloc for address in one.requests}
            assert asked == {urlsplit(invitation["url"]).netloc}
            assert one.complaints == []
        assert errors.read_text() == ""
        assert len(http.get("access").json()["cameras"]) == 3  # the first start's, and one of each phone
    found = frames_of(sessions)
    assert set(found) == {"left", "right"}
    for name, records in found.items():
        assert len(records) >= 12, name
        assert {(r.message.landmarks.width, r.message.landmarks.height) for r in records} == {SIZE}
        arrays = [landmark_arrays(r.message, "mediapipe") for r in records]
        whole = [np.isfinite(a.pixels).all() and np.isfinite(a.world_m).all() for a in arrays]
        assert np.mean(whole) >= 0.95, name
        middle = np.median([a.pixels[[11, 12, 23, 24]] for a in arrays], axis=(0, 1))
        assert (0.2 * np.array(SIZE) < middle).all() and (middle < 0.8 * np.array(SIZE)).all()


ONE_TIME = """() => {
  const next = HTMLVideoElement.prototype.requestVideoFrameCallback;
  HTMLVideoElement.prototype.requestVideoFrameCallback = function (call) {
    return next.call(this, (_, told) => call(1, told));
  };
}"""
"""A browser that gives all pictures one time."""


def test_a_phone_goes_on_after_another_model_and_after_a_stop(studio, chromium, tmp_path):
    """Also where a picture is being looked at just then, which is nearly always."""
    url, _, _ = studio
    with phone(chromium, as_counter(tmp_path / "counter.y4m", rate_hz=30)) as one:
        one.open(f"{url}/phone", "stand")
        one.page.evaluate(ONE_TIME)
        one.page.click("#start")
        one.sends(3)
        one.page.click("#open-settings")
        for model in ("full", "lite"):
            made = one.frames()
            one.page.select_option("#model", model)
            until(one.page, f"document.querySelector('#figures').textContent.includes({model!r})")
            one.sends(made + 4)
        one.page.keyboard.press("Escape")
        one.page.click("#stop")
        until(one.page, "document.body.dataset.view === 'start'")
        made = one.frames()
        one.page.click("#start")
        one.sends(made + 4)


WRITTEN = """() => new Promise((done) => {
  const { database } = link.keeper.spool;
  database.transaction(database.objectStoreNames).oncomplete = done; // it waits for those that write
})"""


def test_a_cut_link_and_a_closed_page_lose_no_frame(studio, chromium):
    url, http, sessions = studio
    with quiet_page(chromium) as page:
        page.goto(f"{url}/phone")
        page.evaluate(FEED, ["stand", "first"])
        until(page, "state === 'open'")
        http.post("/record/start", json={}).raise_for_status()
        until(page, "link.keeper.recording")
        page.evaluate("() => { feed(20); link.socket.close(); feed(20); }")
        assert page.evaluate("link.keeper.spool.owed") >= 20
        until(page, "link.welcomed && link.keeper.spool.owed === 0")
        page.evaluate("() => { link.close(); feed(10); link.keeper.spool.write(); }")
        page.evaluate(WRITTEN)  # of a page that closes at once, the next test tells
        page.reload()
        page.evaluate(FEED, ["stand", "second"])
        until(page, "link.welcomed && link.keeper.spool.owed === 0")
        page.evaluate("feed(5)")
        until(page, "link.framesSent === 5 && link.keeper.spool.owed === 0")
        http.post("/record/stop").raise_for_status()
        until(page, "link.keeper.spool.origins.size === 0")
    records = frames_of(sessions)["stand"]
    right = landmark_arrays(records[0].message, "mediapipe").right_hand
    assert right.shape == (21, 2) and np.allclose(right[0], [0.3 * 360 - 0.5, -0.5], atol=1e-4)
    sequences = sorted(r.frame.sequence for r in records)
    assert sequences == sorted([*range(50), *range(5)])


def test_frames_of_a_page_that_closes_at_once_are_kept(studio, chromium):
    """Thirty times, as a browser aborted one writing in six that was not yet committed; never a part of one."""
    write = """async (take) => {
      const { Spool } = await import("/static/phone/spool.js");
      const spool = new Spool();
      await spool.open();
      const found = [...spool.origins.values()].map(({ frames }) => frames.size);
      const hello = { name: "stand" }, data = new Uint8Array(4000);
      for (let i = 0; i < 10; i += 1) spool.append(`take_${take}`, "first", hello, i, data);
      spool.write();
      return found;
    }"""
    with quiet_page(chromium) as page:
        for take in range(30):
            page.goto(f"{studio[0]}/phone")
            found = page.evaluate(write, take)
            assert set(found) <= {10}
            assert take - len(found) <= 2  # a busy browser may still abort one


def test_messages_are_read_as_they_were_meant(studio, chromium):
    values = [0, 127, 128, -1, -32, -33, -(2**40), 2**53 - 1, 1.5, "é" * 40, [1] * 20, {"a": None, "b": True}]
    with quiet_page(chromium) as page:
        page.goto(f"{studio[0]}/phone")
        packed = page.evaluate(
            """async (values) => {
              const { pack } = await import("/static/phone/msgpack.js");
              return Array.from(pack([...values, 2n ** 62n, new Uint8Array(300).fill(7)]));
            }""",
            values,
        )
        assert msgspec.msgpack.decode(bytes(packed)) == [*values, 2**62, b"\x07" * 300]
        again = msgspec.msgpack.encode([*values, 2**62, b"\x07" * 300])
        same = page.evaluate(
            """async (bytes) => {
              const { pack, unpack } = await import("/static/phone/msgpack.js");
              const value = unpack(new Uint8Array(bytes));
              return [typeof value.at(-2), Array.from(pack(value))];
            }""",
            list(again),
        )
    assert same == ["bigint", packed]


TURNED = """async () => {
  const { unmirrored } = await import("/static/phone/message.js");
  const landmarks = Array.from({ length: 33 }, (_, i) => ({ x: i / 100, y: 0.5, visibility: 1 }));
  const hands = { left: null, right: landmarks.slice(0, 21) };
  const found = unmirrored({ landmarks, world: landmarks, hands, width: 100, height: 100 });
  if (found.hands.right || found.hands.left[0].x !== 1) throw new Error("hands are not exchanged");
  return [11, 12, 0, 7].map((joint) => [found.landmarks[joint].x, found.world[joint].x]);
}"""
ADVICE = """async (cases) => {
  const { advice } = await import("/static/phone/framing.js");
  const body = (top, bottom, aside) => Array.from({ length: 33 }, (_, i) => ({
    x: 0.5 + aside + (i % 2 ? 0.05 : -0.05), y: i < 11 ? top : i < 25 ? (top + bottom) / 2 : bottom, visibility: 1,
  }));
  const seen = { top: 0.15, bottom: 0.85, aside: 0, people: 1, body: true };
  const usual = { ...seen, brightness: 120, held: null, wide: false };
  return cases.map((one) => {
    const { top, bottom, aside, people, brightness, held, wide, body: there } = { ...usual, ...one };
    const found = { landmarks: there ? body(top, bottom, aside) : null, people };
    return advice({ found, brightness, held, wide }).key.split(".").at(-1);
  });
}"""


NEAREST = """async (heights) => {
  const { nearest } = await import("/static/phone/people.js");
  const person = (height) => [0, 1].map((end) => ({ x: 0.4 * height * end, y: 0.1 + height * end }));
  return nearest(heights.map(person));
}"""
"""The largest in the picture is taken, wherever the detector lists it."""


def test_advice_mirrored_pictures_and_the_nearest_of_several_people(studio, chromium):
    standing = {"slanted_deg": 0, "flat": False, "moving": False}
    cases = {
        "good": {"held": standing},
        "nobody": {"body": False},
        "two": {"people": 2},
        "dark": {"brightness": 20},
        "feet": {"bottom": 1.1},
        "head": {"top": -0.1},
        "whole": {"top": -0.1, "bottom": 1.1},
        "closer": {"top": 0.4, "bottom": 0.6},
        "back": {"top": 0.015, "bottom": 0.985},
        "left": {"aside": -0.35},
        "stand": {"held": standing | {"moving": True}},
        "slanted": {"held": standing | {"slanted_deg": 20}},
        "wide": {"wide": True},
    }
    with quiet_page(chromium) as page:
        page.goto(f"{studio[0]}/phone")
        assert page.evaluate(ADVICE, list(cases.values())) == list(cases)
        shoulder, other, nose, ear = page.evaluate(TURNED)
        people = ([0.8], [0.3, 0.8], [0.8, 0.3], [0.2, 0.9, 0.5])
        assert [page.evaluate(NEAREST, heights) for heights in people] == [0, 1, 0, 1]
    assert np.allclose(shoulder, [1 - 0.12, -0.12]) and np.allclose(other, [1 - 0.11, -0.11])
    assert np.allclose(nose, [1, 0]) and np.allclose(ear, [1 - 0.08, -0.08])


def test_what_a_phone_lacks_is_said(studio, chromium):
    url, _, _ = studio
    port = urlsplit(url).port
    refusing = "navigator.mediaDevices.getUserMedia = async () => { throw new DOMException('', '%s'); };"
    cases = [
        (url, refusing % "NotAllowedError", "was not allowed"),
        (url, refusing % "NotFoundError", "no camera here"),
        (url, refusing % "NotReadableError", "another app"),
        (url, "Object.defineProperty(window, 'WebAssembly', { value: undefined });", "too old"),
        (f"http://studio.test:{port}", "", "studio certificate"),
    ]
    with phone(chromium, None, "--host-resolver-rules=MAP studio.test 127.0.0.1") as one:
        for address, script, words in cases:
            page = one.page.context.new_page()
            page.add_init_script(script)
            page.goto(f"{address}/phone")
            page.click("#start")
            expect(page.locator("#problem")).to_contain_text(words)
            expect(page.locator("#start")).to_be_enabled()
            page.close()


def is_told(page, http, what: str) -> bool:
    """Whether the studio knows that this holds of a phone."""
    page.evaluate("1")  # lets the browser's events pass
    return f"phone_says.{what}" in [sentence["code"] for sentence in http.get("/status").json()["said"]]


def nobody_is_told(page, http) -> bool:
    """Whether the studio says that the only camera sees nobody or, on a busy machine, that it is too slow."""
    page.evaluate("1")
    (camera,) = http.get("/status").json()["cameras"].values()
    return camera["limited_by"] in ("no_performer", "processor") or is_told(page, http, "slow")


def test_two_people_are_told_at_once(studio, chromium, test_data, tmp_path):
    url, http, _ = studio
    video = as_camera(test_data / "rgb" / "pose2sim_two" / "cam01.mp4", tmp_path / "two.mjpeg")
    with phone(chromium, video) as one:
        one.start(f"{url}/phone")
        expect(one.page.locator("#advice")).to_contain_text("Several people")
        wait_until(lambda: is_told(one.page, http, "two_people"), "the studio knows of two people")


def test_the_operator_is_told_how_a_phone_comes_in(studio, chromium):
    with quiet_page(chromium) as page:
        page.goto(studio[0])
        page.get_by_role("button", name="Other cameras").click()
        page.click("#invite-phone")
        place = page.locator("#phone-invitation")
        expect(place.locator("code")).to_have_text("studio certificate && studio serve --host 0.0.0.0")
        expect(place.locator("a")).to_have_attribute("href", f"{studio[0]}/phone")


def test_models_are_served_and_nothing_beside_them(studio):
    url, http, _ = studio
    assert http.head(f"{url}/models/pose_landmarker_lite.task").status_code == 200
    for path in ("README.md", "LICENSE", "../__init__.py", "%2e%2e/__init__.py", "none.task"):
        assert http.get(f"{url}/models/{path}").status_code == 404, path
    policy = http.get(f"{url}/static/phone/pose_worker.js").headers["Content-Security-Policy"]
    assert "script-src 'self' 'wasm-unsafe-eval';" in policy
    assert http.get(f"{url}/phone").headers["Content-Security-Policy"] == policy


CANVAS = """
const canvas = document.createElement('canvas');
canvas.width = 320;
canvas.height = 240;
setInterval(() => {
  const pen = canvas.getContext('2d');
  pen.fillStyle = canvas.width % 3 ? '#888' : '#999';
  pen.fillRect(0, 0, canvas.width, canvas.height);
}, 50);
window.turn = () => Object.assign(canvas, { width: 240, height: 320 });
navigator.mediaDevices.getUserMedia = async () => {
  if (window.called) throw new DOMException('', 'NotReadableError');
  window.stream = canvas.captureStream(15);
  window.settings = { deviceId: 'back', frameRate: 15, zoom: 1, exposureTime: 100, iso: 200 };
  stream.getVideoTracks()[0].getSettings = () => window.settings;
  return stream;
};
window.hold = async (y, z, after_ms) => {
  const real = performance.now.bind(performance);
  performance.now = () => real() + after_ms;
  const event = new Event('devicemotion');
  event.accelerationIncludingGravity = { x: 0, y, z };
  for (let i = 0; i < 40; i += 1) dispatchEvent(event);
  performance.now = real;
};
window.take_away = () => {
  stream.getVideoTracks()[0].stop();
  stream.getVideoTracks()[0].dispatchEvent(new Event('ended'));
};
Object.defineProperty(document, 'hidden', { get: () => Boolean(window.away) });
window.look = (away) => { window.away = away; document.dispatchEvent(new Event('visibilitychange')); };
"""
"""A camera whose picture is a grey canvas, and a page that can be put aside."""


def test_what_happens_to_a_phone_is_told_at_once(studio, chromium):
    url, http, _ = studio

    def told(what: str) -> None:
        wait_until(lambda: is_told(page, http, what), f"the studio knows that it is {what}")

    with phone(chromium) as one:
        page = one.page
        page.add_init_script(CANVAS)
        one.start(f"{url}/phone")
        expect(page.locator("#advice")).to_have_text("Nobody in the picture")
        wait_until(lambda: nobody_is_told(page, http), "the studio knows that nobody is seen")
        page.evaluate("settings = { ...settings, exposureTime: 300 }")
        told("exposure")
        page.evaluate("hold(9.81, 0, 0); hold(9.81, 0, 3000)")
        page.evaluate("hold(9.5, 2.4, 3100)")
        told("moved")
        page.evaluate("settings = { ...settings, zoom: 2 }")
        told("lens")
        page.evaluate("turn()")
        told("rotated")
        page.evaluate("look(true)")
        told("hidden")
        page.evaluate("look(false)")
        page.evaluate("called = true; take_away()")
        told("interrupted")
        made = one.frames()
        page.evaluate("called = false")
        one.sends(made + 2)
        wait_until(lambda: not is_told(page, http, "interrupted"), "the camera goes on after the call")
        page.click("#stop")
        expect(page.locator("#start")).to_be_visible()
        assert one.complaints == []
