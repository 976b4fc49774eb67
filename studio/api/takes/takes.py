"""Routes of the takes on disk: list, detail, solve again, export."""

from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import FileResponse
from msgspec import Struct, structs
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.jobs import Job, Jobs, JobStatus
from studio.api.stage.stage import Request as Body
from studio.api.stage.switches import from_request
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder, ListedTake
from studio.api.takes.rigs import find_rig
from studio.api.takes.thumbnails import Thumbnails
from studio.engine.animation.clip.options import ExportOptions
from studio.engine.base.errors import TakeError
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SettingsJson, SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.offline.so_far import SoFar
from studio.take.folder.meta import TakeMeta
from studio.take.folder.names import inside
from studio.take.folder.solves import read_metrics, read_settings
from studio.take.folder.take import Take
from studio.take.library.exports.solve_export import SolveExport, named_file
from studio.take.library.index import TakeIndex
from studio.take.library.presets import Presets
from studio.take.library.query import parse_query
from studio.take.library.sessions import new_take_path, session_of_today, take_info
from studio.take.timecode.facts import TakeTimecode, take_timecode
from studio.take.timecode.wish import TimecodeWish
from studio.worker import run_in_process


class SolveRequest(Body):
    """Options of a new solve of a take."""

    preset: str = "studio"
    set: dict[str, str | float] = Field(
        default_factory=dict, description="switches by key, as --set KEY=VALUE"
    )
    settings_of: str | None = Field(
        None, description="a solve of the take whose settings are used; preset and set are not"
    )
    name: str | None = Field(None, description="name of the solve; the preset's where left out")
    as_live: bool = Field(False, description="repeat the live stage bit for bit; preset and set are not used")
    edits: bool = Field(True, description="honour the edits of the take")
    draft: bool = Field(
        False,
        description="a preview of what is around the playhead where this take is replayed: shown there, without "
        "finishing and physics, and not kept",
    )


MOST_LISTED, MOST_OFFSET = 10_000, 1 << 31

Format = Literal["fbx", "bvh", "glb", "c3d", "trc", "csv", "npz", "usd", "otio"]


_OPTIONS = {field.name for field in fields(ExportOptions)}


class PartOptions(Body):
    """The part of a solve that is exported, its rate and its smoothing."""

    fps: float | None = Field(None, gt=0, le=1000, description="frame rate of the keys [Hz]")
    start_s: float | None = Field(None, ge=0, description="begin so far into the solve [s]")
    end_s: float | None = Field(None, gt=0, description="end so far into the solve [s]")
    smooth_hz: float | None = Field(None, gt=0, description="cutoff of a zero-phase low-pass [Hz]")

    def options(self) -> ExportOptions:
        """Return the options of the export."""
        return ExportOptions(**self.model_dump(include=_OPTIONS))


class KeyOptions(PartOptions):
    """Options of a file with keys as well."""

    interpolation: Literal["cubic", "linear", "constant"] = "cubic"
    rotation_order: Literal["ZXY", "ZYX", "YZX", "XZY", "YXZ", "XYZ"] = "ZXY"
    unit: Literal["mm", "cm", "m", "in"] = "cm"
    key_error_cm: float | None = Field(
        None, gt=0, le=100, description="leave out keys within this bound [cm]"
    )


class ExportRequest(KeyOptions):
    """A format and its options, as in `studio export`; options that the format does not understand are refused."""

    format: Format
    target: Literal["humanik", "mixamo", "unreal", "vrm"] = "humanik"
    root_motion: Literal["hips", "root", "in-place"] = "hips"
    mesh: bool | None = Field(None, description="with a skinned body")
    take_name: str | None = Field(None, description="name of the animation; the take's where left out")
    timecode: str | None = Field(
        None, max_length=20, description="of the first frame, hh:mm:ss:ff, or `take`: the take's own"
    )
    timecode_rate: str | None = Field(None, description="of `timecode`; the file's frame rate where left out")
    part_from: str | None = Field(None, max_length=20, description="begin at this timecode of the take")
    part_to: str | None = Field(None, max_length=20, description="end at this timecode of the take")
    loop: bool = False
    foot_lock: bool = False
    rig: str | None = Field(None, description="onto this rig (GET /api/v1/rigs) instead of a target")
    performer: str | None = Field(
        None, description="of a take of several only this one; else each in a file of their own"
    )
    together: bool = Field(
        False,
        description="all in one file, where the format holds several: the performers of one take (fbx, glb, usd), "
        "or takes of one performer (fbx)",
    )

    def of(self, take: Take, solve: str, rig: Path | None) -> SolveExport:
        """Return the export of a take's solve into the take's `exports/`."""
        values = self.model_dump(include=_OPTIONS)
        session, name = take.path.parent.name, take.path.name
        onto = "" if rig is None else f"_{rig.stem}"
        out = inside(take.path / "exports", f"{name}_{solve}{onto}.{self.format}")
        if self.performer is not None and take.performer_names(solve):
            take.performer_folder(solve, self.performer)
            out = named_file(out, self.performer)
        options = ExportOptions(**{**values, "timecode": None, "take_name": self.take_name or name})
        wish = TimecodeWish(self.timecode, self.timecode_rate, self.part_from, self.part_to)
        return SolveExport(take, solve, out, options, f"{session}/{out.name}", self.performer, wish)

    def file_of(self, one: SolveExport) -> Path:
        """Return the file that the export of one solve makes: its own, or an archive of its performers' files."""
        several = len(one.take.performer_names(one.solve)) > 1 and one.performer is None and not self.together
        return one.out.with_suffix(".zip") if several else one.out


