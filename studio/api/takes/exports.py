"""Routes of exports in the background: one solve or several, one file each, all in a ZIP, or together in one FBX;
a robot's motion, a prop, a camera's recorded depth.
"""

import itertools
import shutil
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse
from msgspec import Struct
from pydantic import BaseModel, Field

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.jobs import Job, Jobs, JobStatus
from studio.api.stage.stage import Request
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder
from studio.api.takes.rigs import find_rig
from studio.api.takes.takes import ExportRequest, Format, KeyOptions, PartOptions
from studio.engine.animation.export import EXPORTERS, one_performer_format
from studio.engine.base.errors import SettingsError
from studio.engine.robots.files import FOLDER as ROBOTS
from studio.engine.robots.files import find_robot, kept_robots
from studio.take.folder.names import inside, safe_name
from studio.take.library.exports.depth_export import choose_camera
from studio.take.library.exports.solve_export import SolveExport, check_scene, named_file
from studio.take.library.sessions import take_info
from studio.take.rigid_bodies.used import no_such_body, stage_bodies

FOLDER = ".exports"
MAX_ITEMS = 200
_KEPT = 20
"""Largest number of archives of several takes; older ones are deleted."""


class SolveOfTake(Request):
    """A solve of a take."""

    take: str = Field(description="the take's id, session/name", examples=["monday/take_001"])
    solve: str = Field(examples=["studio"])


class ExportFormat(BaseModel):
    """A format, and whether this server can write it."""

    format: str = Field(examples=["usd"])
    missing: str = Field(
        description='what it lacks, with the command that installs it; "" = it can be written'
    )


class ExportsRequest(ExportRequest):
    """Solves and options."""

    solves: list[SolveOfTake] = Field(min_length=1, max_length=MAX_ITEMS)


class DepthRequest(Request):
    """Take and camera."""

    take: str = Field(description="the take's id, session/name", examples=["monday/take_001"])
    camera: str | None = Field(
        None, max_length=100, description="may be left out where one camera alone has depth"
    )


class RobotExportRequest(SolveOfTake, PartOptions):
    """A kept robot, and how it follows the performers."""

    robot: str = Field(max_length=100, description="name of a kept robot", examples=["g1"])
    format: Literal["csv", "npz"] = "csv"
    performer: str | None = Field(None, description="of a take of several only this one; else each")
    balance: bool = Field(False, description="keep its centre of mass over its feet while they stand")
    keep_pose: bool = Field(
        False, description="do not give way in pose where torques are beyond their limits"
    )


class PropExportRequest(SolveOfTake, KeyOptions):
    """A rigid body of the take, as a skeleton of its own."""

    prop: str = Field(max_length=200, description="the body's name", examples=["sword"])
    format: Format


class OtherExports(Struct):
    """Other exports of a take's solves: kept robots that follow them, and rigid bodies of the take."""

    robots: list[str]
    props: list[str]


class Exports:
    """Files of exports, by the id of their job."""

    def __init__(self, sessions: Path) -> None:
        self._folder = sessions / FOLDER
        self._numbers = itertools.count(1)
        self._files: dict[str, Path] = {}
        self._lock = threading.Lock()

    def archive(self, name: str) -> Path:
        """Return a path for a file of several takes; the oldest ones are deleted."""
        with self._lock:
            self._folder.mkdir(parents=True, exist_ok=True)
            old = sorted(self._folder.glob("*/*"), key=lambda path: path.stat().st_mtime)
            for path in old[: max(0, len(old) - _KEPT + 1)]:
                shutil.rmtree(path.parent, ignore_errors=True)
            number = next(n for n in self._numbers if not (self._folder / str(n)).exists())
            folder = self._folder / str(number)
            folder.mkdir()
            return inside(folder, name)

    def keep(self, job_id: str, path: Path) -> None:
        """Store the file of a job."""
        with self._lock:
            self._files[job_id] = path

    def file(self, job_id: str) -> Path:
        """Return the file of a job.

        Raises:
            NotFoundError: no export has this id, it is not done yet, or its file is missing.
        """
        path = self._files.get(job_id)
        if path is None or not path.is_file():
            raise NotFoundError(
                "export.no_file",
                "there is no file of export {id!r}; GET /api/v1/jobs/{id} says how it goes",
                id=job_id,
            )
        return path


