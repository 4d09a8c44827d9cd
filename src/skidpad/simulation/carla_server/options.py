"""How the server is started (decision K-3): each field is an option of `skidpad carla-server`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct

from skidpad.core.vocabulary import Bodywork, Govern, GripModel, Quality, Scenery

MU_REF = 1.5  # of a tyre with tire_friction 3.5 on a dry road, near CARLA's (decision K-3)


class ServerOptions(Struct, frozen=True, kw_only=True):
    """The command line of `skidpad carla-server`."""

    host: Annotated[str, Meta(description="Address to listen on.")] = "127.0.0.1"
    port: Annotated[int, Meta(description="RPC port; 0: any free one. Streams use the next.")] = (
        2000
    )
    map: Annotated[str, Meta(description="Map to begin with.")] = "figure8"
    maps: Annotated[Path | None, Meta(description="Folder of your own .xodr files.")] = None
    scenery: Annotated[
        Scenery,
        Meta(
            description="full: buildings, trees, lamps beside the roads; none: the file's objects."
        ),
    ] = Scenery.FULL
    bodywork: Annotated[
        Bodywork,
        Meta(description="shaped: a body per blueprint; plain: one coarse body per kind."),
    ] = Bodywork.SHAPED
    quality: Annotated[
        Quality,
        Meta(
            description="Of colour pictures: draft leaves out grain and tracks of the ground and veils of "
            "the sky; size, depth and classes are equal."
        ),
    ] = Quality.FULL
    weather_grip: Annotated[GripModel, Meta(description="How weather acts on tyres.")] = (
        GripModel.PHYSICAL
    )
    ice: Annotated[float, Meta(ge=0.0, le=100.0, description="Ice, percent of 2 cm.")] = 0.0
    mu_ref: Annotated[
        float, Meta(ge=0.05, le=3.0, description="Friction at tire_friction 3.5 on dry road.")
    ] = MU_REF
    surface: Annotated[
        Path | None,
        Meta(
            description="YAML or OpenCRG file with puddles, ice, snow or friction of parts of the map "
            "to begin with; deposits of clients' weather fill puddles that say so."
        ),
    ] = None
    govern: Annotated[
        Govern,
        Meta(
            description="Keep vehicles with the role_name hero, ego or ego_vehicle inside the speed "
            "envelope, whatever program drives them; as for skidpad adas, without oracle, oracle-sight, full."
        ),
    ] = Govern.NONE
    seed: Annotated[int, Meta(description="Seed of sensor noise.")] = 0
    strict: Annotated[bool, Meta(description="Report unknown calls; exit with 1.")] = False
    record_calls: Annotated[Path | None, Meta(description="Write every call here.")] = None
    data_dir: Annotated[Path | None, Meta(description="Folder for files named by clients.")] = None
    ros_domain: Annotated[
        int | None,
        Meta(
            ge=0,
            le=232,
            description="DDS domain (ROS_DOMAIN_ID) in which sensors publish that clients enable for "
            "ROS 2, on all network interfaces; without it they do not. Needs the extra live.",
        ),
    ] = None
    idle_exit: Annotated[
        float | None, Meta(ge=0.0, description="Stop after so many seconds without a client.")
    ] = None