class SolveDetail(Struct):
    """Settings and metrics of a solve as stored (docs/formats.md); null if the file is missing or damaged."""

    settings: SettingsJson | None
    metrics: SolveMetrics | None


class TakeDetail(ListedTake, kw_only=True):
    """A take: its line of the list, its `take.json` (docs/formats.md), its solves by name, and the timecode that came
    in while it was recorded; null where none did, or its file is damaged.
    """

    meta: TakeMeta
    solve_details: dict[str, SolveDetail]
    timecode: TakeTimecode | None = None


class Replayer(Protocol):
    """The player of takes, the app's `state.player`."""

    def part(self, take: str) -> tuple[float, float, str]:
        """Return the stage times around the playhead [s], and with several performers the one of the curves.

        Raises:
            SettingsError: this take is not replayed.
        """
        ...

    def playhead(self, take: str) -> tuple[float, str]:
        """Return the stage time at the playhead [s], and with several performers the one of the curves.

        Raises:
            SettingsError: this take is not replayed.
        """
        ...

    def grow(self, take: Take, solve: str, so_far: SoFar) -> None:
        """Take in the next part of a solve that is being made."""
        ...

    def grown(self, take: Take, solve: str) -> None:
        """Forget the beginning of a solve that has been made, or will not be."""

    def show_part(self, take: str, poses: Poses, performer: str) -> None:
        """Show these poses instead of those of the take's solve at their times."""


