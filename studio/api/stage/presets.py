"""Routes of saved presets: save the present switches under a name, rename, remove."""

from fastapi import APIRouter
from msgspec import Struct
from pydantic import Field

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.stage import switches
from studio.api.stage.stage import Request, SettingsRequest
from studio.api.structs import StructRoute
from studio.engine.model.settings.settings import PRESETS
from studio.take.library.presets import Presets


class PresetName(Request):
    """A new name of a preset."""

    name: str = Field(examples=["sword fight"])


class SavedPreset(Struct):
    """A saved preset: its name, the nearest of the program's presets, and the differences from it as texts by key."""

    name: str
    preset: str
    set: dict[str, str]


def presets_router(presets: Presets) -> APIRouter:
    """Return the routes of the saved presets."""
    router = APIRouter(
        prefix="/api/v1/presets", tags=["presets"], responses=RESPONSES, route_class=StructRoute
    )

    def line(name: str) -> SavedPreset:
        saved = presets.saved()
        if name not in saved:
            raise NotFoundError(
                "settings.no_preset",
                "there is no saved preset {name!r}; GET /api/v1/presets lists them",
                name=name[:80],
            )
        described = switches.describe(saved[name], PRESETS)
        return SavedPreset(name, described.preset, described.set)

    @router.get("")
    def get_presets() -> list[SavedPreset]:
        """The saved presets."""
        return [line(name) for name in presets.saved()]

    @router.put("/{name}")
    def put_preset(name: str, request: SettingsRequest) -> SavedPreset:
        """Save a preset with changes under a name; a saved preset of that name is replaced."""
        presets.save(name, switches.from_request(presets, request.preset, request.set))
        return line(name)

    @router.patch("/{name}")
    def rename_preset(name: str, request: PresetName) -> SavedPreset:
        """Rename a saved preset."""
        line(name)
        presets.rename(name, request.name)
        return line(request.name)

    @router.delete("/{name}")
    def delete_preset(name: str) -> SavedPreset:
        """Remove a saved preset; answers its content, with which it can be restored."""
        gone = line(name)
        presets.remove(name)
        return gone

    return router
