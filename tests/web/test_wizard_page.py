"""The wizard and the remote control in a real browser, with statuses like the stage's, written step by step."""

import json
import re
from pathlib import Path

import pytest
from playwright.sync_api import APIResponse, Page, Route, WebSocketRoute, expect

from studio.engine.base.sentences import codes_of, say
from studio.engine.calibration.quality.verdict import Facts, verdict
from tests.patient import connect
from tests.web.stages import until
from tests.web.test_page import FAINT, NAMELESS, SIZES, performing, serving, studio

pytestmark = pytest.mark.browser
VERDICT = {"residual_median_mm": 31.0, "residual_p95_mm": 120.0, "coverage": 0.9}


class Told:
    """Statuses that a page is told instead of the stage's own."""

    def __init__(self, page: Page, message: dict) -> None:
        self.message = message
        self._routes: list[WebSocketRoute] = []
        page.route_web_socket("**/api/v1/events", self._follow)

    def _follow(self, route: WebSocketRoute) -> None:
        """Send the message whenever the stage sends its own, because a page doubts a silent server."""
        self._routes.append(route)
        route.connect_to_server().on_message(lambda _: route.send(json.dumps(self.message)))

    def calibration(self, attempt: dict | None = None, tpose: dict | None = None, **changes: object) -> None:
        """Change the calibration's attempt and T-pose, and send the status."""
        known = self.message["status"]["calibration"]
        known["attempt"].update(attempt or {})
        known["tpose"].update(tpose or {})
        known.update(changes)
        for route in self._routes:
            route.send(json.dumps(self.message))


@pytest.fixture
def address(tmp_path: Path):
    """Address of a studio without cameras."""
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def camera() -> dict:
    """A camera that is fine, as the status has it."""
    clock = {"offset_ms": 0.0, "drift_ppm": 0.0, "error_ms": 0.1, "jumps": 0}
    counts = dict.fromkeys(("kept_by_client", "unknown_by_client", "not_kept_by_client", "previews"), 0)
    figures = {"fps": 30.0, "latency_ms": 5.0, "jitter_ms": 1.0, "loss_percent": 0.0, "confidence": 0.9}
    words = {"state": "live", "limited_by": "", "reason": "", "device": "test", "machine": "", "message": ""}
    flags = {"connected": True, "calibrated": True, "reference": False, "local": True}
    return {**flags, **words, **figures, **counts, "clock": clock, "shift_mm": None, "frames": 100}


@pytest.fixture
def told(address: str, page: Page) -> Told:
    """A page that is told of two cameras."""
    with connect(f"{address.replace('http', 'ws')}/api/v1/events") as events:
        message = json.loads(events.recv(timeout=60))
    message["status"]["cameras"] = {"left": camera(), "right": camera()}
    return Told(page, message)


