"""Voting over real HTTP: many voters with dropped connections, what a browser receives, and what it must not."""

import random
import threading
import time
from collections import Counter
from pathlib import Path

import httpx
import numpy as np
import pytest

from studio.api.access import Access
from studio.take.folder.take import Take
from tests import patient
from tests.live.performer import calibration
from tests.web.playback.takes import take_with_solves


@pytest.fixture
def take(studio) -> Take:
    """The take monday/one with the solves `studio` and `live`, and a performer."""
    made = take_with_solves(studio.sessions / "monday" / "one")
    made.add_calibration(calibration(["camera_0"]), use=True)
    return made


def pair(**changes: object) -> dict:
    side = {"take": "monday/one", "solve": "studio"}
    return {
        "a": {**side, "condition": "linear"},
        "b": {**side, "condition": "held", "key_hz": 10, "interpolation": "held"},
        **changes,
    }


def make_test(studio, pairs: int = 1, **rules: object) -> dict:
    body = {
        "title": "Walks",
        "pairs": [pair(start_s=0.1 * i) for i in range(pairs)],
        "rules": {"repeats": 0, **rules},
    }
    answer = studio.http.post("/blind", json=body)
    assert answer.status_code == 201, answer.text
    return answer.json()


class Browser:
    """A voter's browser that loses its connection now and then."""

    def __init__(self, port: int, token: str, seed: int) -> None:
        self.root = f"http://127.0.0.1:{port}/api/v1/vote/{token}"
        self.random = random.Random(seed)
        self.http = patient.Client(timeout=120.0)
        self.voter = ""

    def ask(self, method: str, path: str, **options: object) -> httpx.Response:
        if self.random.random() < 0.2:  # the connection drops: what was sent may have arrived
            try:
                self.http.request(
                    method, self.root + path, headers={"X-Voter": self.voter}, timeout=0.001, **options
                )
            except httpx.HTTPError:
                self.http.close()
                self.http = patient.Client(timeout=120.0)
        return self.http.request(method, self.root + path, headers={"X-Voter": self.voter}, **options)

    def vote_on_all(self) -> None:
        self.voter = self.http.post(self.root + "/join", json={}).json()["voter"]
        while (slot := self.ask("GET", "").json()["next"]) is not None:  # as after a reload
            choice = self.random.choice(["left", "right"])
            assert self.ask("PUT", f"/{slot}", json={"choice": choice, "watched_s": 3.0}).status_code == 200
        self.http.close()


