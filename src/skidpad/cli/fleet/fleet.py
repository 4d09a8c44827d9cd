"""`skidpad fleet`: the service that vehicles report to, and the vehicle's side of it."""

from __future__ import annotations

import threading
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from skidpad.cli.fleet.links import (
    broker_of,
    client,
    committing,
    fleet_extra,
    map_lines,
    open_maps,
    place_finder,
    posting,
    relays,
)

if TYPE_CHECKING:
    from skidpad.fleet.service import Places

fleet = typer.Typer(
    name="fleet",
    help="From one car's hazards to what goes wrong everywhere.",
    no_args_is_help=True,
)
Data = Annotated[Path, typer.Option(help="Folder of the fleet's store.")]
Database = Annotated[
    str | None, typer.Option(help="postgresql://... instead of the SQLite file in --data.")
]
RoleWord = Annotated[str, typer.Argument(help="manufacturer, operator, ..., vehicle.")]
Name = Annotated[str, typer.Argument(help="Of the person or vehicle.")]
Tenant = Annotated[str, typer.Option(help="Organisation; of a vehicle: its operator.")]
BlobUrl = Annotated[
    str | None,
    typer.Option("--blobs", help="Where bodies are kept: a folder or an fsspec address."),
]
MqttUser = Annotated[str | None, typer.Option(help="Who logs in at the broker.")]
MqttPassword = Annotated[Path | None, typer.Option(help="File that holds the broker's password.")]
TokenFile = Annotated[Path, typer.Option(help="File that holds the vehicle's credential.")]


def _places(data: Path, database: str | None, blobs: str | None) -> Places:
    """Returns where a fleet keeps its data; None: inside the folder `data`."""
    with fleet_extra():
        from skidpad.fleet.service import Places
    return Places(data=data, database=database, blobs=blobs)


@fleet.command()
def serve(
    data: Data,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="0: any free one, which is printed.")] = 8470,
    database: Database = None,
    blobs: BlobUrl = None,
    certificate: Annotated[
        Path | None, typer.Option(help="PEM of the server; with --key serves HTTPS.")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="PEM of its private key.")] = None,
    webhook: Annotated[
        list[str] | None, typer.Option(help="TENANT=URL that this operator's alerts are sent to.")
    ] = None,
    webhook_host: Annotated[
        list[str] | None, typer.Option(help="A host that webhooks may lead to.")
    ] = None,
    relay: Annotated[
        list[str] | None,
        typer.Option(help="NAME=SETTING of another alert relay; see `skidpad extensions relays`."),
    ] = None,
    mqtt: Annotated[
        str | None,
        typer.Option(help="HOST[:PORT] of an MQTT 5 broker: alerts go out, batches come in."),
    ] = None,
    mqtt_ca: Annotated[Path | None, typer.Option(help="PEM of the broker's authority.")] = None,
    mqtt_user: MqttUser = None,
    mqtt_password_file: MqttPassword = None,
    name: Annotated[
        list[str] | None, typer.Option(help="What browsers call this host besides --host.")
    ] = None,
    maps: Annotated[
        Path | None, typer.Option(help="Folder of your own .xodr files, drawn on the dashboard.")
    ] = None,
) -> None:
    """Serve the fleet; nothing listens beyond this machine unless --host says so."""
    with fleet_extra():
        from skidpad.fleet.mqtt import BatchListener
        from skidpad.fleet.server import Listen, run
        from skidpad.fleet.service import open_fleet
    from skidpad.scenarios.export.hazard_export import export_hazard

    _check_exposure(host, certificate, key)
    places, known_maps = _places(data, database, blobs), open_maps(maps)
    broker = None if mqtt is None else broker_of(mqtt, mqtt_ca, mqtt_user, mqtt_password_file)
    known = relays(places, webhook or [], webhook_host or [], broker, relay or [])
    locate = place_finder(known_maps)
    service = open_fleet(places, exporter=export_hazard, relays=known, locate=locate)
    batches = None if broker is None else BatchListener(service, broker)
    try:
        if batches is not None:
            batches.start()
        listen = Listen(host, port, certificate, key, tuple(name or ()))
        run(service, listen, map_lines(known_maps), typer.echo)
    finally:
        if batches is not None:
            batches.close()
        service.close()