def coverage(points: int, enough: bool) -> dict:
    cells = [[x, z, points // 10] for x in range(-2, 2) for z in (4, 5, 6)][: max(1, points // 60)]
    return {"points": points, "cells": cells, "enough": enough}


def open_page(page: Page, address: str) -> None:
    page.goto(address)
    expect(page.locator("#connection")).to_have_text("Connected")
    expect(page.locator("#preset")).to_be_visible()


def walk(told: Told) -> None:
    told.calibration()
    seen = {"left": coverage(300, False), "right": coverage(900, True)}
    near = {"right": {"residual_median_mm": 41.4, "residual_p95_mm": 300.0}}
    told.message["status"]["cameras"]["left"]["reference"] = True
    told.calibration(
        {"state": "gathering", "seconds": 34.0, "progress": 0.5, "coverage": seen, "estimates": near}
    )


def test_from_the_walk_to_a_measured_performer(address: str, page: Page, told: Told) -> None:
    open_page(page, address)
    page.locator("h1").click()
    walk(told)  # somebody begins: the wizard opens by itself
    big = page.locator("#wizard-big")
    expect(big).to_have_text("Walk and turn")
    expect(page.locator("#wizard-number")).to_have_text(re.compile(r"\d+"))
    expect(page.locator(".wizard-map")).to_have_count(2)
    expect(page.locator(".wizard-map").first).to_contain_text("50 %")
    expect(page.locator(".wizard-map").last).to_contain_text("enough")
    expect(page.locator(".wizard-residual")).to_have_text(["reference", "41 mmto the reference"])
    assert page.evaluate(FAINT) == [] and page.evaluate(NAMELESS) == []
    told.calibration({"state": "computing", "progress": 0.9})
    expect(big).to_have_text("Computing")
    why = "too little spread: walk through the whole stage"
    told.calibration(
        {
            "state": "failed",
            "message": f"refused: right: {why}",
            "cameras": {
                "left": {**VERDICT, "verdict": "good", "reasons": []},
                "right": {**VERDICT, "verdict": "refused", "reasons": [why]},
            },
        }
    )
    expect(big).to_have_text("Refused")
    expect(page.locator("body")).to_have_attribute("data-sound", "refusal")
    expect(page.locator("#wizard-cards")).to_contain_text("31 mm, 95 % within 120 mm")
    expect(page.locator("#wizard-cards p")).to_have_text("too little spreadwalk through the whole stage")
    expect(page.locator("#wizard-again")).to_have_class("primary")
    unplaced = {**VERDICT, "residual_median_mm": None, "residual_p95_mm": None, "verdict": "refused"}
    few = "a whole body is in 38 of its pictures only: walk for longer"
    told.calibration({"cameras": {name: {**unplaced, "reasons": [few]} for name in ("left", "right")}})
    expect(page.locator("#wizard-cards .figure")).to_have_text(["–", "–"])
    expect(page.locator("#wizard-cards p")).to_have_count(2)
    walk(told)
    told.calibration({"state": "done", "cameras": {"left": {**VERDICT, "verdict": "good", "reasons": []}}})
    expect(big).to_have_text("Good")
    page.locator("#wizard-pose").click()
    expect(page.locator("#wizard-tpose")).to_be_enabled()
    told.calibration(tpose={"state": "countdown", "seconds_left": 4.8, "problems": ["left arm too low"]})
    expect(page.locator("#wizard-number")).to_have_text(re.compile(r"[0-5]"))
    expect(page.locator("#wizard-small")).to_have_text("left arm too low")
    told.calibration(tpose={"state": "holding", "seconds_left": 2.0, "problems": []})
    expect(big).to_have_text("Hold still")
    told.calibration(tpose={"state": "done", "height_m": 1.78, "message": "measured"}, height_m=1.78)
    expect(big).to_have_text("Ready to record")
    expect(page.locator("#wizard-small")).to_contain_text("1.78 m")
    expect(page.locator("body")).to_have_attribute("data-sound", "success")
    page.keyboard.press("Escape")
    expect(page.locator("#wizard")).to_be_hidden()


def test_a_simulated_performer_s_walk_covers_nothing(address: str, page: Page, told: Told) -> None:
    """It is seen while it walks by itself; a T-pose that is begun, or a click, opens the wizard as always."""
    for one in told.message["status"]["cameras"].values():
        one["device"] = "simulated"
    open_page(page, address)
    walk(told)
    expect(page.locator("#calibration-badge")).to_have_text("calibrating")
    expect(page.locator("#wizard")).to_be_hidden()
    page.locator("#calibrate").click()
    expect(page.locator("#wizard-big")).to_have_text("It walks by itself")
    page.keyboard.press("Escape")
    expect(page.locator("#wizard")).to_be_hidden()
    told.calibration({"state": "idle"}, {"state": "countdown", "seconds_left": 4.8})
    expect(page.locator("#wizard-big")).to_be_visible()


def test_what_is_known_of_cameras_without_depth_is_typed(
    address: str, page: Page, told: Told, tmp_path: Path
) -> None:
    """Height and lenses go with the walk."""
    for one in told.message["status"]["cameras"].values():
        one["joint_set"] = "mediapipe"
    told.message["status"]["cameras"]["kinect"] = camera() | {"joint_set": "kinect-v2"}
    open_page(page, address)
    told.calibration()
    page.locator("#calibrate").click()
    expect(page.locator(".lens")).to_have_count(2)  # the Kinect measures depth
    page.fill("#wizard-tall", "1.82")
    expect(page.locator("#performer-tall")).to_have_value("1.82")
    left, right = (page.locator(".lens", has_text=name) for name in ("left", "right"))
    left.locator("select").select_option("field")
    expect(left.locator(".lens-value")).to_have_value("65")
    left.locator(".lens-value").fill("59.5")
    file = tmp_path / "right.json"
    file.write_text("{}")
    right.locator("select").select_option("file")
    right.locator("input[type=file]").set_input_files(file)
    expect(right.get_by_role("button")).to_have_text("right.json")
    page.get_by_label("Unknown lenses are alike").check()
    assert page.evaluate(FAINT) == [] and page.evaluate(NAMELESS) == []
    assert page.evaluate("document.querySelector('#wizard .wizard-main').scrollWidth <= innerWidth")
    page.route("**/calibration/start", lambda route: route.fulfill(status=202, json={}))
    with page.expect_request("**/calibration/start") as sent:
        page.locator("#wizard-walk").click()
    assert sent.value.post_data_json == {
        "height_m": 1.82,
        "lenses": {"left": {"field_deg": 59.5, "off": 2}, "right": {"file": "right.json", "text": "{}"}},
        "same_lens": True,
    }


def test_it_is_legible_from_afar_fits_every_screen_and_is_muted_for_good(
    address: str, page: Page, told: Told
) -> None:
    open_page(page, address)
    page.locator("#remote-link").click()
    expect(page.locator("#phone")).to_contain_text("answers on this computer only")
    page.keyboard.press("Escape")
    expect(page.locator("#phone")).to_be_hidden()
    walk(told)
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        assert page.evaluate("document.querySelector('#wizard').scrollWidth <= innerWidth")
        sizes = page.evaluate(
            "['#wizard-big', '#wizard-number'].map((which) =>"
            " parseFloat(getComputedStyle(document.querySelector(which)).fontSize))"
        )
        if (
            width == 1920
        ):  # 15 minutes of arc at 3 m on a 24 inch screen are 13 mm, 47 pixels of capital letters
            assert min(sizes) >= 65
        finish = page.locator("#wizard-enough").bounding_box()
        assert finish is not None and finish["y"] + finish["height"] <= height
    page.set_viewport_size({"width": 1280, "height": 720})
    page.locator("#wizard-mute").click()
    expect(page.locator("#wizard-mute")).to_have_text("Sound off")
    before = page.evaluate("document.body.dataset.sound")
    told.calibration({"state": "computing"})
    expect(page.locator("#wizard-big")).to_have_text("Computing")
    assert page.evaluate("document.body.dataset.sound") == before != "step"
    assert page.evaluate("localStorage.getItem('muted')") == "yes"


def test_the_remote_control_says_the_same_and_records(tmp_path: Path, page: Page) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    with studio(tmp_path) as (app, stage), serving(app) as url:
        page.goto(f"{url}/remote")
        expect(page.locator("#big")).to_have_text("No camera yet")
        expect(page.locator("#record")).to_be_disabled()
        with performing(url):
            expect(page.locator("#big")).to_have_text("2 cameras ready")
            assert page.evaluate(FAINT) == [] and page.evaluate(NAMELESS) == []
            page.locator("#record").click()
            expect(page.locator("#big")).to_have_text("Recording")
            expect(page.locator("#record")).to_contain_text("Stop")
            assert stage.recording_name() is not None
            answers: list[tuple[Route, APIResponse]] = []
            page.route("**/record/stop", lambda route: answers.append((route, route.fetch())))
            page.locator("#record").click()
            expect(page.locator("#record")).to_have_text("Record")
            until(lambda: stage.recording_name() is None)
            expect(page.locator("#calibrate")).to_be_disabled()  # a click before the answer would be lost
            until(lambda: page.evaluate("true") and bool(answers))  # Playwright hands it over meanwhile
            answers[0][0].fulfill(response=answers[0][1])
            page.locator("#calibrate").click()
            expect(page.locator("#big")).to_have_text("Hold a T-pose")
            expect(page.locator("#calibrate")).to_have_text("Enough")
            page.set_viewport_size({"width": 844, "height": 390})
            assert page.evaluate(
                "document.querySelector('main').scrollHeight <= document.querySelector('main').clientHeight"
            )
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_what_the_server_says_is_told_in_french(address: str, page: Page, told: Told) -> None:
    page.add_init_script("localStorage.setItem('language', 'fr')")
    late = say("camera.late", "frames come {ms:.0f} ms late: the network is slow", ms=300.0)
    told.message["status"]["cameras"]["left"].update(state="trouble", limited_by="network", reason=late)
    told.message["said"] = codes_of([late])
    page.goto(address)
    expect(page.locator("#connection")).to_have_text("Connecté")
    expect(page.locator("#preset")).to_be_visible()
    walk(told)
    expect(page.locator(".camera .words").first).to_have_text(
        "les images arrivent avec 300 ms de retard\u00a0: le réseau est lent"
    )
    (why,) = verdict(Facts(performer_height_m=2.41))[1]
    low = say("tpose.low", "{side} arm too low: hold it level", side=say("tpose.left", "left"))
    told.message["said"] += codes_of([why, low])
    told.calibration(
        {
            "state": "failed",
            "message": "",
            "cameras": {"right": {**VERDICT, "verdict": "refused", "reasons": [why]}},
        }
    )
    expect(page.locator("#wizard-big")).to_have_text("Refusé")
    expect(page.locator("#wizard-cards p")).to_have_text(
        "l'interprète mesurerait 2,41 mqu'un seul interprète marche, et vérifiez l'unité de la caméra (mètres)"
    )
    poor = {"state": "countdown", "seconds_left": 4.8, "problems": [low]}
    told.calibration({"state": "idle"}, tpose=poor)
    expect(page.locator("#wizard-small")).to_have_text("bras gauche trop bas\u00a0: tenez-le à l'horizontale")
