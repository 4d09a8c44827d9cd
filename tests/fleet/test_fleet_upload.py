"""The vehicle's side: nothing is lost off line or by a kill, nothing is kept twice."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx
import polars as pl
import pytest
from sqlalchemy import select
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.fleet.monitored import Lookout, hazard_batches, indicator_rows, spool_folder
from skidpad.fleet.service import Places, open_store
from skidpad.fleet.spool import Spool
from skidpad.fleet.store.accounts import principal_of
from skidpad.fleet.store.tables import drives, hazards
from skidpad.fleet.uploader import poster, rounds, send, send_all
from skidpad.fleet.words import Kind
from skidpad.recording.channels.indicators import Column, IndicatorLog
from skidpad.recording.channels.monitored import write_summary
from skidpad.recording.hazards.records import HazardWriter
from support.fleet_server import start_fleet
from support.fleet_world import record

RUN = CliRunner()


def monitored(folder: Path, n: int = 3, seed: int = 0) -> Path:
    """A folder as `skidpad monitor` leaves it."""
    with HazardWriter(folder) as writer:
        for k in range(n):
            writer.write(record(100 * seed + k))
    log = IndicatorLog([Column("channel_agreement", "a+b", None, False, None)])
    for k in range(700):
        log.add(k, k * 0.1, [0.5 if k < 600 else float("nan")])
    log.write(folder)
    summary = {"seconds": 70.0, "cycles": 700, "context": {"map": "town", "seed": str(seed)}}
    write_summary(folder, summary)
    return folder


def through(world, name="red-1"):
    world.client.headers.update(world.headers(name))
    return poster(world.client, world.clock)


@pytest.mark.req("C-151", "C-170", "C-171", "C-194")
def test_a_monitored_drive_reaches_the_store_whole(world, tmp_path):
    spool = Spool(tmp_path / "spool")
    keys = spool_folder(spool, monitored(tmp_path / "m"), "release-7")
    sent = send(spool, through(world))
    assert (sent.acknowledged, sent.refused, sent.waiting) == (3, 0, 0)
    with world.fleet.engine.connect() as connection:
        drive = connection.execute(select(drives)).one()
        rows = connection.execute(select(hazards.c.id, hazards.c.drive)).all()
    assert (drive.seconds, drive.map, drive.release) == (70.0, "town", "release-7")
    assert {row.drive for row in rows} == {drive.drive}
    receipts = spool.read_receipts()
    assert {i for k in keys for i in receipts[k]["ids"]} == {row.id for row in rows}
    assert spool_folder(spool, tmp_path / "m", "release-7") == keys  # again: nothing waits
    assert spool.count() == 0


@pytest.mark.req("C-151", "C-171")
def test_drives_are_sent_periodically_each_once_when_it_is_complete(lite, tmp_path):
    """Every round: one drive more, and one that its monitor has not finished."""
    spool, drives, pauses = Spool(tmp_path / "spool"), tmp_path / "drives", []
    (drives / "unfinished").mkdir(parents=True)

    def pause(seconds):
        pauses.append(seconds)
        monitored(drives / f"drive-{len(pauses)}", seed=len(pauses))

    lookout = Lookout([drives])
    sending = rounds(lambda: lookout.spool(spool), lambda: send(spool, through(lite)), 60.0, pause)
    sent = [next(sending).acknowledged for _ in range(4)]
    assert (sent, pauses) == ([0, 3, 3, 3], [60.0] * 3)
    assert len(lite.get("red operator", "/api/v1/hazards").json()) == 9


def test_off_line_everything_waits_and_goes_when_somebody_answers(lite, tmp_path):
    spool, post, pauses = Spool(tmp_path / "spool"), through(lite), []
    spool_folder(spool, monitored(tmp_path / "m"))

    def away(batch):
        raise httpx.ConnectError("no route to host")

    def sometimes(batch):
        return away(batch) if len(pauses) < 4 else post(batch)

    assert send(spool, away).waiting == 3
    sent = send_all(spool, sometimes, 1e6, pauses.append)
    assert (sent.acknowledged, sent.waiting) == (3, 0)
    assert pauses == [2.0, 4.0, 8.0, 16.0]
    spool_folder(spool, monitored(tmp_path / "m2", seed=1))
    assert send_all(spool, away, 10.0, pauses.append).waiting == 3  # gives up, keeps


def test_a_page_in_place_of_the_fleet_keeps_what_waits(tmp_path):
    """A wireless network answers 200 with its log-in page; the raw ValueError ended the vehicle's sender."""
    spool = Spool(tmp_path / "spool")
    spool_folder(spool, monitored(tmp_path / "m"))
    for page in ("<html>please log in</html>", "[]"):
        sent = send(spool, lambda batch, page=page: httpx.Response(200, text=page))
        assert (sent.acknowledged, sent.refused, sent.waiting) == (0, 0, 3)


