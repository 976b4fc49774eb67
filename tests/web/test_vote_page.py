"""The voters' page in a real browser: join, look, choose, change, reload, finish; on a phone one above the other."""

import json
import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests import patient
from tests.live.performer import calibration
from tests.web.playback.takes import take_with_solves
from tests.web.stages import until
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser


@pytest.fixture
def address(tmp_path: Path):
    """Address of a studio with a take."""
    take = take_with_solves(tmp_path / "monday" / "one")
    take.add_calibration(calibration(["camera_0"]), use=True)
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def make_test(address: str, **rules: object) -> dict:
    side = {"take": "monday/one", "solve": "studio"}
    pair = {
        "a": {**side, "condition": "everything"},
        "b": {**side, "condition": "held", "key_hz": 8, "interpolation": "held"},
    }
    body = {"title": "Walks", "pairs": [pair, {**pair, "start_s": 0.5}], "rules": {"repeats": 0, **rules}}
    answer = patient.post(f"{address}/api/v1/blind", json=body, timeout=120.0)
    assert answer.status_code == 201, answer.text
    return answer.json()


def results(address: str, test: dict) -> dict:
    return patient.get(f"{address}/api/v1/blind/{test['id']}/results").json()


def test_a_voter_votes_changes_reloads_and_finishes(address: str, page: Page) -> None:
    test = make_test(address, allow_none=True, ask_name=True, body="slim")
    assert test["rules"]["body"] == "slim"
    received: list[str] = []
    page.on("response", lambda response: received.append(response.url + str(response.headers)))
    page.goto(address + test["path"])
    page.get_by_label("Name or code").fill("Ada")
    page.get_by_role("button", name="Begin").click()
    expect(page.locator("body")).to_have_attribute("data-ready", "0")
    expect(page.locator("#next")).to_be_disabled()
    page.get_by_role("button", name="B", exact=True).click()
    page.get_by_label("Comment").fill("steadier")
    page.get_by_role("button", name="A", exact=True).click()
    expect(page.locator("#kept")).to_have_text("Kept")
    page.get_by_role("button", name="Next").click()
    expect(page.locator("body")).to_have_attribute("data-ready", "1")
    page.reload()  # goes on where there is no vote yet
    expect(page.locator("#place")).to_have_text("2 of 2")
    page.get_by_role("button", name="Back").click()
    expect(page.locator("#left")).to_have_class("stage chosen")
    expect(page.get_by_label("Comment")).to_have_value("steadier")
    page.get_by_role("button", name="Next").click()
    page.get_by_role("button", name="No preference").click()
    page.get_by_role("button", name="Finish").click()
    expect(page.locator("main")).to_contain_text("Thank you")
    found = results(address, test)
    assert found["voters"] == found["finished"] == 1 and found["votes"] == 2
    assert found["comments"][0]["comment"] == "steadier" and found["comments"][0]["voter"] == "Ada"
    assert sum(pair["no_preference"] for pair in found["pairs"]) == 1
    assert not any(word in text for text in received for word in ("everything", "held", "monday"))


def test_both_play_in_step_turn_together_and_stack_on_a_phone(address: str, page: Page) -> None:
    test = make_test(address)
    page.goto(address + test["path"])
    page.get_by_role("button", name="Begin").click()
    expect(page.locator("body")).to_have_attribute("data-ready", "0")
    expect(page.locator("body")).to_have_attribute("data-drawn", re.compile(r"\d{2,}"))
    before = [page.locator(f"#{side} canvas").screenshot() for side in ("left", "right")]
    page.get_by_label("Play or pause").click()
    expect(page.locator("#play")).to_have_text("▶")
    box = page.locator("#left canvas").bounding_box()
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 260, box["y"] + 120, steps=4)
    page.mouse.up()
    for side, seen in zip(("left", "right"), before, strict=True):
        until(lambda side=side, seen=seen: page.locator(f"#{side} canvas").screenshot() != seen)
    page.set_viewport_size({"width": 390, "height": 844})
    until(lambda: page.evaluate("innerWidth") == 390)
    left, right = (page.locator(f"#{side}").bounding_box() for side in ("left", "right"))
    assert right["y"] >= left["y"] + left["height"] and left["width"] == right["width"] <= 390
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.evaluate("document.documentElement.scrollHeight") <= 844


