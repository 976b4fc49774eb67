"""Routes of incoming rigid bodies."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
from fastapi import APIRouter
from msgspec import Struct
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.stage.stage import Request
from studio.api.structs import StructRoute
from studio.engine.base.errors import SettingsError, StudioError
from studio.live import LiveStage
from studio.rigid_bodies.incoming import RigidStatus
from studio.rigid_bodies.settings import RigidSettings
from studio.take.folder.take import Take
from studio.take.library.sessions import take_ids
from studio.take.rigid_bodies.kept import KNOWN_FILE, take_bodies


class RigidBodiesRequest(Request):
    """Changes of the settings of incoming rigid bodies; fields that are left out stay."""

    osc: bool | None = Field(None, description="hear trackers over OSC: VMC's and VRChat's")
    natnet: bool | None = Field(None, description="hear NatNet (OptiTrack)")
    host: str | None = Field(None, description="address of this machine to listen at for OSC")
    osc_port: int | None = None
    natnet_server: str | None = Field(None, description="machine that sends NatNet")
    natnet_port: int | None = Field(None, description="its port for commands")
    natnet_multicast: str | None = Field(None, description="the group it sends to; empty: unicast")
    natnet_up: str | None = Field(None, description="y or z")
    place: dict[str, float] | None = Field(
        None, examples=[{"x_m": 0.0, "y_m": 0.0, "z_m": 0.0, "yaw_deg": 90.0}]
    )
    bodies: list[dict[str, Any]] | None = Field(
        None,
        description="what the bodies are: name, use (reference, prop, evidence), joint, performer, shape",
        examples=[[{"name": "Wand", "use": "prop", "shape": {"kind": "cylinder", "size_cm": [3, 60]}}]],
    )

    ties: dict[str, Any] | None = Field(
        None, description="how bodies sit on their joints, as `studio rigid TAKE --json` has it"
    )
    later_s: float | None = Field(None, description="how much later than they came their readings count")
    like_take: str | None = Field(
        None, description="session/take: place, bodies, ties and later_s as they were measured in it"
    )


class RigidBodiesShown(Struct):
    """The settings, what was received, and the measured takes, session/name, that `like_take` may name."""

    settings: RigidSettings
    status: RigidStatus
    measured: list[str]


def rigid_bodies_router(stage: LiveStage, sessions: Path, take_of: Callable[[str], Take]) -> APIRouter:
    """Return the routes of rigid bodies; `take_of` returns a take of `sessions` by its id."""
    router = APIRouter(prefix="/api/v1", tags=["stage"], responses=RESPONSES, route_class=StructRoute)

    def shown() -> RigidBodiesShown:
        measured = _measured_takes(sessions)
        return RigidBodiesShown(stage.bodies.settings, stage.bodies.status(), measured)

    @router.get("/rigid-bodies")
    def get_rigid_bodies() -> RigidBodiesShown:
        """The systems of rigid bodies that are listened to, and what was received."""
        return shown()

    @router.patch("/rigid-bodies")
    def change_rigid_bodies(request: RigidBodiesRequest) -> RigidBodiesShown:
        """Listen to systems of rigid bodies, or describe the bodies; at once, and also after a restart."""
        changes = request.model_dump(exclude_none=True, exclude={"like_take"})
        value = {
            **msgspec.to_builtins(stage.bodies.settings),
            **_measured(take_of, request.like_take),
            **changes,
        }
        try:
            settings = msgspec.convert(value, RigidSettings)
        except msgspec.ValidationError as error:
            raise SettingsError(
                "rigid.form", "these rigid bodies cannot be read: {error}", error=str(error)[:200]
            ) from error
        stage.bodies.change(settings)
        return shown()

    return router


def _measured_takes(sessions: Path) -> list[str]:
    """Return the ids of the takes in which bodies were measured on joints; unreadable takes are left out."""
    found = []
    for take_id in take_ids(sessions):
        if (sessions / take_id / KNOWN_FILE).is_file():
            with suppress(StudioError):
                if take_bodies(Take.open(sessions / take_id)).ties:
                    found.append(take_id)
    return found


def _measured(take_of: Callable[[str], Take], take_id: str | None) -> dict[str, Any]:
    """Return the settings that were measured in a take; none without a take."""
    if take_id is None:
        return {}
    known = msgspec.to_builtins(take_bodies(take_of(take_id)))
    return {key: known[key] for key in ("place", "bodies", "later_s", "ties")}
