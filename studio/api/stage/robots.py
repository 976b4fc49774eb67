"""Routes of the kept robots: what they are, corrections of their parts, and removal. `POST /imports` adds them."""

from pathlib import Path

from fastapi import APIRouter
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.stage.stage import Request
from studio.api.structs import StructRoute
from studio.engine.robots.facts import RobotFacts
from studio.engine.robots.files import FOLDER, kept_robots, remove_robot, restore_robot
from studio.worker import run_in_process


class RobotRequest(Request):
    """Corrections of a robot; fields that are left out stay."""

    parts: dict[str, str] = Field(
        default_factory=dict,
        max_length=100,
        description="part -> body of the model",
        examples=[{"left_hand": "left_palm_link"}],
    )
    velocity_rad_s: float | None = Field(None, gt=0, description="velocity limit of every joint [rad/s]")


def robots_router(sessions: Path) -> APIRouter:
    """Return the routes of the robots in `sessions/robots/`."""
    router = APIRouter(prefix="/api/v1/robots", tags=["robots"], responses=RESPONSES, route_class=StructRoute)
    folder = sessions / FOLDER

    @router.get("")
    def get_robots() -> list[str]:
        """Names of the kept robots."""
        return kept_robots(folder)

    @router.get("/{name}")
    def get_robot(name: str) -> RobotFacts:
        """A kept robot's parts, joints, limits and sizes, and what was assumed."""
        return run_in_process("studio.engine.robots.describe:kept_facts", folder, name)

    @router.patch("/{name}")
    def correct(name: str, request: RobotRequest) -> RobotFacts:
        """Correct which body is which part, or limits of velocity."""
        return run_in_process(
            "studio.engine.robots.describe:correct_and_tell",
            folder,
            name,
            request.parts,
            request.velocity_rad_s,
        )

    @router.delete("/{name}")
    def remove(name: str) -> list[str]:
        """Remove a kept robot; `restore` brings it back. Answers the names of the others."""
        remove_robot(folder, name)
        return kept_robots(folder)

    @router.post("/{name}/restore")
    def restore(name: str) -> list[str]:
        """Bring back the robot that was last removed under this name; answers the names of the kept robots."""
        restore_robot(folder, name)
        return kept_robots(folder)

    return router
