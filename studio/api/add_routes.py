"""Puts a router's routes on the app."""

from fastapi import APIRouter, FastAPI


def add_routes(app: FastAPI, router: APIRouter) -> None:
    """Have the app answer the router's routes, which carry their whole paths and ask for nothing of the app's.

    `FastAPI.include_router` would make every route a second time at the first request, which then waits for a third
    of a second while other threads work.
    """
    app.router.routes.extend(router.routes)