def _check_exposure(host: str, certificate: Path | None, key: Path | None) -> None:
    """Raises ConfigError for a service that others could reach without HTTPS, or half a key pair."""
    from skidpad.core.errors import ConfigError
    from skidpad.pages.server import is_local

    if (certificate is None) is not (key is None):
        raise ConfigError("--certificate and --key go together")
    if not is_local(host) and certificate is None:
        raise ConfigError(f"--host {host} leaves this machine and needs --certificate and --key")


@fleet.command()
def enrol(
    data: Data,
    role: RoleWord,
    name: Name,
    tenant: Tenant,
    manufacturer: Annotated[str | None, typer.Option(help="Of a vehicle: who made it.")] = None,
    database: Database = None,
) -> None:
    """Add someone to the fleet and print the credential, which is not kept."""
    import time

    from skidpad.core.errors import ConfigError, require_choice

    with fleet_extra():
        from skidpad.fleet.store.accounts import add_person, add_vehicle
        from skidpad.fleet.words import Role
    known = Role(require_choice("role", role, [r.value for r in Role]))
    if (known is Role.VEHICLE) is (manufacturer is None):
        raise ConfigError("--manufacturer is needed for a vehicle, and for nobody else")
    with committing(_places(data, database, None)) as connection:
        account = (
            add_person(connection, tenant, known, name, time.time())
            if manufacturer is None
            else add_vehicle(connection, tenant, manufacturer, name, time.time())
        )
    typer.echo(account.token)


@fleet.command()
def end(
    data: Data,
    role: RoleWord,
    name: Name,
    tenant: Tenant,
    renew: Annotated[bool, typer.Option(help="Print a fresh credential in its place.")] = False,
    database: Database = None,
) -> None:
    """End the credentials of someone; a service that runs refuses them within 10 s."""
    import time

    from skidpad.core.errors import require_choice
    from skidpad.core.text.wording import count_text

    with fleet_extra():
        from skidpad.fleet.store import accounts
        from skidpad.fleet.words import Role
    known = Role(require_choice("role", role, [r.value for r in Role]))
    now = time.time()
    with committing(_places(data, database, None)) as connection:
        found = accounts.principals_named(connection, tenant, known, name)
        ended = sum(accounts.end_credentials(connection, o, "command", now) for o in found)
        fresh = accounts.add_credential(connection, found[-1], now) if renew else None
    typer.echo(fresh or f"{count_text(ended, 'credential')} ended")


@fleet.command("open")
def open_pages(
    to: Annotated[str, typer.Option(help="Address of the fleet.")],
    token_file: TokenFile,
    ca: Annotated[Path | None, typer.Option(help="PEM of the authority that is trusted.")] = None,
) -> None:
    """Print an address that opens the pages once, as whose credential it is."""
    from skidpad.core.errors import BackendError

    with client(to, token_file, ca) as link:
        answer = link.post("/api/v1/session")
    if answer.status_code != 200:
        raise BackendError(f"the fleet gives no session: {answer.text}")
    typer.echo(to.rstrip("/") + answer.json()["path"])