def test_a_room_follows_the_operator(address: str, page: Page) -> None:
    test = make_test(address, supervised=True)
    page.goto(address + test["path"])
    page.get_by_role("button", name="Begin").click()
    expect(page.locator("main")).to_contain_text("Wait for the next pair")
    patient.put(f"{address}/api/v1/blind/{test['id']}/shown", json={"slot": 1})
    expect(page.locator("#place")).to_have_text("2 of 2")
    page.get_by_role("button", name="A", exact=True).click()
    expect(page.locator("#kept")).to_have_text("Kept")
    patient.post(f"{address}/api/v1/blind/{test['id']}/close")
    expect(page.locator("main")).to_contain_text("over")


def test_a_wrong_link_says_so(address: str, chromium) -> None:
    with chromium.new_context() as context:
        tab = context.new_page()
        tab.goto(f"{address}/vote/nothing")
        expect(tab.locator("main")).to_contain_text("leads to no test")


def test_a_test_from_compare_takes_the_range_between_in_and_out(address: str, page: Page) -> None:
    replay = f"{address}/api/v1/replay"
    shown = {"take": "monday/one", "solve": "studio", "ghost": {"solve": "live"}}
    patient.put(replay, json=shown, timeout=60.0).raise_for_status()
    patient.patch(replay, json={"first": 30, "last": 90}).raise_for_status()  # at 60 Hz
    page.add_init_script("sessionStorage.setItem('compare', 'open')")
    page.goto(address)
    page.goto(f"{address}/" + str(page.locator("a[href^='blind?']").get_attribute("href")))
    expect(page.locator("#a-solve")).to_have_value("monday/one|studio")
    expect(page.locator("#b-solve")).to_have_value("monday/one|live")
    expect(page.locator("#start")).to_have_value("0.5")
    expect(page.locator("#end")).to_have_value("1.5")
    page.get_by_role("button", name="Add this pair").click()
    page.get_by_role("button", name="Make the test").click()
    expect(page.locator("#results-title")).to_have_text("Results: Which settings?")
    (test,) = patient.get(f"{address}/api/v1/blind").json()["tests"]
    (pair,) = patient.get(f"{address}/api/v1/blind/{test['id']}").json()["pairs"]
    assert (pair["start_s"], pair["end_s"]) == (0.5, 1.5)


def test_the_operator_makes_a_test_and_sees_the_votes(address: str, page: Page, chromium) -> None:
    page.goto(f"{address}/blind")
    page.locator("#a-condition").fill("all keys")
    page.locator("#b-solve").select_option("monday/one|live")
    page.locator("#b-keys").select_option("held")
    page.locator("#b-condition").fill("held keys")
    page.get_by_role("button", name="Add this pair").click()
    page.get_by_role("button", name="Make the test").click()
    expect(page.locator("#results-title")).to_have_text("Results: Which settings?")
    link = page.locator(".test .link").inner_text()
    with chromium.new_context() as context:
        voter = context.new_page()
        voter.goto(link)
        voter.get_by_role("button", name="Begin").click()
        expect(voter.locator("body")).to_have_attribute("data-ready", "0")
        voter.get_by_role("button", name="A", exact=True).click()
        expect(voter.locator("#kept")).to_have_text("Kept")
    expect(page.locator("#results")).to_contain_text("1 voter, 1 finished")
    expect(page.locator(".result .bar")).to_be_visible()
    found = patient.get(
        f"{address}/api/v1/blind/{patient.get(f'{address}/api/v1/blind').json()['tests'][0]['id']}/results"
    ).json()["pairs"][0]
    first, second = (
        f"{100 * found[votes]} % of 1 vote for “{name}”"
        for votes, name in (("votes_a", "all keys"), ("votes_b", "held keys"))
    )
    expect(page.locator(".result")).to_contain_text(f"{first} (95 %:")
    expect(page.locator(".result .bar")).to_have_attribute("aria-label", f"{first}; {second}")
    expect(page.locator("#results")).to_contain_text(re.compile(r"(0|100) % of 1 vote for “the left side”"))
    page.get_by_role("button", name="Close", exact=True).click()
    expect(page.locator("#tests")).to_contain_text("closed")
    side = {"take": "monday/one", "solve": "studio"}
    file = {
        "title": "Of a file",
        "pairs": [{"a": {**side, "condition": "x"}, "b": {**side, "condition": "y", "key_hz": 5}}],
    }
    file["rules"] = {"repeats": 0}
    page.locator("#from-file").set_input_files(
        {"name": "t.json", "mimeType": "application/json", "buffer": json.dumps(file).encode()}
    )
    expect(page.locator("#results-title")).to_have_text("Results: Of a file")
