"""Routes for operations: `/health` for process monitors, `/metrics` for Prometheus."""

from collections.abc import Iterator
from importlib import metadata
from typing import Any

from fastapi import APIRouter
from fastapi.responses import Response
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from pydantic import BaseModel

from studio.live import LiveStage
from studio.live.states import CameraStatus

HEALTH_PATH = "/health"

_CAMERA_GAUGES = {
    "connected": "whether the camera is connected (0 or 1)",
    "fps": "frames a second",
    "latency_ms": "median time from capture to arrival [ms]",
    "jitter_ms": "deviation of that time [ms]",
    "loss_percent": "frames that did not arrive [%]",
}
_CAMERA_COUNTERS = {
    "frames": "frames that arrived",
    "skipped": "frames that were recorded and not used live",
    "late": "frames that came after the link had been down",
    "errors": "messages that were refused",
}
_PIPELINE_GAUGES = {
    "rate_hz": "output frames a second",
    "step_ms_median": "median time of a step [ms]",
    "step_ms_p99": "99th percentile of that time [ms]",
}


class Health(BaseModel):
    """Whether the server works."""

    status: str
    version: str


class StageCollector(Collector):
    """Converts the stage's status to metrics on request."""

    def __init__(self, stage: LiveStage) -> None:
        self._stage = stage

    def collect(self) -> Iterator[Metric]:
        """Yield the present metrics, without unknown ones."""
        status = self._stage.status()
        cameras = status.cameras
        for key, words in _CAMERA_GAUGES.items():
            gauge = GaugeMetricFamily(f"studio_camera_{key}", words, labels=["camera"])
            _add(gauge, cameras, key)
            yield gauge
        for key, words in _CAMERA_COUNTERS.items():
            counter = CounterMetricFamily(f"studio_camera_{key}", words, labels=["camera"])
            _add(counter, cameras, key)
            yield counter
        for key, words in _PIPELINE_GAUGES.items():
            value = getattr(status.pipeline, key)
            if value is not None:
                yield GaugeMetricFamily(f"studio_pipeline_{key}", words, value=value)
        recording = status.recording
        yield GaugeMetricFamily(
            "studio_recording_active", "whether a take is recorded", value=recording.active
        )
        yield GaugeMetricFamily("studio_recording_seconds", "length so far [s]", value=recording.seconds)
        yield GaugeMetricFamily(
            "studio_disk_free_bytes", "room for takes", value=1e9 * recording.disk_free_gb
        )
        yield GaugeMetricFamily(
            "studio_pending_messages", "messages waiting for the engine", value=self._stage.pending()
        )
        yield CounterMetricFamily(
            "studio_refused_links", "camera links that were refused", value=status.refused_links.count
        )


def _add(family: Any, cameras: dict[str, CameraStatus], key: str) -> None:
    for name, camera in cameras.items():
        if (value := getattr(camera, key)) is not None:
            family.add_metric([name], float(value))


def operations_router(stage: LiveStage) -> APIRouter:
    """Return the routes; `/health` needs no signing in and only says that the server works."""
    router = APIRouter(tags=["operations"])
    registry = CollectorRegistry(auto_describe=False)
    registry.register(StageCollector(stage))

    @router.get(HEALTH_PATH)
    async def get_health() -> Health:
        """Answers while the server works."""
        return Health(status="ok", version=metadata.version("capture-studio"))

    @router.get("/metrics", response_class=Response)
    def get_metrics() -> Response:
        """Cameras, pipeline, recording and disk in Prometheus's format; needs the operator's token as bearer."""
        return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)

    return router