@fleet.command()
def upload(
    spool: Annotated[Path, typer.Option(help="Folder that holds what is not acknowledged.")],
    token_file: TokenFile,
    folders: Annotated[
        list[Path] | None, typer.Argument(help="Output folders of `skidpad monitor` to add.")
    ] = None,
    to: Annotated[str | None, typer.Option(help="Address of the fleet.")] = None,
    mqtt: Annotated[
        str | None, typer.Option(help="HOST[:PORT] of its MQTT 5 broker, in place of --to.")
    ] = None,
    release: Annotated[str, typer.Option(help="Update under which the vehicle drove.")] = "",
    ca: Annotated[Path | None, typer.Option(help="PEM of the authority that is trusted.")] = None,
    mqtt_user: MqttUser = None,
    mqtt_password_file: MqttPassword = None,
    wait: Annotated[float, typer.Option(help="Seconds to go on trying when nobody answers.")] = 0.0,
    every: Annotated[
        float, typer.Option(min=0.0, help="Look for new drives and send again after s; 0: once.")
    ] = 0.0,
) -> None:
    """Send hazards, drives and indicators; what is not acknowledged waits in the spool.

    With --every also drives in folders within FOLDERS, each as soon as its monitor has finished it.
    """
    with fleet_extra():
        from skidpad.fleet.monitored import Lookout, spool_folder
        from skidpad.fleet.spool import Spool
        from skidpad.fleet.uploader import rounds, send_all
    kept = Spool(spool)
    broker = None if mqtt is None else broker_of(mqtt, ca, mqtt_user, mqtt_password_file)
    with posting(to, broker, token_file, ca) as post:
        send_now = partial(send_all, kept, post, wait)
        if not every:
            for folder in folders or []:
                spool_folder(kept, folder, release)
            typer.echo(send_now())
            return
        lookout = Lookout(folders or [], release)
        with suppress(KeyboardInterrupt):
            for sent in rounds(partial(lookout.spool, kept), send_now, every):
                typer.echo(sent)


@fleet.command("drive")
def drive_one(
    to: Annotated[str, typer.Option(help="Address of the fleet.")],
    token_file: TokenFile,
    orders_key: Annotated[Path, typer.Option(help="DATA/keys/orders.pub of the fleet, pinned.")],
    out: Annotated[Path, typer.Option(help="A new folder for the recording and its monitor.")],
    route: Annotated[str, typer.Option(help="One of the six routes.")] = "route-1",
    seconds: Annotated[float, typer.Option(min=1.0, max=36000.0, help="Of the drive.")] = 60.0,
    seed: Annotated[int, typer.Option(help="Of the drive.")] = 0,
    ca: Annotated[Path | None, typer.Option(help="PEM of the authority that is trusted.")] = None,
) -> None:
    """Drive a simulated vehicle that raises alerts as its monitor finds hazards, and obeys orders.

    At real time, by three channels. What the monitor found lies in OUT/drive.monitor, for `upload`.
    """
    from msgspec import structs

    from skidpad.campaign.channels.routes import driven_routes
    from skidpad.core.errors import require_choice
    from skidpad.core.text.wording import count_text
    from skidpad.recording.files import require_free

    with fleet_extra():
        from skidpad.cli.fleet.drive import PATIENCE_S, drive_aboard
        from skidpad.fleet.aboard import Aboard, pinned_key
    chosen = driven_routes()[require_choice("--route", route, [*driven_routes()])]
    public = pinned_key(orders_key)
    require_free(out)
    with client(to, token_file, ca) as link:
        link.timeout = PATIENCE_S
        aboard = Aboard(link, public, typer.echo)
        out.mkdir(parents=True, exist_ok=True)
        spec = structs.replace(chosen, duration=seconds, seed=seed)
        outcome, watched = drive_aboard(spec, out, aboard)
    typer.echo(
        f"{outcome.driven_s:.1f} s, {outcome.distance_m:.0f} m driven; "
        f"{count_text(aboard.raised, 'alert')} raised, {count_text(aboard.obeyed, 'order')} obeyed, "
        f"{count_text(aboard.waiting, 'word')} that the fleet has not got\n"
        f"monitor: {watched.sentence}"
    )


@fleet.command()
def keys(
    data: Data,
    manufacturer: Annotated[str, typer.Option(help="Whose updates these keys sign.")],
    out: Annotated[Path, typer.Option(help="Folder of the keys, off line, never below --data.")],
    database: Database = None,
) -> None:
    """Begin a maker's updates: three keys each for root and list, two of which must sign.

    Writes the keys and root.json, which vehicles pin, to --out. A maker can begin only once.
    """
    with fleet_extra():
        from skidpad.fleet.service import open_fleet
        from skidpad.fleet.store.accounts import tenant_id

    service = open_fleet(_places(data, database, None))
    try:
        with service.engine.begin() as connection:
            tenant = tenant_id(connection, manufacturer, service.clock())
        service.begin_updates(tenant, out)
    finally:
        service.close()
    typer.echo(f"{out / 'root.json'} is what vehicles pin; keep the keys beside it off line")


