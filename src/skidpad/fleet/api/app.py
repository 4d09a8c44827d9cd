"""The application: routes, and what a refusal looks like."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI, Request
from fastapi.openapi.utils import get_openapi
from fastapi.responses import JSONResponse
from sqlalchemy.exc import DataError, IntegrityError

import skidpad
from skidpad.core.errors import SkidpadError
from skidpad.fleet.api import (
    alerts,
    changes,
    hazards,
    insight,
    orders,
    patterns,
    recurring,
    updates,
    vehicle,
)
from skidpad.fleet.api.guard import Guard
from skidpad.fleet.service import Fleet
from skidpad.fleet.words import MEANWHILE, UNKEPT, Refused

DESCRIPTION = "/api/v1/openapi.json"
ROUTERS = (
    vehicle.router, hazards.router, patterns.router, alerts.router, orders.router,
    updates.router, changes.router, insight.router, recurring.router,
)  # fmt: skip
ROUTES = [route for router in ROUTERS for route in router.routes]


def make_app(fleet: Fleet) -> FastAPI:
    """Returns the HTTP interface of `fleet` alone; it is described at DESCRIPTION."""
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    add_api(app, fleet)
    return app


def add_api(app: FastAPI, fleet: Fleet) -> None:
    """Adds the interface below /api/v1 to an application."""
    app.state.fleet, app.state.guard = fleet, Guard(fleet)
    for router in ROUTERS:
        app.include_router(router)

    @app.get(DESCRIPTION, include_in_schema=False)
    def description() -> dict[str, Any]:
        """Answers with the interface as OpenAPI; it holds no record and needs no credential."""
        return get_openapi(title="Skidpad fleet", version=skidpad.__version__, routes=ROUTES)

    app.add_exception_handler(Refused, _answer_refusal)
    app.add_exception_handler(SkidpadError, _answer_failure)
    app.add_exception_handler(DataError, _unkept)
    app.add_exception_handler(IntegrityError, _meanwhile)


async def _answer_refusal(request: Request, error: Exception) -> JSONResponse:
    """Returns the JSON answer of a refusal, status 500 for any other error."""
    del request
    status = error.status if isinstance(error, Refused) else 500
    headers = {401: {"WWW-Authenticate": "Bearer"}, 429: {"Retry-After": "1"}}.get(status)
    return JSONResponse({"detail": str(error)}, status, headers)


async def _answer_failure(request: Request, error: Exception) -> JSONResponse:
    """Returns status 422 with the one sentence of an error of ours."""
    del request
    return JSONResponse({"detail": str(error)}, 422)


async def _unkept(request: Request, error: Exception) -> JSONResponse:
    """Returns status 422 for text that the database does not take, such as a NUL in PostgreSQL."""
    del request, error
    return JSONResponse({"detail": UNKEPT}, 422)


async def _meanwhile(request: Request, error: Exception) -> JSONResponse:
    """Returns status 409 to the later of two requests that kept the same at one moment."""
    del request, error
    return JSONResponse({"detail": MEANWHILE}, 409)
