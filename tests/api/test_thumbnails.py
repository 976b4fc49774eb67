"""Pictures of takes: made in the background when the list is asked for, kept, and sent."""

import io
from collections.abc import Callable
from pathlib import Path

from PIL import Image

from studio.review.render.thumbnail import render_thumbnail, render_thumbnails
from tests.api.camera import wait_until
from tests.api.conftest import Studio
from tests.web.playback.takes import take_with_solves


def test_takes_with_solves_get_a_picture(start_studio: Callable[..., Studio], tmp_path: Path) -> None:
    take_with_solves(tmp_path / "monday" / "one", picture=False)
    broken = take_with_solves(tmp_path / "monday" / "two", picture=False)
    for name in broken.solve_names():
        (broken.solve_folder(name) / "poses.npz").write_bytes(b"no poses")
    http = start_studio(tmp_path).http
    assert http.get("/takes/monday/one/thumbnail").status_code == 404
    wait_until(lambda: any(take["thumbnail"] for take in http.get("/takes").json()), "a take has its picture")
    lines = {take["name"]: take["thumbnail"] for take in http.get("/takes").json()}
    assert lines == {"one": True, "two": False}
    answer = http.get("/takes/monday/one/thumbnail")
    picture = Image.open(io.BytesIO(answer.content))
    assert (answer.headers["content-type"], picture.size) == ("image/png", (128, 128))
    assert len(set(picture.convert("L").tobytes())) > 30  # a figure, not an empty floor
    assert http.get("/takes/monday/nobody/thumbnail").status_code == 404


def test_a_take_that_is_renamed_while_it_is_drawn_leaves_no_folder(tmp_path: Path, monkeypatch) -> None:
    take = take_with_solves(tmp_path / "monday" / "one", picture=False)
    picture = take.path / "exports" / "thumbnail.png"

    def draw(poses, path) -> None:
        render_thumbnail(poses, path)
        take.path.rename(tmp_path / "monday" / "best")

    monkeypatch.setattr("studio.review.render.thumbnail.render_thumbnail", draw)
    assert render_thumbnails([(take.solve_folder("studio"), picture)]) == []
    assert not take.path.exists()
