"""Analyses on demand, and the clusters that they found (C-173, C-193)."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request

from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.patterns.analysis import analyse, cluster_row, newest_clusters
from skidpad.fleet.words import Action, Principal

Analyst = Annotated[Principal, Depends(Needs(Action.ANALYSE))]
Reader = Annotated[Principal, Depends(Needs(Action.READ_TRENDS))]
router = APIRouter(prefix="/api/v1", tags=["patterns"])


@router.post("/analyses")
def start_analysis(request: Request, who: Analyst) -> dict[str, Any]:
    """Clusters the hazards of the principal's vehicles anew; answers its id and counts."""
    done = analyse(fleet_of(request), who)
    return {
        "analysis": done.id,
        "hazards": done.hazards,
        "unreadable": done.unreadable,
        "clusters": len(done.clusters),
    }


@router.get("/clusters")
def list_clusters(request: Request, who: Reader) -> list[dict[str, Any]]:
    """Answers with the clusters of the newest analysis, largest first; empty before one."""
    with fleet_of(request).engine.connect() as connection:
        return newest_clusters(connection, who)


@router.get("/clusters/{cluster}")
def one_cluster(request: Request, who: Reader, cluster: str) -> dict[str, Any]:
    """Answers with one cluster and its members; record and scenario are the representative's."""
    with fleet_of(request).engine.connect() as connection:
        return cluster_row(connection, who, cluster)