def exports_router(sessions: Path, finder: Finder, jobs: Jobs) -> APIRouter:
    """Return the routes of exports of the takes in `sessions`."""
    router = APIRouter(prefix="/api/v1/exports", tags=["takes"], responses=RESPONSES, route_class=StructRoute)
    exports = Exports(sessions)

    def item_of(one: SolveOfTake, request: ExportsRequest, rig: Path | None) -> SolveExport:
        take = finder.by_id(one.take)
        finder.solve(take, one.solve)
        return request.of(take, one.solve, rig)

    def making(job: Job, out: Path) -> JobStatus:
        """Keep the file that a job makes; return the job's state."""
        exports.keep(job.id, out)
        return job.status()

    @router.get("/formats")
    def formats() -> list[ExportFormat]:
        """The formats of exports, with the reason why one cannot be written on the server's machine."""
        return [ExportFormat(format=name, missing=one.missing) for name, one in EXPORTERS.items()]

    @router.get("/others")
    def others(take: str = Query(description="the take's id, session/name")) -> OtherExports:
        """Robots and rigid bodies that can be exported with a take's solves."""
        return OtherExports(kept_robots(sessions / ROBOTS), sorted(stage_bodies(finder.by_id(take)).tracks))

    @router.post("/robot", status_code=202)
    def make_robot(request: RobotExportRequest) -> JobStatus:
        """Write the motion of a kept robot that follows a solve; answers the job. Several performers make a ZIP."""
        take = finder.by_id(request.take)
        finder.solve(take, request.solve)
        find_robot(sessions / ROBOTS, request.robot)
        out = inside(
            take.path / "exports", f"{take.path.name}_{request.solve}_{request.robot}.{request.format}"
        )
        names = take.performer_names(request.solve)
        if request.performer is not None and names:
            take.performer_folder(request.solve, request.performer)  # reports an unknown name
            out = named_file(out, request.performer)
        archive = out.with_suffix(".zip") if request.performer is None and len(names) > 1 else None
        made = archive or out
        job = jobs.submit(
            "export", request.take, made.name, "studio.take.library.exports.robot_export:export_robot",
            take, request.solve, sessions / ROBOTS, request.robot, out, request.format, request.options(),
            balance=request.balance, give_way=not request.keep_pose, performer=request.performer, archive=archive,
        )  # fmt: skip
        return making(job, made)

    @router.post("/prop", status_code=202)
    def make_prop(request: PropExportRequest) -> JobStatus:
        """Write a rigid body of a take as a skeleton of its own, at the instants of a solve; answers the job."""
        take = finder.by_id(request.take)
        finder.solve(take, request.solve)
        if request.prop not in stage_bodies(take).tracks:
            raise no_such_body(take, request.prop)
        name = safe_name(request.prop, "prop")
        out = inside(take.path / "exports", f"{take.path.name}_{request.solve}_{name}.{request.format}")
        job = jobs.submit(
            "export", request.take, out.name, "studio.take.library.exports.prop_export:export_prop",
            take, request.solve, request.prop, out, request.format, request.options(),
        )  # fmt: skip
        return making(job, out)

    @router.post("", status_code=202)
    def make(request: ExportsRequest) -> JobStatus:
        """Export solves in the background; answers the job, whose `name` is the file's.

        One solve makes one file, several a ZIP of their files, or with `together` one file with all takes. Several
        performers make a file each, or with `together` one file.
        """
        rig = None if request.rig is None else find_rig(sessions, request.rig)
        items = [item_of(one, request, rig) for one in request.solves]
        if request.together:
            _check_together(items, request.format, rig)
        if len(items) == 1:
            out = request.file_of(items[0])
        else:
            ending = request.format if request.together else "zip"
            out = exports.archive(f"takes_{len(items)}.{ending}")
        job = jobs.submit(
            "export", request.solves[0].take, out.name, "studio.take.library.exports.solve_export:export_solves",
            items, out, request.format, rig, together=request.together,
        )  # fmt: skip
        return making(job, out)

    @router.post("/depth", status_code=202)
    def make_depth(request: DepthRequest) -> JobStatus:
        """Write a camera's recorded depth as an Azure Kinect recording (`.mkv`); answers the job."""
        take = finder.by_id(request.take)
        camera = choose_camera(take, take_info(take.path).depth, request.camera)
        out = inside(take.path / "exports", f"{take.path.name}_{camera}_depth.mkv")
        job = jobs.submit(
            "export", request.take, out.name, "studio.take.library.exports.depth_export:export_depth",
            take, out, camera,
        )  # fmt: skip
        return making(job, out)

    @router.get("/{job_id}", response_class=FileResponse)
    def download(job_id: str) -> FileResponse:
        """The file of an export that is done."""
        if jobs.get(job_id).state != "done":
            raise NotFoundError(
                "export.not_done",
                "export {id!r} is not done yet; GET /api/v1/jobs/{id} says how it goes",
                id=job_id,
            )
        path = exports.file(job_id)
        return FileResponse(path, filename=path.name, media_type="application/octet-stream")

    return router


def _check_together(items: Sequence[SolveExport], format: str, rig: Path | None) -> None:
    """Refuse solves that cannot be in one file, before the work begins.

    Raises:
        SettingsError: they cannot.
    """
    several = [len(one.take.performer_names(one.solve)) > 1 and one.performer is None for one in items]
    if any(several):
        check_scene(len(items), rig)
    exporter = EXPORTERS[format]
    if len(items) > 1 and not exporter.several:
        allowed = ", ".join(name for name, one in EXPORTERS.items() if one.several)
        raise SettingsError(
            "export.one_take_together",
            "together: a {format} holds one take; allowed: {allowed}",
            format=format,
            allowed=allowed,
        )
    if any(several) and exporter.scene is None:
        raise one_performer_format(format)
