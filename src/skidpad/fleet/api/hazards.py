"""Hazards as stakeholders read them, and their scenarios, made only when asked for (C-157, C-196)."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.responses import PlainTextResponse

from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.events import add_event
from skidpad.fleet.store.reading import Wanted, hazard_row, hazard_rows, record_of, record_text
from skidpad.fleet.words import Action, Principal, Refused

Reader = Annotated[Principal, Depends(Needs(Action.READ_HAZARDS))]
Exporting = Annotated[Principal, Depends(Needs(Action.EXPORT_SCENARIO))]
Seconds = Annotated[float | None, Query(ge=0.0, le=1e12, allow_inf_nan=False)]
Word = Annotated[str | None, Query(max_length=64)]
router = APIRouter(prefix="/api/v1/hazards", tags=["hazards"])


@router.get("")
def list_hazards(
    request: Request,
    who: Reader,
    type: Word = None,
    vehicle: Word = None,
    since: Seconds = None,
    before: Seconds = None,
) -> list[dict[str, Any]]:
    """Answers with the newest hazards of own vehicles, at most 200; `before` pages on."""
    with fleet_of(request).engine.connect() as connection:
        return hazard_rows(connection, who, Wanted(type, vehicle, since, before))


@router.get("/{hazard}")
def one_hazard(request: Request, who: Reader, hazard: str) -> dict[str, Any]:
    """Answers with one hazard and the head of its record; 404 for one out of sight."""
    with fleet_of(request).engine.connect() as connection:
        return hazard_row(connection, who, hazard)


@router.get("/{hazard}/record", response_class=PlainTextResponse)
def record(request: Request, who: Reader, hazard: str) -> str:
    """Answers with the hazard's record as text, just as the vehicle sent it."""
    fleet = fleet_of(request)
    with fleet.engine.connect() as connection:
        hazard_row(connection, who, hazard)
        return record_text(connection, fleet.blobs, hazard)


@router.post("/{hazard}/scenario", response_class=Response)
def scenario(request: Request, who: Exporting, hazard: str) -> Response:
    """Answers with OpenSCENARIO and OpenDRIVE of a hazard as .zip, and keeps that it was asked for."""
    content = export_scenario(fleet_of(request), who, hazard)
    name = f"attachment; filename={hazard}.zip"
    return Response(content, media_type="application/zip", headers={"Content-Disposition": name})


def export_scenario(fleet: Fleet, who: Principal, hazard: str) -> bytes:
    """Returns a .zip of a hazard's OpenSCENARIO and OpenDRIVE, and keeps the export as an event.

    Refused: 501 without an exporter, 404 for a hazard out of sight.
    """
    if fleet.exporter is None:
        raise Refused(501, "this fleet was started without an exporter of scenarios")
    with fleet.engine.connect() as connection:
        hazard_row(connection, who, hazard)
        found = record_of(connection, fleet.blobs, hazard)
    with TemporaryDirectory() as folder:
        content = _zip_files(fleet.exporter(found, Path(folder)))
    with fleet.engine.begin() as connection:
        add_event(connection, ("hazard", hazard), "scenario exported", (who.id, fleet.clock()))
    return content


def _zip_files(files: tuple[Path, Path]) -> bytes:
    """Returns a .zip of the files under their names, compressed and with one fixed date."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for file in files:
            entry = zipfile.ZipInfo(file.name)  # with the date of 1980, whenever it is made
            archive.writestr(entry, file.read_bytes(), zipfile.ZIP_DEFLATED)
    return buffer.getvalue()
