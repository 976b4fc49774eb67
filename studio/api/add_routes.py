"""Adds a router's routes to the app."""

from fastapi import APIRouter, FastAPI


def add_routes(app: FastAPI, router: APIRouter) -> None:
    """Add a router's routes, which have their whole paths and no dependencies of the app's.

    `FastAPI.include_router` would make every route a second time at the first request, which then waits for a third
    of a second while other threads work.
    """
    app.router.routes.extend(router.routes)
