"""Routes of the takes on disk: list, detail, solve again, export."""

from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

from fastapi import APIRouter, Query, Request
from fastapi.responses import FileResponse
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.find import Finder
from studio.api.jobs import Jobs
from studio.api.rigs import find_rig
from studio.api.stage import Request as Body
from studio.api.switches import from_request
from studio.api.thumbnails import Thumbnails
from studio.api.work import draft_work, export_work, solve_work
from studio.engine.export.options import ExportOptions
from studio.engine.poses import Poses
from studio.take.names import inside
from studio.take.presets import Presets
from studio.take.sessions import list_takes, take_info
from studio.take.solves import read_metrics, read_settings
from studio.take.take import Take
from studio.worker import run_in_process


class SolveRequest(Body):
    """How a take is solved again."""

    preset: str = "studio"
    set: dict[str, str | float] = Field(
        default_factory=dict, description="switches by key, as --set KEY=VALUE"
    )
    name: str | None = Field(None, description="name of the solve; the preset's where left out")
    as_live: bool = Field(False, description="repeat the live stage bit for bit; preset and set are not used")
    draft: bool = Field(
        False,
        description="a first look at what is around the playhead where this take is replayed: shown there, without "
        "finishing and physics, and not kept",
    )


Format = Literal["fbx", "bvh", "glb", "c3d", "trc", "csv", "npz", "usd"]


class ExportRequest(Body):
    """A format and its options, as `studio export` has them; what a format does not understand is refused."""

    format: Format
    fps: float | None = Field(None, gt=0, le=1000, description="frame rate of the keys [Hz]")
    interpolation: Literal["cubic", "linear", "constant"] = "cubic"
    target: Literal["humanik", "mixamo", "unreal", "vrm"] = "humanik"
    root_motion: Literal["hips", "root", "in-place"] = "hips"
    mesh: bool | None = Field(None, description="with a skinned body")
    start_s: float | None = Field(None, ge=0, description="begin so far into the solve [s]")
    end_s: float | None = Field(None, gt=0, description="end so far into the solve [s]")
    rotation_order: Literal["ZXY", "ZYX", "YZX", "XZY", "YXZ", "XYZ"] = "ZXY"
    unit: Literal["mm", "cm", "m", "in"] = "cm"
    key_error_cm: float | None = Field(
        None, gt=0, le=100, description="leave out keys within this bound [cm]"
    )
    take_name: str | None = Field(None, description="name of the animation; the take's where left out")
    timecode: str | None = Field(None, description="keys begin at this time of day, hh:mm:ss:ff")
    smooth_hz: float | None = Field(None, gt=0, description="cutoff of a zero-phase low-pass [Hz]")
    loop: bool = False
    foot_lock: bool = False
    rig: str | None = Field(None, description="onto this rig (GET /api/v1/rigs) instead of a target")

    def options(self, take: str) -> ExportOptions:
        """Return the options of an export of this take."""
        values = self.model_dump(include=set(ExportRequest.model_fields) - {"format", "rig"})
        return ExportOptions(**{**values, "take_name": self.take_name or take})


class Replayer(Protocol):
    """What replays takes, as the app's `state.player`."""

    def part(self, take: str) -> tuple[float, float]:
        """Return the stage times around the playhead [s].

        Raises:
            SettingsError: this take is not replayed.
        """

    def show_part(self, take: str, poses: Poses) -> None:
        """Show these poses instead of those of the take's solve at their times."""


def takes_router(
    sessions: Path, finder: Finder, jobs: Jobs, presets: Presets, thumbnails: Thumbnails
) -> APIRouter:
    """Return the routes of the takes in `sessions`."""
    router = APIRouter(prefix="/api/v1", tags=["takes"], responses=RESPONSES)

    @router.get("/takes")
    def get_takes() -> list[dict[str, Any]]:
        """All takes, the newest first."""
        takes = list_takes(sessions)
        thumbnails.want(takes)
        infos = [finder.line(info) for info in takes]
        return sorted(infos, key=lambda info: (info["created"], info["id"]), reverse=True)

    @router.get("/takes/{session}/{take}")
    def get_take(session: str, take: str) -> dict[str, Any]:
        """A take: its line of the list, its `take.json`, and settings and metrics of its solves."""
        path = finder.path(session, take)
        opened = Take.open(path)
        solves = {name: _solve_detail(opened.solve_folder(name)) for name in opened.solve_names()}
        return {**finder.line(take_info(path)), "meta": opened.meta, "solve_details": solves}

    @router.post("/takes/{session}/{take}/solves", status_code=202)
    def solve(session: str, take: str, request: SolveRequest, http: Request) -> dict[str, Any]:
        """Solve the take's raw frames again; returns the job. An older one of this name is stopped."""
        opened = finder.take(session, take)
        settings = from_request(presets, request.preset, request.set)
        name = request.name or ("as-live" if request.as_live else request.preset)
        opened.solve_folder(name)
        if not request.as_live:
            settings.camera_names(tuple(opened.calibration().cameras))
        id_ = f"{session}/{take}"
        if request.draft:
            player: Replayer = http.app.state.player
            start_s, end_s = player.part(id_)
            jobs.replace(("draft", "solve"), id_, name)
            work = (opened.path, settings.to_json(), start_s, end_s)
            job = jobs.submit(
                "draft", id_, name, draft_work, *work, then=lambda poses: player.show_part(id_, poses)
            )
        else:
            jobs.replace(("solve",), id_, name)
            args = (opened.path, settings.to_json(), name, request.as_live)
            job = jobs.submit("solve", id_, name, solve_work, *args)
        return jobs.get(job.id)

    @router.get("/takes/{session}/{take}/solves/{solve}/export", response_class=FileResponse)
    def export_solve(
        session: str,
        take: str,
        solve: str,
        request: Annotated[ExportRequest, Query()],
    ) -> FileResponse:
        """Export a solve and download the file, which is kept in the take's `exports/`."""
        opened = finder.take(session, take)
        poses = finder.solve(opened, solve)
        rig = None if request.rig is None else find_rig(sessions, request.rig)
        onto = "" if rig is None else f"_{rig.stem}"
        out = inside(opened.path / "exports", f"{take}_{solve}{onto}.{request.format}")
        run_in_process(export_work, poses, out, request.format, request.options(take), rig)
        return FileResponse(out, filename=out.name, media_type="application/octet-stream")

    @router.get("/jobs", tags=["jobs"])
    async def get_jobs() -> list[dict[str, Any]]:
        """The last jobs, the oldest first."""
        return jobs.list()

    @router.get("/jobs/{job_id}", tags=["jobs"])
    async def get_job(job_id: str) -> dict[str, Any]:
        """One job: `state` is waiting, running, done, failed, or replaced by a newer one that makes the same."""
        return jobs.get(job_id)

    return router


def _solve_detail(folder: Path) -> dict[str, Any]:
    """`settings` and `metrics` of a solve; null where the file is missing or broken."""
    return {"settings": read_settings(folder), "metrics": read_metrics(folder)}