@fleet.command()
def sign(
    payload: Annotated[Path, typer.Argument(help="Rules, thresholds or a model.")],
    kind: Annotated[str, typer.Option(help="rules, thresholds or model.")],
    list_: Annotated[Path, typer.Option("--list", help="The current list of updates.")],
    key: Annotated[list[Path], typer.Option(help="A key of the list; two are needed.")],
    out: Annotated[Path, typer.Option(help="The next list, signed.")],
) -> None:
    """Off line: check an update, add it to the list of updates and sign that."""
    import time

    from skidpad.core.errors import FileError, require_choice

    with fleet_extra():
        from skidpad.fleet.updates import signing
        from skidpad.fleet.updates.payloads import PayloadKind, payload_name, read_payload_content
    from skidpad.recording.files import write_bytes

    known = PayloadKind(require_choice("kind", kind, [k.value for k in PayloadKind]))
    try:
        content, current = payload.read_bytes(), list_.read_bytes()
    except OSError as error:
        raise FileError(f"{error.filename}: cannot be read ({error.strerror})") from error
    read_payload_content(known, content)
    name = payload_name(known, content)
    signers = [signing.load_key(path) for path in key]
    write_bytes(out, signing.add_target(current, (name, content), {}, signers, time.time()))
    typer.echo(f"{name} is in {out}")


@fleet.command()
def certificate(
    out: Annotated[Path, typer.Option(help="Folder for ca.pem, server.pem and server.key.")],
    host: Annotated[list[str], typer.Option(help="Name or address of the server.")] = ["127.0.0.1"],  # noqa: B006
) -> None:
    """Make a certificate authority of one's own and a server's certificate for HTTPS."""
    with fleet_extra():
        from skidpad.fleet.certificates import make_certificates
    for path in make_certificates(out, host):
        typer.echo(str(path))


@fleet.command()
def demo(
    out: Annotated[
        Path | None, typer.Option(help="A new folder of the demo; default: out/fleet, numbered.")
    ] = None,
    vehicles: Annotated[int, typer.Option(min=3, max=1000, help="How many vehicles.")] = 50,
    seconds: Annotated[float, typer.Option(min=5.0, max=600.0, help="Of each drive.")] = 25.0,
    workers: Annotated[int, typer.Option(min=1, max=256, help="Drives at once.")] = 2,
    port: Annotated[int, typer.Option(help="Of the dashboard; 0: any free one.")] = 0,
    stay: Annotated[bool, typer.Option(help="Go on serving the dashboard at the end.")] = True,
    recorded: Annotated[
        bool, typer.Option("--recorded", help="Open a fleet that was recorded, in seconds.")
    ] = False,
) -> None:
    """Vehicles drive, report, and get a good and a bad update; ends with the dashboard's address."""
    from skidpad.recording.files import next_free, require_free

    with fleet_extra():
        from skidpad.cli.fleet.demo import Demo, enrol_fleet, open_recorded, play, pool, serving
    folder = next_free(Path("out/fleet")) if out is None else require_free(out)
    if recorded:
        with open_recorded(folder, port, typer.echo):
            _stay(stay, folder)
        return
    maker, operator, cars = enrol_fleet(folder, vehicles)
    with serving(folder / "data", port) as address, pool(workers) as drives:
        story = Demo(folder, address, maker, cars, seconds, drives, typer.echo)
        for one in play(story):
            typer.echo(f"{one['payload']}: {one['ended']}")
        for who, token in (("manufacturer", maker), ("operator", operator)):
            path = story.call(token, "POST", "/api/v1/session").json()["path"]
            typer.echo(f"dashboard of the {who}: {address}{path}")
        _stay(stay, folder)


def _stay(stay: bool, folder: Path) -> None:
    """Waits until Ctrl-C, or not at all where `stay` is False; says where the fleet stays."""
    if stay:
        typer.echo(f"Ctrl-C ends it; the fleet stays in {folder}")
        with suppress(KeyboardInterrupt):
            threading.Event().wait()
