"""Health and metrics of a real server."""

from prometheus_client.parser import text_string_to_metric_families

from tests.api.camera import Camera, send_frames, wait_until


def metrics(studio) -> dict[tuple[str, str], float]:
    """Every sample by name and camera."""
    answer = studio.http.get(str(studio.http.base_url).replace("/api/v1/", "/metrics"))
    assert answer.status_code == 200 and answer.headers["content-type"].startswith("text/plain")
    families = text_string_to_metric_families(answer.text)
    return {(s.name, s.labels.get("camera", "")): s.value for family in families for s in family.samples}


def test_health(studio) -> None:
    answer = studio.http.get(str(studio.http.base_url).replace("/api/v1/", "/health"))
    assert answer.json()["status"] == "ok"


def test_metrics_of_cameras_recording_and_disk(studio) -> None:
    assert metrics(studio)[("studio_recording_active", "")] == 0.0
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        camera.exchange_clocks()
        send_frames([camera], 20)
        wait_until(
            lambda: metrics(studio).get(("studio_camera_frames_total", "camera_0")) == 20,
            "frames are counted",
        )
        found = metrics(studio)
        assert found[("studio_camera_connected", "camera_0")] == 1.0
        assert found[("studio_disk_free_bytes", "")] > 1e6
