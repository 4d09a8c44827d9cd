"""Where a run drives, and among whom: on roads with traffic, in a scenario, or along a route."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

from msgspec import Meta, Struct

from skidpad.core.vocabulary import Stratum, TrafficStart


class ActorMode(str, Enum):
    """How a scenario moves an actor."""

    PHYSICAL = "physical"  # a driver tracks what is demanded, through the tyre model
    IDEAL = "ideal"  # it is exactly where it should be


class Edges(str, Enum):
    """What stands along roads whose file draws nothing beside them."""

    NONE = "none"
    RAIL = "rail"


class Roads(Struct, frozen=True, kw_only=True, tag="roads", forbid_unknown_fields=True):
    """A map with background traffic, from its ego's place on."""

    map: Annotated[str, Meta(description="A bundled map's name, or an OpenDRIVE file.")] = "figure8"
    traffic: Annotated[
        TrafficStart,
        Meta(
            description="fixed: start at the published places; random: anywhere within 500 m; "
            "pack: stay within 250 m, slower than the ego would drive."
        ),
    ] = TrafficStart.FIXED
    vehicles: Annotated[int, Meta(ge=0, le=80, description="Background vehicles, 0 to 80.")] = 20
    allow_fewer: bool = False
    reserve: Annotated[int, Meta(ge=0, le=80)] = 0  # further vehicles that a person may call in
    edges: Annotated[
        Edges, Meta(description="rail: guard rails along the roads of a map without barriers.")
    ] = Edges.NONE
    route_km: Annotated[
        float,
        Meta(
            ge=0.0,
            le=1000.0,
            description="The run ends after so many km along the road, at the latest after --duration, "
            "and tells how much of them was driven; 0: no end.",
        ),
    ] = 0.0


class Scenario(Struct, frozen=True, kw_only=True, tag="scenario", forbid_unknown_fields=True):
    """An OpenSCENARIO file, played with these values of its parameters."""

    file: str = ""  # name of the catalogue, or the path of a file
    parameters: dict[str, float | str] = {}
    variant: str = ""  # name of that choice of parameters, where it has one
    name: str = ""  # what results call it; "": by its file
    skill: dict[str, float] = {}  # of scripted drivers, by actor
    ego: Annotated[str | None, Meta(description="Which entity is the ego.")] = None
    actors: Annotated[
        ActorMode, Meta(description="physical: tyres decide; ideal: as the file says.")
    ] = ActorMode.PHYSICAL
    weather_of_file: bool = False  # it changes when the file says so
    end_on_collision: Annotated[
        bool, Meta(description="A contact of the ego ends the run; else the file alone decides.")
    ] = False
    maps: Annotated[
        tuple[str, ...], Meta(description="A folder of roads that files name by bare name.")
    ] = ()
    ignore_unsupported: Annotated[
        bool, Meta(description="Leave out what is not known in the file.")
    ] = False
    lenient: Annotated[bool, Meta(description="Fill in what can mean one thing only.")] = False
    register: Annotated[
        tuple[str, ...],
        Meta(description="NAME=module:Class, a controller, action or value that files may name."),
    ] = ()
    strict: Annotated[bool, Meta(description="Names that nobody registered are errors.")] = False
    disturb: Annotated[
        tuple[str, ...],
        Meta(
            description="ACTOR=accel or ACTOR=accel(SIGMA,TAU): another vehicle's acceleration varies "
            "at random, by SIGMA m/s^2 and correlated over TAU s; without numbers as measured."
        ),
    ] = ()
    draws: dict[str, tuple[float, ...]] = {}  # draws of disturbances before those of the seed

    @property
    def title(self) -> str:
        """Returns the name of the scenario in results: its own, or that of its file."""
        return self.name or self.file.rpartition("/")[2].removesuffix(".xosc")


class Route(Struct, frozen=True, kw_only=True, tag="route", forbid_unknown_fields=True):
    """A way through a map, drawn from the seed, and those whom the ego meets there."""

    name: str
    title: str
    map: str
    vehicles: Annotated[int, Meta(ge=0, le=80)]
    parked: Annotated[int, Meta(ge=0, le=80)]
    pedestrians: Annotated[int, Meta(ge=0, le=80)]
    cyclists: Annotated[int, Meta(ge=0, le=80)]
    base: str = ""  # the route of which this is another weather or stratum; "": of none
    stratum: Stratum = Stratum.NATURAL
    drivers_mind_weather: bool = True  # decision R-5

    @property
    def place(self) -> str:
        """Returns the name of the route by which results are kept apart."""
        return self.base or self.name


Course = Roads | Scenario | Route
