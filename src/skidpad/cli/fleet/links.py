"""How `skidpad fleet` reaches services, brokers and maps; each refuses in one sentence."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import httpx
    from sqlalchemy import Connection

    from skidpad.core.environment.localities import Locality, Locate
    from skidpad.fleet.alerting.relays import Relay
    from skidpad.fleet.broker import Broker
    from skidpad.fleet.service import Places
    from skidpad.fleet.site.drawing import Line, MapLines
    from skidpad.fleet.uploader import Post
    from skidpad.roads.queries import RoadMap

    Maps = Callable[[str], RoadMap | None]


@contextmanager
def fleet_extra() -> Iterator[None]:
    """Turns a missing import within the block into MissingExtra, one sentence on the part `fleet`."""
    from skidpad.core.errors import MissingExtra

    try:
        yield
    except MissingExtra:
        raise
    except ImportError as error:
        raise MissingExtra("skidpad fleet", "fleet") from error


@contextmanager
def committing(places: Places) -> Iterator[Connection]:
    """Yields a connection to a fleet's store; its work is kept whole, or not at all on an error."""
    from skidpad.fleet.service import open_store

    engine = open_store(places)
    try:
        with engine.begin() as connection:
            yield connection
    finally:
        engine.dispose()


def relays(
    places: Places,
    webhooks: Sequence[str],
    hosts: Sequence[str],
    broker: Broker | None,
    others: Sequence[str] = (),
) -> list[Relay]:
    """Makes the relays of alerts. others: NAME=SETTING of registered kinds.

    Raises ConfigError for an unknown kind, an unknown operator or a setting that cannot be used.
    """
    from skidpad.fleet.alerting.relay_types import RelayHost, make_relays
    from skidpad.fleet.store.accounts import find_tenant

    def find_operator(tenant: str) -> str:
        with committing(places) as connection:
            return find_tenant(connection, tenant)

    asked = [f"webhook={text}" for text in webhooks]
    asked += ["mqtt"] if broker is not None else []
    return make_relays([*asked, *others], RelayHost(find_operator, hosts, broker))


def broker_of(mqtt: str, ca: Path | None, user: str | None, password: Path | None) -> Broker:
    """Returns the broker at HOST[:PORT]; ConfigError for another form or half a log-in.

    password: a file that holds it.
    """
    from skidpad.core.errors import ConfigError
    from skidpad.fleet.broker import Broker

    host, _, port = mqtt.rpartition(":") if ":" in mqtt else (mqtt, "", "1883")
    if not port.isdigit():
        raise ConfigError(f"--mqtt must read HOST[:PORT], got {mqtt!r}")
    if (user is None) is not (password is None):
        raise ConfigError("--mqtt-user and --mqtt-password-file go together")
    word = None if password is None else token_of(password)
    return Broker(host=host, port=int(port), user=user, password=word, ca=ca)


@contextmanager
def posting(
    to: str | None, broker: Broker | None, token_file: Path, ca: Path | None
) -> Iterator[Post]:
    """Yields a function that sends a batch, by HTTPS or a broker; ConfigError unless one is told."""
    from skidpad.core.errors import ConfigError
    from skidpad.fleet.uploader import mqtt_poster, poster

    if (to is None) is (broker is None):
        raise ConfigError("give one of --to and --mqtt")
    if broker is not None:
        yield mqtt_poster(broker, token_of(token_file))
    else:
        with client(str(to), token_file, ca) as link:
            yield poster(link)


def client(to: str, token_file: Path, ca: Path | None) -> httpx.Client:
    """Returns an HTTP client with the vehicle's credential, not connected yet.

    Raises ConfigError for an address without https beyond this machine, FileError for a file that
    cannot be read.
    """
    import ssl
    from urllib.parse import urlsplit

    from skidpad.core.errors import ConfigError, FileError
    from skidpad.pages.server import is_local

    with fleet_extra():
        import httpx

        from skidpad.fleet.uploader import TIMEOUT_S
    parts = urlsplit(to)
    host = parts.hostname or ""
    if not (parts.scheme == "https" or (parts.scheme == "http" and is_local(host))) or "@" in to:
        raise ConfigError(f"--to must be https://, or http:// on this machine, got {to!r}")
    try:
        verify = ssl.create_default_context(cafile=str(ca) if ca else None)
    except OSError as error:
        raise FileError(f"{ca}: cannot be read as certificates ({error})") from error
    headers = {"Authorization": f"Bearer {token_of(token_file)}"}
    return httpx.Client(
        base_url=to, headers=headers, verify=verify, timeout=TIMEOUT_S, trust_env=False
    )


def token_of(file: Path) -> str:
    """Returns the credential in a file; FileError when it cannot be read."""
    from skidpad.core.errors import FileError

    try:
        return file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"{file}: cannot be read as a credential ({error})") from error


def open_maps(folder: Path | None) -> Maps:
    """Returns a function from a name to its map: of an OpenDRIVE file in `folder`, else bundled.

    It gives None for others. FileError for what is no folder, InputError for a file in it that cannot
    be read.
    """
    from skidpad.core.errors import FileError
    from skidpad.roads.bundled import bundled_maps, load_map

    if folder is not None and not folder.is_dir():
        raise FileError(f"--maps {folder}: there is no such folder")
    files = sorted(folder.glob("*.xodr")) if folder is not None else []
    found = {file.stem: load_map(file) for file in files}

    def load(name: str) -> RoadMap | None:
        if name not in found and name in bundled_maps():
            found[name] = load_map(name)
        return found.get(name)

    return load


def map_lines(maps: Maps) -> MapLines:
    """Returns a function from a map's name to the lines of its roads, () for an unknown map."""
    known: dict[str, list[Line]] = {}

    def lines(name: str) -> Sequence[Line]:
        map = maps(name)
        if map is None:
            return ()
        if name not in known:
            known[name] = _lines_of(map)
        return known[name]

    return lines


def place_finder(maps: Maps) -> Locate:
    """Returns a function from map, x, y (m) to road, lane and junction there; None for an unknown map."""
    from skidpad.roads.localities import Localities

    known: dict[str, Localities] = {}

    def locate(name: str, x: float, y: float) -> Locality | None:
        map = maps(name)
        if map is None:
            return None
        if name not in known:
            known[name] = Localities(map)
        return known[name].find(x, y)

    return locate


def _lines_of(map: RoadMap) -> list[Line]:
    """Returns the middles of a map's lanes in m, every third point and the last."""
    found: list[Line] = []
    for first, size in zip(map.lanes.first.tolist(), map.lanes.size.tolist(), strict=True):
        rows = [*range(first, first + size, 3), first + size - 1]
        found.append([(float(map.samples.x[i]), float(map.samples.y[i])) for i in rows])
    return found
