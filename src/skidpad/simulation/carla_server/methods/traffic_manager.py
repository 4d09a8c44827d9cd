"""Where clients' Traffic Managers listen; none of these calls may ever fail."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server.protocol.rpc import Table
from skidpad.simulation.carla_server.served import Served

TABLE = Table("traffic manager")
MOST = 1000


@TABLE.method("is_traffic_manager_running")
def is_traffic_manager_running(served: Served, port: Any) -> bool:
    """Returns whether a Traffic Manager has registered with this port."""
    return port in served.managers.by_port if isinstance(port, int) else False


@TABLE.method("get_traffic_manager_running")
def get_traffic_manager_running(served: Served, port: Any) -> list[Any]:
    """Returns address and port of a Traffic Manager that runs; ["", 0] where there is none."""
    known = served.managers.by_port.get(port) if isinstance(port, int) else None
    return ["", 0] if known is None else [known, port]


@TABLE.method("add_traffic_manager_running")
def add_traffic_manager_running(served: Served, address: Any) -> bool:
    """Registers a Traffic Manager; returns False when the port is taken, or MOST are there."""
    if not (isinstance(address, list) and len(address) == 2 and isinstance(address[1], int)):
        return False
    known = served.managers.by_port
    if address[1] in known or len(known) >= MOST:
        return False
    known[address[1]] = str(address[0])[:256]
    return True


@TABLE.method("destroy_traffic_manager")
def destroy_traffic_manager(served: Served, port: Any) -> bool:
    """Forgets the Traffic Manager of this port; returns whether there was one."""
    return isinstance(port, int) and served.managers.by_port.pop(port, None) is not None