def test_an_answer_that_was_lost_is_given_again(lite, tmp_path):
    """The commit happened, the answer did not arrive: the next sending gets the same ids."""
    spool, post = Spool(tmp_path / "spool"), through(lite)
    spool_folder(spool, monitored(tmp_path / "m"))
    answers = []

    def deaf(batch):
        answers.append(post(batch).json())
        raise httpx.ReadTimeout("lost")

    assert send(spool, deaf).acknowledged == 0
    assert send(spool, post).acknowledged == 3
    first = answers[0]
    assert any(
        r["batch"] == first["batch"] and r["ids"] == first["ids"]
        for r in spool.read_receipts().values()
    )


def test_what_will_never_be_taken_is_set_aside_and_the_rest_goes_on(lite, tmp_path):
    spool = Spool(tmp_path / "spool")
    spool_folder(spool, monitored(tmp_path / "m"))
    (spool.waiting / "broken.batch").write_bytes(b"no head")
    bad = spool.add_batch(Kind.DRIVE, b"[]")
    sent = send(spool, through(lite))
    assert (sent.acknowledged, sent.refused, sent.waiting) == (3, 1, 0)
    assert sorted(p.name for p in spool.waiting.iterdir()) == sorted(
        [f"{bad}.refused", "broken.damaged"]
    )


def test_batches_and_rows_hold_what_the_folder_holds(tmp_path):
    folder = monitored(tmp_path / "m", n=205)
    sizes = [batch.count(b"\nZ\n") for batch in hazard_batches(folder)]
    assert sizes == [100, 100, 5]
    rows = [
        json.loads(line)
        for line in indicator_rows(pl.read_parquet(folder / "indicators.parquet")).splitlines()
    ]
    assert [(r["minute"], r["n"], r["mean"]) for r in rows] == [(0, 600, 0.5)]


SPOOLER = """
import sys
import time
from pathlib import Path
from skidpad.fleet.service import Places, open_store
from skidpad.fleet.spool import Spool
from skidpad.fleet.store.accounts import principal_of
from skidpad.fleet.words import Kind
spool = Spool(Path(sys.argv[1]))
for k in range(100000):
    spool.add_batch(Kind.DRIVE, b"x" * k)
    print(k, flush=True)
"""


def test_a_killed_vehicle_keeps_what_it_had_spooled(tmp_path):
    """kill -9 at some moment: all that was said to be kept is whole, and nothing damaged is sent."""
    child = subprocess.Popen(
        [sys.executable, "-c", SPOOLER, str(tmp_path)], stdout=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
    )  # fmt: skip
    with child:
        said = [int(child.stdout.readline()) for _ in range(40)]
        os.kill(child.pid, signal.SIGKILL)
    spool = Spool(tmp_path)
    batches = list(spool.batches())
    assert len(batches) >= len(said)
    import gzip

    kept = {len(gzip.decompress(b.body)) for b in batches}
    assert set(said) <= kept
    assert not list(spool.waiting.glob("*.damaged"))


