"""The server itself, asked over sockets; and NiceGUI behind it, in a process of its own."""

import http.client
import os
import socket
import subprocess
import sys

import pytest

from skidpad.core.errors import ConfigError, SkidpadError
from skidpad.pages.server import Place, Server, bind_socket, host_headers

pytest.importorskip("nicegui", reason="nicegui is not installed (extra cockpit)")


async def hello(scope, receive, send):
    if scope["type"] == "http":
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"hello"})
    elif scope["type"] == "lifespan":
        await receive()
        await send({"type": "lifespan.startup.complete"})
        await receive()
        await send({"type": "lifespan.shutdown.complete"})


def get(port, path, **headers):
    asked = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    asked.request("GET", path, headers=headers)
    answer = asked.getresponse()
    try:
        return answer.status, answer.headers, answer.read()
    finally:
        asked.close()


def entered(address):
    """The cookie that an address gives."""
    host, _, path = address.removeprefix("http://").partition("/")
    status, told, _ = get(int(host.rpartition(":")[2]), "/" + path)
    assert status == 303
    return told["set-cookie"].partition(";")[0]


def test_a_server_knows_its_port_and_ends():
    with Server(hello) as server:
        assert get(server.port, "/")[0] == 403
        cookie = entered(server.address())
        assert get(server.port, "/", Cookie=cookie)[::2] == (200, b"hello")
        port = server.port
    with pytest.raises(ConnectionRefusedError):
        get(port, "/")
    server.stop()


def test_a_port_in_use_is_one_sentence():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(
            ConfigError, match=f"^port {port} of 127.0.0.1 is in use: .*, or 0 for any free one$"
        ):
            Server(hello, Place(port=port))
    first = bind_socket("127.0.0.1", 0)
    with pytest.raises(ConfigError, match="is in use"):  # also by one that was not started yet
        bind_socket("127.0.0.1", first.getsockname()[1])
    first.close()
    for wrong in (-1, 65536):
        with pytest.raises(ConfigError, match="port must be between 0 and 65535"):
            bind_socket("127.0.0.1", wrong)


def test_a_server_that_cannot_begin_says_so():
    async def broken(scope, receive, send):
        await receive()
        await send({"type": "lifespan.startup.failed", "message": "no"})

    with pytest.raises(SkidpadError, match="did not start"):
        Server(broken).start()


def test_names_of_a_host():
    assert "localhost:80" in host_headers("127.0.0.1", 80, ())
    assert "localhost" in host_headers("127.0.0.1", 80, ())
    assert host_headers("0.0.0.0", 8000, ("Fleet.example",)) >= {"fleet.example", "127.0.0.1:8000"}
    assert host_headers("10.0.0.7", 8000, ()) == {"10.0.0.7:8000"}
    assert "[::1]:8000" in host_headers("::1", 8000, ())


def handshake(port, **headers):
    """Ask NiceGUI's socket to open; 101 says that it did."""
    upgrade = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    asked = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    path = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    asked.request("GET", path, headers=upgrade | headers)
    try:
        return asked.getresponse().status
    finally:
        asked.close()


PROGRAM = """
import sys
from nicegui import ui
from skidpad.pages.server import Server
from skidpad.pages.site import site

def page():
    ui.label("a page of skidpad")

def routes(app):
    @app.get("/own")
    def own():
        return {"own": True}

with Server(site("test", {"/": page}, routes=routes)) as server:
    print(server.address(), flush=True)
    sys.stdin.read()
"""


def test_nicegui_lives_behind_the_guard(tmp_path):
    env = {k: v for k, v in os.environ.items() if k != "PYTEST_CURRENT_TEST"}
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        cwd=tmp_path, env=env,
    ) as process:  # fmt: skip
        address = process.stdout.readline().strip()
        host = address.removeprefix("http://").partition("/")[0]
        port = int(host.rpartition(":")[2])
        cookie = entered(address)
        status, _, page = get(port, "/", Cookie=cookie)
        assert status == 200
        assert b"a page of skidpad" in page
        assert b"https://" not in page.replace(b"https://nicegui.io", b"")  # nothing from elsewhere
        assert get(port, "/own", Cookie=cookie)[2] == b'{"own":true}'
        assert get(port, "/own")[0] == 403
        ours, theirs = f"http://{host}", "http://evil.example"
        assert handshake(port, Origin=ours) == 403
        assert handshake(port, Origin=theirs, Cookie=cookie) == 403
        assert handshake(port, Cookie=cookie) == 403
        assert handshake(port, Origin=ours, Cookie=cookie) == 101
        process.stdin.close()
        assert process.wait(timeout=60) == 0
    assert list(tmp_path.iterdir()) == []  # NiceGUI leaves nothing behind
