"""A solve under way is replayed as far as it has come; then the whole solve, or what the cameras saw, replaces it."""

import json
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from studio.engine.animation.clip.resample import frames_of
from studio.engine.model.poses import Poses
from studio.offline.so_far import SoFar
from studio.simulator.body.performers import TUNING
from studio.take.folder.take import Take
from studio.web.playback.clip import Clip
from studio.web.playback.player import Player
from tests.acceptance.processes import wait_until
from tests.engine.seeing.cameras.given_cameras import watched
from tests.engine.seeing.cameras.hands_at_body import short_washing
from tests.offline.depth_takes import depth_take
from tests.take.helpers import recorded_take
from tests.web.browser import quiet_page
from tests.web.playback.takes import FRAMES, take_with_solves
from tests.web.playback.test_player import Screen
from tests.web.servers import ThreadServer, thread_server
from tests.web.test_hits import works_held

SECONDS = 4.3
HZ = 5.0
"""Frame rate of the cameras [Hz]: a sixth of a real one's saves time."""


@pytest.fixture
def player() -> Iterator[Player]:
    with closing(Player(Screen())) as made:
        yield made


def part_of(poses: Poses, begin: int, end: int, *, begins: bool) -> SoFar:
    return SoFar(frames_of(poses, slice(begin, end)), begins, (end - 1) / 60.0, 7.4)


def open_growing(player: Player, take: str) -> None:
    clip = player.growing.find(take, "new")
    assert clip is not None
    player.open(clip)


def test_a_growing_solve_is_opened_grows_and_gives_way(tmp_path: Path, player: Player) -> None:
    take = take_with_solves(tmp_path / "monday" / "one")
    poses = Clip.load(take, "studio").poses
    player.grow(take, "new", part_of(poses, 0, 30, begins=True))
    assert not player.status().open and player.growing.find("monday/one", "new") is not None
    open_growing(player, "monday/one")
    player.change(frame=20)
    player.grow(take, "new", part_of(poses, 30, 60, begins=False))
    status = player.status()
    assert (status.frames, status.frame, status.of_s, status.last) == (60, 20, 7.4, 59)
    player.grow(take, "new", part_of(poses, 0, 40, begins=True))  # tracked anew, with cameras refined
    assert player.status().frames == 40
    (take.path / "solves" / "studio").rename(take.path / "solves" / "new")
    player.grown(take, "new")
    status = player.status()
    assert (status.solve, status.frames, status.frame, status.of_s) == ("new", FRAMES, 20, None)
    assert player.growing.find("monday/one", "new") is None


def test_what_was_not_made_gives_way_to_what_the_cameras_saw(tmp_path: Path, player: Player) -> None:
    solved = take_with_solves(tmp_path / "monday" / "one")
    poses = Clip.load(solved, "studio").poses
    take = recorded_take(tmp_path / "monday" / "two", ["camera_0"], 30)
    player.open(Clip.load(solved, "studio"))
    player.grow(take, "new", part_of(poses, 0, 30, begins=True))
    player.grown(take, "new")
    assert player.status().take == "monday/one"  # another take stays as it is shown
    player.grow(take, "new", part_of(poses, 0, 30, begins=True))
    open_growing(player, "monday/two")
    player.grown(take, "new")
    status = player.status()
    assert (status.take, status.solve, status.of_s) == ("monday/two", "", None) and status.holds
    player.grow(
        take, "new", part_of(poses, 0, 30, begins=True)
    )  # where nothing was shown but the cameras, it comes
    assert player.status().solve == "new"


@pytest.fixture(scope="module")
def scene():
    return watched(TUNING[0], short_washing(TUNING[0]), seconds=SECONDS, hz=HZ)


@pytest.fixture
def server(scene, tmp_path: Path) -> Iterator[ThreadServer]:
    """A server with a take of depth alone."""
    sessions = tmp_path / "sessions"
    depth_take(sessions / "monday" / "depth", scene)
    with thread_server(sessions) as started:
        yield started


def job_of(server: ThreadServer, name: str) -> dict:
    (job,) = [one for one in server.http.get("/jobs").json() if one["id"] == name]
    return job


def solve_state(server: ThreadServer) -> str:
    """Of the solve that was not cancelled."""
    (state,) = [
        one["state"]
        for one in server.http.get("/jobs").json()
        if one["kind"] == "solve" and one["state"] != "cancelled"
    ]
    return state


def note_words(page: Page) -> None:
    """Have the page note all that it says of a growing solve."""
    page.evaluate(
        """() => { window.said = []; new MutationObserver(() => {
          for (const id of ["#replay-growing", ".so-far"]) {
            const words = document.querySelector(id)?.textContent;
            if (words && !window.said.includes(words)) window.said.push(words);
          }}).observe(document.body, { childList: true, subtree: true, characterData: true }); }"""
    )


@pytest.mark.browser
@pytest.mark.timeout(1200)
def test_a_cancelled_solve_leaves_nothing_and_the_page_shows_the_first_seconds_and_then_the_solve(
    chromium: Browser, server: ThreadServer
) -> None:
    a_cancelled_solve_leaves_nothing_of_its_beginning(server)
    the_page_shows_the_first_seconds_and_then_the_solve(chromium, server)


def a_cancelled_solve_leaves_nothing_of_its_beginning(server: ThreadServer) -> None:
    take = Take.open(server.sessions / "monday" / "depth")
    server.http.put("/replay", json={"take": "monday/depth", "solve": ""}).raise_for_status()
    job = server.http.post("/takes/monday/depth/solves", json={"preset": "studio"}).raise_for_status().json()
    wait_until(lambda: job_of(server, job["id"])["so_far_s"], "the first seconds are there", 900)
    with works_held():
        status = server.http.get("/replay").json()
        assert status["solve"] == "studio" and status["of_s"] > status["frames"] / status["rate_hz"] - 0.1
        server.http.post(f"/jobs/{job['id']}/cancel").raise_for_status()
    wait_until(lambda: job_of(server, job["id"])["state"] == "cancelled", "the solve is cancelled", 300)
    status = server.http.get("/replay").json()
    assert status["solve"] == "" and status["of_s"] is None and job_of(server, job["id"])["so_far_s"] is None
    assert not list((take.path / "solves").iterdir()) and not (take.path / "tracked").exists()
    again = server.http.put("/replay", json={"take": "monday/depth", "solve": "studio"})
    assert again.status_code == 404 and "no solve" in json.dumps(again.json())


def the_page_shows_the_first_seconds_and_then_the_solve(chromium: Browser, server: ThreadServer) -> None:
    with quiet_page(chromium) as page:
        page.goto(server.url)
        page.get_by_role("button", name="Open depth").click()
        expect(page.locator("#replay-title")).to_contain_text("depth")
        note_words(page)
        page.locator("#open-take").get_by_role("button", name="Solve depth").click()
        wait_until(
            lambda: page.evaluate("window.said.length > 0"), "the page tells of the first seconds", 900
        )
        wait_until(lambda: solve_state(server) == "done", "the solve is made", 900)
        expect(page.locator("#replay-growing")).to_have_count(0, timeout=60_000)
        expect(page.locator("#replay-solve")).to_have_value("studio", timeout=60_000)
        said = page.evaluate("window.said")
        assert any(words.startswith("So far 2.0 of 4.") for words in said), said
        assert any("so far 2.0 of 4." in words for words in said if words.startswith("▶")), said
    status = server.http.get("/replay").json()
    assert status["solve"] == "studio" and status["of_s"] is None
