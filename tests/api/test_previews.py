"""Small depth images over the link: counted, served as a picture, used for the floor; unfit images are refused."""

import io

import numpy as np
import pytest
from PIL import Image

from studio import wire
from tests.api.camera import Camera, send_frames, wait_until
from tests.api.test_routes import codes

INTRINSICS = wire.Intrinsics(50.0, 50.0, 49.5, 44.5, 100, 90)


def depth(value: int) -> np.ndarray:
    image = np.zeros((90, 100), np.uint16)
    image[30:60, 40:80] = value
    return image


def test_the_newest_preview_is_served_as_a_picture(studio):
    route = "/cameras/camera_0/preview"
    with Camera(studio.url("link"), 0) as camera:
        camera.greet(intrinsics=INTRINSICS)
        send_frames([camera], 3)
        missing = studio.http.get(route)
        assert missing.status_code == 404 and codes(missing.json()["error"]) == ["camera.no_preview"]
        for value in (4000, 1000):
            camera.send(wire.preview_image(camera.clock_ns(), depth(value)))
        wait_until(lambda: studio.stage.status().cameras["camera_0"].previews == 2, "both came")
        answer = studio.http.get(route)
    assert answer.status_code == 200 and answer.headers["content-type"] == "image/png"
    picture = np.asarray(Image.open(io.BytesIO(answer.content)))
    assert picture.shape == (45, 50)
    assert picture[20, 30] > 200 and picture[0, 0] == 0


def test_previews_give_the_floor_views_of_a_calibration(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.greet(intrinsics=INTRINSICS)
        since_ns = studio.stage.clock_ns()
        for value in range(1000, 1030):
            camera.send(wire.preview_image(camera.clock_ns(), depth(value)))
        wait_until(lambda: studio.stage.previews.count("camera_0") == 30, "all came")
        views = studio.stage.previews.floor_views(since_ns)
        assert studio.stage.previews.floor_views(studio.stage.clock_ns()) == {}
    scaled, images = views["camera_0"]
    assert (scaled.width, scaled.height, scaled.fx, scaled.cx) == (50, 45, 25.0, 24.75)
    assert len(images) == 10 and images[-1][20, 30] > 1020


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda p: {"width": p.width + 1}, "is not every"),
        (lambda p: {"data": p.data[:-3]}, "unpacked"),
        (lambda p: {"step": 3}, "is not every"),
    ],
)
def test_a_preview_that_does_not_fit_ends_the_link(studio, wrong, said):
    good = wire.preview_image(5, depth(1000))
    values = {name: getattr(good, name) for name in good.__struct_fields__} | wrong(good)
    with Camera(studio.url("link"), 0) as camera:
        camera.greet(intrinsics=INTRINSICS)
        camera.send(wire.Preview(**values))
        assert said in camera.receive_kind(wire.Refused).reason


def test_a_camera_without_intrinsics_sends_no_previews(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        camera.send(wire.preview_image(5, depth(1000)))
        assert "intrinsics" in camera.receive_kind(wire.Refused).reason
