"""The application: routes, and what a refusal looks like."""

from __future__ import annotations

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse

import skidpad
from skidpad.core.errors import SkidpadError
from skidpad.fleet.api import alerts, changes, hazards, insight, orders, patterns, updates, vehicle
from skidpad.fleet.api.guard import Guard
from skidpad.fleet.service import Fleet
from skidpad.fleet.words import Refused

ROUTERS = (
    vehicle.router, hazards.router, patterns.router, alerts.router, orders.router,
    updates.router, changes.router, insight.router,
)  # fmt: skip


def make_app(fleet: Fleet) -> FastAPI:
    """The HTTP interface of `fleet` alone; /openapi.json describes it."""
    app = FastAPI(title="Skidpad fleet", version=skidpad.__version__, docs_url=None, redoc_url=None)
    add_api(app, fleet)
    return app


def add_api(app: FastAPI, fleet: Fleet) -> None:
    """Add the interface below /api/v1 to an application."""
    app.state.fleet, app.state.guard = fleet, Guard(fleet)
    for router in ROUTERS:
        app.include_router(router)
    app.add_exception_handler(Refused, _refused)
    app.add_exception_handler(SkidpadError, _failed)


async def _refused(request: Request, error: Exception) -> JSONResponse:
    del request
    status = error.status if isinstance(error, Refused) else 500
    headers = {401: {"WWW-Authenticate": "Bearer"}, 429: {"Retry-After": "1"}}.get(status)
    return JSONResponse({"detail": str(error)}, status, headers)


async def _failed(request: Request, error: Exception) -> JSONResponse:
    """What was kept cannot be used: one sentence, without a place on disk."""
    del request
    return JSONResponse({"detail": str(error)}, 422)
