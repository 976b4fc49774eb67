"""Adds a router's routes to the app."""

from fastapi import APIRouter, FastAPI


def add_routes(app: FastAPI, router: APIRouter) -> None:
    """Add a router's routes; their paths must be complete and must not need the app's dependencies.

    `FastAPI.include_router` would make every route again at the first request, which would delay that request by a
    third of a second while other threads work.
    """
    app.router.routes.extend(router.routes)