def takes_router(
    sessions: Path, finder: Finder, jobs: Jobs, presets: Presets, thumbnails: Thumbnails
) -> APIRouter:
    """Return the routes of the takes in `sessions`."""
    router = APIRouter(prefix="/api/v1", tags=["takes"], responses=RESPONSES, route_class=StructRoute)

    index = TakeIndex(sessions)

    @router.get("/takes")
    def get_takes(
        response: Response,
        search: Annotated[
            str, Query(description="words and fields, see docs/api.md", examples=["tag:best"])
        ] = "",
        limit: Annotated[int | None, Query(ge=0, le=MOST_LISTED, description="maximum number")] = None,
        id: Annotated[list[str], Query(description="only of these takes, session/name")] = [],  # noqa: B006
        offset: Annotated[int, Query(ge=0, le=MOST_OFFSET, description="left out at the beginning")] = 0,
    ) -> list[ListedTake]:
        """Takes, the newest first: all, or those that a search finds. The header `X-Total-Count` is the number found,
        whatever the limit. `X-Takes-Read: 3200/10000` means that only 3200 of 10000 takes have been read so far, the
        newest first, and that the answer lacks the others; request again then."""
        found = index.search(parse_query(search), only=id or None, limit=limit, offset=offset)
        thumbnails.want(found.takes)
        response.headers["X-Total-Count"] = str(found.count)
        if found.reading is not None:
            response.headers["X-Takes-Read"] = f"{found.reading.done}/{found.reading.of}"
        return [finder.line(info) for info in found.takes]

    @router.get("/takes/next")
    def get_next() -> dict[str, str]:
        """The session and name that the next take gets by default."""
        path = new_take_path(sessions, session_of_today())
        return {"session": path.parent.name, "name": path.name}

    @router.get("/takes/{session}/{take}")
    def get_take(session: str, take: str) -> TakeDetail:
        """A take: its line of the list, its `take.json`, and settings and metrics of its solves."""
        path = finder.path(session, take)
        opened = Take.open(path)
        detail = TakeDetail(
            **structs.asdict(finder.line(take_info(path))),
            meta=opened.meta,
            solve_details={name: _solve_detail(opened.solve_folder(name)) for name in opened.solve_names()},
            timecode=take_timecode(opened),
        )
        finder.path(session, take)  # it may have gone to the trash meanwhile
        return detail

    @router.post("/takes/{session}/{take}/solves", status_code=202)
    def solve(session: str, take: str, request: SolveRequest, http: Request) -> JobStatus:
        """Solve the take's raw frames again; returns the job. An older one of this name is stopped."""
        opened = finder.take(session, take)
        if request.settings_of is None:
            settings = from_request(presets, request.preset, request.set)
        else:
            finder.solve(opened, request.settings_of)
            settings = settings_of(opened, request.settings_of)
        name = request.name or ("as-live" if request.as_live else request.preset)
        opened.solve_folder(name)
        if not request.as_live:
            settings.camera_names(tuple(opened.calibration().cameras))
        id_ = f"{session}/{take}"
        if request.draft:
            player: Replayer = http.app.state.player
            start_s, end_s, performer = player.part(id_)
            jobs.replace(("draft", "solve"), id_, name)
            job = jobs.submit(
                "draft", id_, name, "studio.offline.preview:solve_part", opened, settings, start_s, end_s,
                performer=performer, then=lambda poses: player.show_part(id_, poses, performer),
            )  # fmt: skip
        else:
            jobs.replace(("solve",), id_, name)
            job = _solve_job(
                jobs, http.app.state.player, opened, settings, name,
                as_live=request.as_live, edits=None if request.edits else (),
            )  # fmt: skip
        return jobs.get(job.id)

    @router.get("/takes/{session}/{take}/solves/{solve}/export", response_class=FileResponse)
    def export_solve(
        session: str,
        take: str,
        solve: str,
        request: Annotated[ExportRequest, Query()],
    ) -> FileResponse:
        """Export a solve and download the file, which is stored in the take's `exports/`; a ZIP of the performers'
        files where there are several."""
        opened = finder.take(session, take)
        finder.solve(opened, solve)
        rig = None if request.rig is None else find_rig(sessions, request.rig)
        one = request.of(opened, solve, rig)
        out = request.file_of(one)
        run_in_process(
            "studio.take.library.exports.solve_export:export_solves", [one], out, request.format, rig,
            together=request.together,
        )  # fmt: skip
        return FileResponse(out, filename=out.name, media_type="application/octet-stream")

    @router.get("/jobs", tags=["jobs"])
    async def get_jobs() -> list[JobStatus]:
        """The jobs that wait and run, and those that ended within an hour, the oldest first."""
        return jobs.list()

    @router.get("/jobs/{job_id}", tags=["jobs"])
    async def get_job(job_id: str) -> JobStatus:
        """One job: `state` is waiting, running, cancelling, done, failed, cancelled, or replaced by a newer one that
        makes the same; `seconds` it runs or ran, `left_s` about how long it still takes."""
        return jobs.get(job_id)

    @router.post("/jobs/{job_id}/cancel", tags=["jobs"])
    def cancel_job(job_id: str) -> JobStatus:
        """Cancel a job that waits or runs; nothing half-written stays. Answers the job."""
        return jobs.cancel(job_id)

    @router.delete("/jobs", tags=["jobs"])
    def clear_jobs() -> dict[str, int]:
        """Remove the ended jobs from the list."""
        return {"cleared": jobs.clear()}

    return router


def _solve_job(
    jobs: Jobs, player: Replayer | None, take: Take, settings: SolveSettings, name: str, **options: Any
) -> Job:
    """Submit a solve, with `options` of `solve_take`; the player shows its beginning while it is being made."""
    id_ = f"{take.path.parent.name}/{take.path.name}"
    job = jobs.list_new("solve", id_, name)

    def part(so_far: SoFar) -> None:
        job.so_far_s, job.of_s = round(so_far.until_s, 2), round(so_far.of_s, 2)
        if player is not None:
            player.grow(take, name, so_far)

    def clear() -> None:
        job.so_far_s = job.of_s = None
        if player is not None:
            player.grown(take, name)

    return jobs.submit_listed(
        job, "studio.offline.replay:solve_take", take, settings,
        name=name, part=part, clear=clear, **options,
    )  # fmt: skip


def settings_of(take: Take, solve: str) -> SolveSettings:
    """Return the settings of a solve.

    Raises:
        TakeError: it has none, like an imported animation.
    """
    kept = read_settings(take.solve_folder(solve))
    if kept is None:
        raise TakeError(
            "take.no_settings",
            "solve {name!r} of {take} has no settings; choose a preset",
            name=solve,
            take=take.meta["id"],
        )
    return SolveSettings.from_json(kept)


def _solve_detail(folder: Path) -> SolveDetail:
    return SolveDetail(read_settings(folder), read_metrics(folder))
