"""Import from the page: dropped or chosen, many at once, told and cancelled; what another program imports appears."""

import re
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from studio.take.folder.take import Take
from studio.take.importers import import_recording
from studio.take.library.incoming import PREFIX
from tests.take.sync_videos import claps, heard, write_film
from tests.take.video_files import real_pictures
from tests.web.browser import quiet_page
from tests.web.hits import covered
from tests.web.playback.takes import take_with_solves
from tests.web.servers import ThreadServer, thread_server
from tests.web.test_fresh_page import show_times

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ThreadServer]:
    """A server with a take that has solves."""
    sessions = tmp_path / "sessions"
    take_with_solves(sessions / "monday" / "one")
    with thread_server(sessions) as started:
        yield started


@pytest.fixture
def page(chromium: Browser, server: ThreadServer) -> Iterator[Page]:
    with quiet_page(chromium) as tab:
        tab.goto(server.url)
        expect(tab.locator("#preset")).to_be_visible()
        expect(tab.locator(".take")).to_have_count(1)
        yield tab


def drop(page: Page, selector: str, *files: Path) -> None:
    """Drop files or folders of this machine at the middle of an element, as a hand does."""
    box = page.locator(selector).first.bounding_box()
    assert box is not None
    session = page.context.new_cdp_session(page)
    where = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
    data = {"items": [], "files": [str(file) for file in files], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        session.send("Input.dispatchDragEvent", {"type": kind, **where, "data": data})
        if kind == "dragOver":
            expect(page.locator("#drop-veil")).to_be_visible()
    expect(page.locator("#drop-veil")).to_be_hidden()


def take(page: Page, name: str) -> str:
    return f".take:has(.name:text-is('{name}'))"


def left(server: ThreadServer) -> list[Path]:
    return [*server.sessions.glob(f"{PREFIX}*"), *server.sessions.rglob("*.partial-*")]


def test_what_is_dropped_chosen_or_imported_by_a_command_becomes_a_take(
    page: Page, chromium: Browser, server: ThreadServer, test_data: Path, tmp_path: Path
) -> None:
    dialog_is_reached_and_a_viewer_cannot_import(page, chromium, server)
    an_animation_dropped_on_a_take_is_its_reference(page, server, test_data)
    folders_files_and_a_take_are_dropped_over_the_view(page, server, test_data)
    import_recording(test_data / "mocap" / "02_01.bvh", server.sessions / "tuesday" / "walk")
    expect(page.locator(take(page, "walk"))).to_be_visible()
    from_the_page_to_an_exported_take_in_eight_clicks(page, test_data, tmp_path)


def dialog_is_reached_and_a_viewer_cannot_import(page: Page, chromium: Browser, server: ThreadServer) -> None:
    page.locator("#import-open").focus()
    page.keyboard.press("Enter")
    expect(page.locator("#import-choose-files")).to_be_focused()
    assert covered(page) == {}
    page.set_viewport_size({"width": 1280, "height": 720})
    page.keyboard.press("Escape")
    with quiet_page(chromium) as viewer:
        viewer.goto(f"{server.url}/?view")
        expect(viewer.locator(".take")).to_have_count(1)
        expect(viewer.locator("#import-open")).to_be_hidden()


def folders_files_and_a_take_are_dropped_over_the_view(
    page: Page, server: ThreadServer, test_data: Path
) -> None:
    bundle = server.sessions.parent / "sent.take.zip"
    bundle.write_bytes(server.http.get("/takes/monday/one/file").content)
    pair = next((test_data / "kinect2_pairs").glob("Study_16_Kinect_0*.csv"))
    drop(
        page,
        "#viewer",
        test_data / "noisy_joints" / "punches_2_cameras",
        test_data / "mocap" / "02_01.bvh",
        bundle,
        pair,
    )
    for name in ("punches_2_cameras", "02_01", "sent", pair.stem):
        expect(page.locator(take(page, name))).to_be_visible()
    page.locator("#work-button").click()
    expect(page.locator(".work-row.done")).to_have_count(4)
    page.locator(".work-row", has_text="02_01.bvh").get_by_role("button", name=re.compile("^Show")).click()
    expect(page.locator("#replay")).to_be_visible()
    page.locator("#work-close").click()
    page.locator(f"{take(page, 'punches_2_cameras')} .take-picture").click()
    expect(page.locator("#replay-value")).to_contain_text("raw skeletons of 2 cameras · not calibrated")
    assert server.http.get("/replay").json()["holds"]["skeletons"].keys() == {"camera_0", "camera_1"}
    assert covered(page) == {}
    page.set_viewport_size({"width": 1280, "height": 720})
    assert left(server) == []
    page.keyboard.press("Escape")
    expect(page.locator("#replay")).to_be_hidden()


def an_animation_dropped_on_a_take_is_its_reference(
    page: Page, server: ThreadServer, test_data: Path
) -> None:
    """No take more."""
    drop(page, take(page, "one"), test_data / "mocap" / "02_01.bvh")
    expect(page.locator("#messages")).to_contain_text("02_01.bvh is a reference of monday/one")
    assert server.http.get("/takes/monday/one/references").json() == ["02_01.bvh"]
    expect(page.locator(".take")).to_have_count(1)


def from_the_page_to_an_exported_take_in_eight_clicks(page: Page, test_data: Path, tmp_path: Path) -> None:
    recording = tmp_path / "mine"
    shutil.copytree(test_data / "noisy_joints" / "punches_2_cameras", recording)
    clicks, begun = 0, time.monotonic()

    def click(selector: str) -> None:
        nonlocal clicks
        clicks += 1
        page.locator(selector).click()

    click("#import-open")
    clicks += 1  # the button below, and what the system asks then is answered by Playwright
    with page.expect_file_chooser() as chooser:
        page.locator("#import-choose-folder").click()
    chooser.value.set_files(recording)
    mine = take(page, "mine")
    click(f"{mine} button:text-is('Calibrate')")
    click("dialog[open] button[type=submit]")
    click(f"{mine} button:text-is('Solve')")
    click(f"{mine} .solve-row button:text-is('Export')")
    with page.expect_download() as download:
        click("#export-run")
    assert download.value.suggested_filename.endswith(".fbx")
    written = Path(download.value.path()).read_bytes()
    assert written.startswith(b"Kaydara FBX Binary") and len(written) > 10_000
    assert clicks <= 8
    show_times(f"from the page to an FBX file by {clicks} clicks", time.monotonic() - begun)


def test_how_videos_are_brought_to_one_clock_is_chosen(
    page: Page, server: ThreadServer, test_data: Path, tmp_path: Path
) -> None:
    """Of two claps the one that is typed counts: without it they are not brought to one clock. The way that was asked
    for is used, and where it does not do this is told."""
    person = real_pictures(test_data / "rgb" / "pose2sim_single", "cam01", 2)
    folder = tmp_path / "claps"
    folder.mkdir()
    scene = claps(12.0, [3.0, 8.0])
    for name, start_s in (("a", 0.0), ("b", 1.5)):
        sound = heard(scene, start_s, 10.0, seed=ord(name), noise=0.0005)
        write_film(folder / f"{name}.mp4", 10.0, sound, pictures=person)
    page.locator("#import-open").click()
    page.locator("#import-clap").fill("3, b=1.4")
    with page.expect_file_chooser() as chooser:
        page.locator("#import-choose-folder").click()
    chooser.value.set_files(folder)
    expect(page.locator(take(page, "claps"))).to_be_visible()
    (clapped,) = (Take.open(path.parent).meta for path in server.sessions.rglob("claps*/take.json"))
    assert "clap" in clapped["notes"]
    page.locator("#import-open").click()
    page.locator("#import-clap").fill("")
    page.keyboard.press("Escape")
    folder = tmp_path / "shoot"
    folder.mkdir()
    for name in ("a", "b"):
        write_film(folder / f"{name}.mp4", 0.0, pictures=person)
    for way in ("clap", "none"):
        page.locator("#import-open").click()
        page.locator("#import-sync").select_option(way)
        with page.expect_file_chooser() as chooser:
            page.locator("#import-choose-folder").click()
        chooser.value.set_files(folder)
        if way == "clap":
            told = page.locator(
                "#messages .error", has_text="cannot be brought to one clock by clap: a has no sound"
            )
            expect(told).to_have_count(1)
    expect(page.locator(take(page, "shoot"))).to_be_visible()
    (meta,) = (Take.open(path.parent).meta for path in server.sessions.rglob("shoot*/take.json"))
    assert [camera.get("clock_within_s") for camera in meta["cameras"]] == [0.1, 0.1]


def test_what_goes_wrong_or_is_cancelled_is_told_and_leaves_nothing(
    chromium: Browser, server: ThreadServer, test_data: Path
) -> None:
    page = chromium.new_page(viewport={"width": 1280, "height": 720})
    page.goto(server.url)
    expect(page.locator("#preset")).to_be_visible()
    page.locator("#import-open").click()
    mkv = next((test_data / "sensor_files").glob("*.mkv"))
    files = [
        {"name": "cut.mkv", "mimeType": "", "buffer": mkv.read_bytes()[:3000]},
        {"name": "<img src=x>.bvh", "mimeType": "", "buffer": b"HIERARCHY"},
        {"name": "notes.txt", "mimeType": "", "buffer": b"hello"},
        {"name": "fine.bvh", "mimeType": "", "buffer": (test_data / "mocap" / "02_01.bvh").read_bytes()},
    ]
    page.locator("#import-files").set_input_files(files)
    errors = page.locator("#messages .error")
    expect(
        errors.filter(has_text="notes.txt is no recording that can be imported; allowed: a folder")
    ).to_have_count(1)
    expect(errors.filter(has_text="<img src=x>.bvh")).to_have_count(1)
    expect(errors.filter(has_text="cut.mkv")).to_have_count(1)
    expect(page.locator(take(page, "fine"))).to_be_visible()
    expect(page.locator(".take")).to_have_count(2)
    assert left(server) == []
    while errors.count():  # there may be other messages, too
        page.get_by_role("button", name="Dismiss").first.click()
    an_upload_is_cancelled_or_its_browser_goes(page, chromium, server)


def an_upload_is_cancelled_or_its_browser_goes(page: Page, chromium: Browser, server: ThreadServer) -> None:
    session = page.context.new_cdp_session(page)
    session.send("Network.enable")
    slow = {"offline": False, "latency": 0, "downloadThroughput": -1, "uploadThroughput": 400_000}
    session.send("Network.emulateNetworkConditions", slow)

    def send(name: str) -> None:
        page.evaluate(
            """(name) => {
              const transfer = new DataTransfer();
              transfer.items.add(new File([new Uint8Array(60e6)], name));
              for (const kind of ["dragenter", "dragover", "drop"]) {
                const options = { dataTransfer: transfer, bubbles: true, cancelable: true };
                document.body.dispatchEvent(new DragEvent(kind, options));
              }
            }""",
            name,
        )

    send("long.bvh")
    page.keyboard.press("w")
    expect(page.locator(".work-row.running .state")).to_contain_text("sending the files")
    page.locator(".work-row.running button").click()
    expect(page.locator(".work-row.cancelled")).to_have_count(1)
    expect(page.locator("#messages .error")).to_have_count(0)
    assert left(server) == []
    send("again.bvh")
    expect(page.locator(".work-row.running")).to_have_count(1)
    page.close(run_before_unload=False)
    with quiet_page(chromium) as other:
        other.goto(server.url)
        expect(other.locator("#preset")).to_be_visible()
        other.keyboard.press("w")
        expect(other.locator(".work-row.failed", has_text="send them again")).to_have_count(1)
        expect(other.locator(".take")).to_have_count(2)
    assert left(server) == []
