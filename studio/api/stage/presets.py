"""Routes of saved presets: save the present switches under a name, rename, remove."""

from typing import Any

from fastapi import APIRouter
from pydantic import Field

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.stage import switches
from studio.api.stage.stage import Request, SettingsRequest
from studio.engine.model.settings import PRESETS
from studio.take.library.presets import Presets


class PresetName(Request):
    """A new name of a preset."""

    name: str = Field(examples=["sword fight"])


def presets_router(presets: Presets) -> APIRouter:
    """Return the routes of the saved presets."""
    router = APIRouter(prefix="/api/v1/presets", tags=["presets"], responses=RESPONSES)

    def line(name: str) -> dict[str, Any]:
        saved = presets.saved()
        if name not in saved:
            raise NotFoundError(
                "settings.no_preset",
                "there is no saved preset {name!r}; GET /api/v1/presets lists them",
                name=name[:80],
            )
        described = switches.describe(saved[name], PRESETS)
        return {"name": name, "preset": described["preset"], "set": described["set"]}

    @router.get("")
    def get_presets() -> list[dict[str, Any]]:
        """The saved presets: name, the nearest of the program's presets, and the differences from it."""
        return [line(name) for name in presets.saved()]

    @router.put("/{name}")
    def put_preset(name: str, request: SettingsRequest) -> dict[str, Any]:
        """Save a preset with changes under a name; a saved preset of that name is replaced."""
        presets.save(name, switches.from_request(presets, request.preset, request.set))
        return line(name)

    @router.patch("/{name}")
    def rename_preset(name: str, request: PresetName) -> dict[str, Any]:
        """Rename a saved preset."""
        line(name)
        presets.rename(name, request.name)
        return line(request.name)

    @router.delete("/{name}")
    def delete_preset(name: str) -> dict[str, Any]:
        """Remove a saved preset; answers its content, with which it can be restored."""
        gone = line(name)
        presets.remove(name)
        return gone

    return router