def invoke(*words: str):
    result = RUN.invoke(app, ["fleet", *words])
    assert result.exit_code == 0, (result.output, result.exception)
    return result.output.strip()


def test_a_server_killed_at_any_moment_keeps_what_it_acknowledged(tmp_path):
    """Over HTTPS with an authority of one's own, by the commands that people use."""
    data, tls = tmp_path / "data", tmp_path / "tls"
    invoke("certificate", "--out", str(tls))
    token = tmp_path / "token"
    token.write_text(
        invoke(
            "enrol",
            "vehicle",
            "V1",
            "--tenant",
            "red",
            "--manufacturer",
            "axle",
            "--data",
            str(data),
        )
    )
    folders = [str(monitored(tmp_path / f"m{k}", seed=k)) for k in range(6)]
    words = ("--certificate", str(tls / "server.pem"), "--key", str(tls / "server.key"))
    for first in (0, 2, 4):
        child, address = start_fleet(data, *words)
        with child:
            try:
                stranger = invoke(
                    "upload", *folders[:1], "--to", address, "--spool", str(tmp_path / "other"),
                    "--token-file", str(token),
                )  # fmt: skip
                assert stranger.startswith("0 acknowledged, 0 refused")  # whose certificate is it?
                said = invoke(
                    "upload", *folders[first : first + 2], "--to", address,
                    "--spool", str(tmp_path / "spool"), "--token-file", str(token),
                    "--ca", str(tls / "ca.pem"), "--wait", "600",
                )  # fmt: skip
                assert said == "6 acknowledged, 0 refused, 0 waiting"
            finally:
                os.kill(child.pid, signal.SIGKILL)
    acknowledged = {i for r in Spool(tmp_path / "spool").read_receipts().values() for i in r["ids"]}
    engine = open_store(Places(data=data))
    with engine.connect() as connection:
        stored = set(connection.execute(select(hazards.c.id)).scalars())
    engine.dispose()
    assert acknowledged == stored
    assert len(stored) == 18
    assert invoke("upload", *folders, "--to", address, "--spool", str(tmp_path / "spool"),
                  "--token-file", str(token), "--ca", str(tls / "ca.pem")).startswith("0 ack")  # fmt: skip


def test_commands_refuse_in_one_sentence(tmp_path):
    def refused(*words):
        result = RUN.invoke(app, ["fleet", *words])
        assert result.exit_code == 1
        return str(result.exception)

    data = ("--data", str(tmp_path / "d"))
    assert "leaves this machine" in refused("serve", *data, "--host", "0.0.0.0")
    assert "unknown role" in refused("enrol", "king", "K", "--tenant", "t", *data)
    assert "--manufacturer is needed" in refused("enrol", "vehicle", "V", "--tenant", "t", *data)
    to = ("--spool", str(tmp_path / "s"), "--token-file", str(tmp_path / "none"))
    for url in (
        "http://example.org", "http://127.0.0.1.example.org", "http://localhost.example.org",
        "http://127.0.0.1@example.org", "https://user:word@example.org", "ftp://127.0.0.1",
    ):  # fmt: skip
        assert "must be https" in refused("upload", "--to", url, *to), url
    assert "cannot be read" in refused("upload", "--to", "https://example.org", *to)


def test_a_credential_is_ended_and_renewed_by_a_command(tmp_path):
    who = ("vehicle", "V1", "--tenant", "red", "--data", str(tmp_path / "d"))
    first = invoke("enrol", *who, "--manufacturer", "axle")
    second = invoke("end", *who, "--renew")
    engine = open_store(Places(data=tmp_path / "d"))

    def known(token: str):
        with engine.connect() as connection:
            return principal_of(connection, token, time.time())

    assert known(first) is None
    vehicle = known(second)
    assert vehicle.name == "V1"
    assert invoke("end", *who) == "1 credential ended"  # the first one had ended before
    assert known(second) is None
    engine.dispose()
    unknown = RUN.invoke(app, ["fleet", "end", "operator", "V1", *who[2:]])
    assert "has no operator" in str(unknown.exception)
