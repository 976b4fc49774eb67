"""Routes of the 3D view under `/api/v1/view`: which layers are shown, and the cameras' colours."""

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict

from studio.engine.errors import SettingsError
from studio.web.palette import as_hex
from studio.web.scene import LAYERS
from studio.web.view import View


class Layer(BaseModel):
    """A layer of the view: what people call it, and whether it is shown."""

    label: str
    shown: bool


class ViewState(BaseModel):
    """What the 3D view shows: layers by name, and a colour (`#rrggbb`) per camera."""

    layers: dict[str, Layer]
    colours: dict[str, str]


class LayersChange(BaseModel):
    """Layers to show or hide, by name."""

    model_config = ConfigDict(extra="forbid")

    layers: dict[str, bool]


def view_routes(view: View) -> APIRouter:
    """Return the routes of one view."""
    router = APIRouter(prefix="/api/v1/view", tags=["view"])

    def state() -> ViewState:
        shown = view.layers
        return ViewState(
            layers={name: Layer(label=label, shown=shown[name]) for name, (label, _) in LAYERS.items()},
            colours={name: as_hex(rgb) for name, rgb in view.colours.items()},
        )

    @router.get("")
    def get_view() -> ViewState:
        """What the 3D view shows."""
        return state()

    @router.put("")
    def put_view(change: LayersChange) -> ViewState:
        """Show or hide layers; layers that are not named stay as they are."""
        unknown = [name for name in change.layers if name not in LAYERS]
        if unknown:
            raise SettingsError(f"unknown layer {unknown[0]!r}; allowed: {', '.join(LAYERS)}")
        view.set_layers(change.layers)
        return state()

    return router
