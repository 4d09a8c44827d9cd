"""How `skidpad fleet` reaches services, brokers and maps; each refuses in one sentence."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import httpx

    from skidpad.fleet.alerting.relays import Relay
    from skidpad.fleet.broker import Broker
    from skidpad.fleet.service import Places
    from skidpad.fleet.uploader import Post


@contextmanager
def fleet_extra() -> Iterator[None]:
    """One sentence when the optional part is not installed."""
    from skidpad.core.errors import MissingExtra

    try:
        yield
    except MissingExtra:
        raise
    except ImportError as error:
        raise MissingExtra("skidpad fleet", "fleet") from error


def relays(
    places: Places, webhooks: list[str], hosts: list[str], broker: Broker | None
) -> list[Relay]:
    """Where alerts are relayed to; ConfigError for what must not be."""
    import time

    from skidpad.core.errors import ConfigError
    from skidpad.fleet.alerting.relays import Mqtt, Webhook
    from skidpad.fleet.service import open_store
    from skidpad.fleet.store.accounts import tenant_id

    found: list[Relay] = []
    if webhooks:
        engine = open_store(places)
        with engine.begin() as connection:
            for text in webhooks:
                tenant, equals, url = text.partition("=")
                if not equals:
                    raise ConfigError(f"--webhook must read TENANT=URL, got {text!r}")
                found.append(Webhook(tenant_id(connection, tenant, time.time()), url, hosts))
        engine.dispose()
    if broker is not None:
        found.append(Mqtt(broker))
    return found


def broker_of(mqtt: str, ca: Path | None) -> Broker:
    """ConfigError unless it reads HOST[:PORT]."""
    from skidpad.core.errors import ConfigError
    from skidpad.fleet.broker import Broker

    host, _, port = mqtt.rpartition(":") if ":" in mqtt else (mqtt, "", "1883")
    if not port.isdigit():
        raise ConfigError(f"--mqtt must read HOST[:PORT], got {mqtt!r}")
    return Broker(host=host, port=int(port), ca=ca)


@contextmanager
def posting(to: str | None, mqtt: str | None, token_file: Path, ca: Path | None) -> Iterator[Post]:
    """What sends a batch, by HTTPS or through a broker; ConfigError unless exactly one is told."""
    from skidpad.core.errors import ConfigError
    from skidpad.fleet.uploader import mqtt_poster, poster

    if (to is None) is (mqtt is None):
        raise ConfigError("give one of --to and --mqtt")
    if mqtt is not None:
        yield mqtt_poster(broker_of(mqtt, ca), token_of(token_file))
    else:
        with client(str(to), token_file, ca) as link:
            yield poster(link)


def client(to: str, token_file: Path, ca: Path | None) -> httpx.Client:
    """A client with a credential; one sentence for an address or file that cannot be used."""
    import ssl

    from skidpad.core.errors import ConfigError, FileError

    with fleet_extra():
        import httpx

        from skidpad.fleet.uploader import TIMEOUT_S
    if not to.startswith(("https://", "http://127.0.0.1", "http://localhost")):
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
    """The credential in a file."""
    from skidpad.core.errors import FileError

    try:
        return file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"{file}: cannot be read as a credential ({error})") from error


@cache
def map_lines(name: str) -> list[list[tuple[float, float]]]:
    """Middles of the lanes of a bundled map, every third point; nothing for another map."""
    from skidpad.core.errors import InputError
    from skidpad.roads.bundled import bundled_maps, load_map

    try:
        map = load_map(name) if name in bundled_maps() else None
    except InputError:
        map = None
    if map is None:
        return []
    found = []
    for first, size in zip(map.lanes.first.tolist(), map.lanes.size.tolist(), strict=True):
        rows = [*range(first, first + size, 3), first + size - 1]
        found.append([(float(map.samples.x[i]), float(map.samples.y[i])) for i in rows])
    return found
