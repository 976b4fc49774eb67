"""Routes of the boards that give cameras without depth the size of the stage."""

from importlib.util import find_spec

from fastapi import APIRouter, Query
from fastapi.responses import Response
from msgspec import Struct

from studio.api.errors import RESPONSES
from studio.api.structs import StructRoute
from studio.engine.seeing.board import DICTIONARIES, FAMILIES, Board, no_opencv
from studio.worker import run_in_process


class Boards(Struct):
    """Dictionaries of ChArUco boards, families of AprilTags, and why none can be found here; "" where it can."""

    dictionaries: tuple[str, ...]
    families: tuple[str, ...]
    missing: str


def boards_router() -> APIRouter:
    """Return the routes."""
    router = APIRouter(
        prefix="/api/v1/boards", tags=["calibration"], responses=RESPONSES, route_class=StructRoute
    )

    @router.get("")
    def get_boards() -> Boards:
        """Dictionaries and families of boards, and whether this server can find any."""
        return Boards(DICTIONARIES, FAMILIES, "" if find_spec("cv2") else str(no_opencv()))

    @router.get("/{board}", response_class=Response)
    def get_board(board: str, number: int = Query(0, description="of the AprilTag")) -> Response:
        """A sheet with a board or a tag in true size, to be printed (SVG)."""
        sheet = run_in_process("studio.engine.seeing.board_sheet:board_sheet", Board.parse(board), number)
        return Response(sheet, media_type="image/svg+xml", headers={"Cache-Control": "no-store"})

    return router
