"""One take's job of a batch: solve, export or evaluate it, unless that was done before.

A note stores the input and a stamp of each result. No solve waits for the disk. If the machine fails, an incomplete
result does not match its stamp and is made again.
"""

import hashlib
import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from msgspec import Struct

from studio.engine.base.errors import StudioError

Kind = Literal["solve", "export", "evaluate"]
NOTES = ".batch"


@dataclass(frozen=True)
class BatchJob:
    """One job on a take.

    Attributes:
        kind: of the work.
        take: folder of the take.
        options: of the work: `settings` and `name` of a solve; `solve`, `format`, `out` and `options` of an export;
            `reference`, `solves` of an evaluation.
    """

    kind: Kind
    take: str
    options: dict[str, Any]

    def key(self) -> str:
        """Return an identifier of this work among all work on the take."""
        text = json.dumps([self.kind, self.options], sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Done:
    """Result of a job: `state` is done, skipped or failed; `message` says why it failed; `made` names the result."""

    take: str
    state: str
    message: str = ""
    made: str = ""


def do(job: BatchJob) -> Done:
    """Do a job, in any process; a failure is returned, not raised, so that the others continue."""
    try:
        inputs, output = _files(job)
        note = Path(job.take) / NOTES / f"{job.kind}_{job.key()}.json"
        before = _stamp(inputs)
        if output.exists() and _noted(note) == before | _stamp([output]):
            return Done(job.take, "skipped", made=str(output))
        _DO[job.kind](job)
        _note(note, before | _stamp([output]))
        return Done(job.take, "done", made=str(output))
    except (StudioError, OSError) as error:
        return Done(job.take, "failed", str(error) or type(error).__name__)


def _solve(job: BatchJob) -> None:
    from studio.engine.model.settings.settings import SolveSettings
    from studio.offline.replay import solve_take
    from studio.take.folder.take import Take

    settings = SolveSettings.from_json(job.options["settings"])
    solve_take(Take.open(job.take), settings, name=job.options["name"], to_disk=False, processes=1)


def _export(job: BatchJob) -> None:
    from studio.engine.animation.export import ExportOptions, export
    from studio.engine.model.poses import Poses

    poses = Poses.load(_poses(job))
    export(poses, job.options["out"], job.options["format"], ExportOptions(**job.options["options"]))


def _evaluate(job: BatchJob) -> None:
    from studio.engine.base.files import write_json
    from studio.engine.metrics.reference.reference import read_reference
    from studio.engine.model.poses import Poses
    from studio.take.folder.evaluating import evaluate_poses
    from studio.take.folder.references import HowAligned
    from studio.take.folder.take import Take

    reference = read_reference(job.options["reference"])
    figures = evaluate_poses(Take.open(job.take), Poses.load(_poses(job)), reference, HowAligned())
    write_json(job.options["out"], {"take": job.take, "solve": job.options["solve"], **figures})


_DO = {"solve": _solve, "export": _export, "evaluate": _evaluate}


def _poses(job: BatchJob) -> Path:
    return Path(job.take) / "solves" / job.options["solve"] / "poses.npz"


def _files(job: BatchJob) -> tuple[list[Path], Path]:
    """Return the input files and the output of the work."""
    take = Path(job.take)
    if job.kind == "solve":
        calibrations = sorted((take / "calibrations").glob("*.json"))
        return [take / "raw.mcap", *calibrations], take / "solves" / job.options["name"] / "poses.npz"
    inputs = [_poses(job)]
    if job.kind == "evaluate":
        inputs.append(Path(job.options["reference"]))
    return inputs, Path(job.options["out"])


def _stamp(inputs: list[Path]) -> dict[str, list[int]]:
    """Size and time of files."""
    return {str(path): [path.stat().st_size, path.stat().st_mtime_ns] for path in inputs if path.exists()}


def _noted(note: Path) -> Any:
    try:
        return json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def _note(note: Path, stamp: dict[str, list[int]]) -> None:
    from studio.engine.base.files import write_json

    write_json(note, stamp, to_disk=False)


class BatchSummary(Struct):
    """The results of a batch: how many jobs were done, done before and failed, and each."""

    done: int
    skipped: int
    failed: int
    takes: list[Done]


def summary(done: list[Done]) -> BatchSummary:
    """Return the results of a batch."""
    counts = Counter(one.state for one in done)
    return BatchSummary(counts["done"], counts["skipped"], counts["failed"], done)