@pytest.mark.parametrize("voters", [16, pytest.param(66, marks=pytest.mark.long)])
def test_many_voters_lose_no_vote(studio, take, voters: int) -> None:
    test = make_test(studio, pairs=6, repeats=2)
    browsers = [Browser(studio.port, test["token"], seed) for seed in range(voters)]
    threads = [threading.Thread(target=browser.vote_on_all) for browser in browsers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    found = studio.http.get(f"/blind/{test['id']}/results").json()
    finished, votes = found["finished"], found["votes"]
    assert finished == voters and votes == voters * 8
    rows = [row.split(",") for row in studio.http.get(f"/blind/{test['id']}/votes.csv").text.splitlines()[1:]]
    assert len(rows) == len({(row[0], row[2], row[3]) for row in rows}) == votes


def test_what_reaches_a_browser_says_nothing(studio, take) -> None:
    """A classifier on everything that 100 sessions receive, except the values of keys, is no better than chance."""
    test = make_test(studio, pairs=3)
    folder = studio.sessions / "blind" / test["id"] / "animations"
    on_disk = {path.read_bytes(): path.stem[-1] for path in folder.iterdir()}
    features, labels = [], []
    for _ in range(100):
        key = studio.http.post(f"/vote/{test['token']}/join", json={}).json()["voter"]
        headers = {"X-Voter": key}
        for slot in range(3):
            for side in ("left", "right"):
                answer = studio.http.get(f"/vote/{test['token']}/{slot}/{side}", headers=headers)
                told = {name: value for name, value in answer.headers.items() if name != "date"}
                features.append(
                    [
                        len(answer.content),
                        side == "left",
                        slot,
                        len(told),
                        hash(str(sorted(told.items()))) % 997,
                    ]
                )
                labels.append(on_disk[answer.content] == "a")
    x = np.array(features, dtype=float)
    from sklearn.linear_model import (
        LogisticRegression,
    )  # a second to load, which all processes of tests would take
    from sklearn.model_selection import cross_val_score

    scores = cross_val_score(
        LogisticRegression(), (x - x.mean(axis=0)) / (x.std(axis=0) + 1e-9), labels, cv=5
    )
    left, right = x[0::2], x[1::2]
    assert (left[:, [0, 3, 4]] == right[:, [0, 3, 4]]).all()
    half_width = 1.96 * 0.5 / np.sqrt(len(labels))
    assert (
        scores.mean() <= 0.5 + half_width
    )  # sides are balanced, so that guessing may well do worse than chance
    assert abs(np.mean(np.array(labels)[x[:, 1] == 1]) - 0.5) <= 0.05


def test_a_voter_sees_the_test_and_nothing_else(studio, take) -> None:
    test = make_test(studio)
    key = studio.http.post(f"/vote/{test['token']}/join", json={}).json()["voter"]
    seen = studio.http.get(f"/vote/{test['token']}", headers={"X-Voter": key}).json()
    text = str(seen)
    assert "linear" not in text and "held" not in text and "monday" not in text and "seed" not in text
    assert set(seen) == {
        "title", "question", "pairs", "allow_none", "ask_name", "supervised", "shown", "open", "votes", "next",
    }  # fmt: skip
    for path in ("wrong", f"{test['token']}x", "..%2f..%2fblind"):
        assert studio.http.get(f"/vote/{path}").status_code in (404, 422)
    assert studio.http.get(f"/vote/{test['token']}/0/left").status_code == 422  # without having joined
    assert studio.http.get(f"/vote/{test['token']}/0/left", headers={"X-Voter": "x"}).status_code == 404
    assert studio.http.get(f"/vote/{test['token']}/0/key", headers={"X-Voter": key}).status_code == 404
    assert studio.http.get(f"/vote/{test['token']}/77/left", headers={"X-Voter": key}).status_code == 404


def test_the_link_as_a_code_for_phones(studio, take) -> None:
    test = make_test(studio)
    answer = studio.http.get(f"/blind/{test['id']}/qr")
    assert answer.headers["content-type"] == "image/svg+xml" and b"<svg" in answer.content
    studio.http.delete(f"/blind/{test['id']}/link")
    assert studio.http.get(f"/blind/{test['id']}/qr").status_code == 422


def test_closed_full_and_too_many(studio, take) -> None:
    closed, test = make_test(studio), make_test(studio, max_voters=1)
    root = f"/vote/{closed['token']}"
    headers = {"X-Voter": studio.http.post(f"{root}/join", json={}).json()["voter"]}
    studio.http.post(f"/blind/{closed['id']}/close")
    assert studio.http.put(f"{root}/0", json={"choice": "left"}, headers=headers).status_code == 410
    root = f"/vote/{test['token']}"
    headers = {"X-Voter": studio.http.post(f"{root}/join", json={}).json()["voter"]}
    assert studio.http.post(f"{root}/join", json={}).status_code == 410
    answers = Counter(
        studio.http.put(f"{root}/0", json={"choice": "left"}, headers=headers).status_code for _ in range(80)
    )
    assert answers[429] > 0 and set(answers) == {200, 429}


def test_solves_that_change_or_go_do_not_touch_a_test(studio, take) -> None:
    test = make_test(studio)
    for name in ("studio", "live"):
        for path in take.solve_folder(name).iterdir():
            path.unlink()
    key = studio.http.post(f"/vote/{test['token']}/join", json={}).json()["voter"]
    answer = studio.http.get(f"/vote/{test['token']}/0/left", headers={"X-Voter": key})
    assert answer.status_code == 200 and answer.content.startswith(b"glTF")
    assert studio.http.get(f"/blind/{test['id']}/key").json()["seal_holds"]


def test_comments_are_kept_as_they_are_and_told_to_the_operator_only(studio, take) -> None:
    test = make_test(studio, ask_name=True)
    key = studio.http.post(f"/vote/{test['token']}/join", json={"name": "Zoë <b>"}).json()["voter"]
    comment = "<script>alert(1)</script>"
    studio.http.put(
        f"/vote/{test['token']}/0", json={"choice": "left", "comment": comment}, headers={"X-Voter": key}
    )
    found = studio.http.get(f"/blind/{test['id']}/results").json()["comments"]
    assert [(one["voter"], one["comment"]) for one in found] == [("Zoë <b>", comment)]
    assert found[0]["chosen"] in ("linear", "held")


def test_wrong_tests_are_refused(studio, take) -> None:
    for pairs in (
        [],
        [pair(start_s=50)],
        [{**pair(), "b": {"condition": "x", "take": "monday/one", "solve": "none"}}],
    ):
        answer = studio.http.post("/blind", json={"title": "t", "pairs": pairs, "rules": {"repeats": 0}})
        assert answer.status_code in (404, 422), answer.text
    assert studio.http.get("/blind").json()["tests"] == []


def test_a_test_goes_on_after_a_restart(studio, take, start_studio) -> None:
    test = make_test(studio, pairs=4)
    key = studio.http.post(f"/vote/{test['token']}/join", json={}).json()["voter"]
    studio.http.put(f"/vote/{test['token']}/3", json={"choice": "right"}, headers={"X-Voter": key})
    again = start_studio(Path(studio.sessions))
    seen = again.http.get(f"/vote/{test['token']}", headers={"X-Voter": key}).json()
    assert seen["votes"] == {"3": {"choice": "right", "comment": ""}} and seen["next"] == 0


def test_on_a_studio_that_asks_for_signing_in_a_link_opens_the_test_and_nothing_else(
    start_studio, tmp_path
) -> None:
    sessions = tmp_path / "sessions"
    access = Access(sessions, required=True, now_s=time.monotonic)
    studio = start_studio(sessions, access=access)
    made = take_with_solves(sessions / "monday" / "one")
    made.add_calibration(calibration(["camera_0"]), use=True)
    signed_in = {"Authorization": f"Bearer {access.operator_token}"}
    body = {"title": "Walks", "pairs": [pair()], "rules": {"repeats": 0}}
    test = studio.http.post("/blind", json=body, headers=signed_in).json()
    voter = studio.http.post(f"/vote/{test['token']}/join", json={}).json()["voter"]
    for side in ("left", "right"):
        answer = studio.http.get(f"/vote/{test['token']}/0/{side}", headers={"X-Voter": voter})
        assert answer.content.startswith(b"glTF")
    root = str(studio.http.base_url).removesuffix("/api/v1/")
    private = [
        "/api/v1/blind",
        f"/api/v1/blind/{test['id']}/results",
        "/api/v1/takes",
        "/api/v1/status",
        "/metrics",
    ]
    detours = ["/api/v1/vote/../blind", "/vote/../api/v1/takes", "/api/v1/vote/%2e%2e/blind"]
    for path in private + detours:
        assert studio.http.get(root + path, headers={"X-Voter": voter}).status_code in (401, 404), path
