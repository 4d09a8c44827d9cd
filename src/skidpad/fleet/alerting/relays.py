"""Where alerts are relayed to: an operator's webhook, MQTT 5. None of them is trusted to answer."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Collection
from typing import Any, Protocol
from urllib.parse import urlsplit

import httpx

from skidpad.core.errors import BackendError, ConfigError
from skidpad.fleet.broker import Broker, connect_to, library
from skidpad.fleet.identity import digest
from skidpad.pages.server import is_local

TIMEOUT_S = 5.0  # of a webhook and of a broker, until its word is there


class Relay(Protocol):
    """Somewhere to relay alerts to."""

    name: str

    def wants(self, operator: str) -> bool:
        """Returns True when it takes alerts of that operator."""

    def send(self, alert: dict[str, Any]) -> None:
        """Relays one alert; BackendError when it was not taken."""


class Webhook:
    """A POST to an operator's own server; no other host, no redirect, no proxy."""

    def __init__(
        self, operator: str, url: str, hosts: Collection[str], timeout_s: float = TIMEOUT_S
    ) -> None:
        """ConfigError unless the host is allow-listed and, beyond this machine, the scheme https."""
        parts = urlsplit(url)
        host = parts.hostname or ""
        if host not in hosts:
            raise ConfigError(f"--webhook {url!r}: its host is not among --webhook-host")
        if parts.username or parts.password:
            raise ConfigError(f"--webhook: an address with a password is not taken ({host})")
        if parts.scheme != "https" and not (parts.scheme == "http" and is_local(host)):
            raise ConfigError(f"--webhook {url!r} must be https")
        self.operator, self.url, self.timeout_s = operator, url, timeout_s
        self.name = f"webhook {host} {digest(url.encode())[:8]}"  # a host may have several

    def wants(self, operator: str) -> bool:
        """Returns True for the alerts of its own operator only."""
        return operator == self.operator

    def send(self, alert: dict[str, Any]) -> None:
        """Posts an alert as JSON; BackendError when none or no 2xx status comes within `timeout_s`."""
        try:
            status = asyncio.run(asyncio.wait_for(self._post(alert), self.timeout_s))
        except (httpx.HTTPError, asyncio.TimeoutError) as error:
            raise BackendError(f"{self.name}: {type(error).__name__}") from error
        if not 200 <= status < 300:
            raise BackendError(f"{self.name}: answered {status}")

    async def _post(self, alert: dict[str, Any]) -> int:
        """Posts the alert and returns the status of the answer, whose body is not read."""
        async with (
            httpx.AsyncClient(
                timeout=self.timeout_s, follow_redirects=False, trust_env=False
            ) as client,
            client.stream("POST", self.url, json=alert) as answer,
        ):
            return answer.status_code


class Mqtt:
    """Publishes to skidpad/<operator>/alerts, at least once (QoS 1)."""

    def __init__(self, broker: Broker, timeout_s: float = TIMEOUT_S) -> None:
        """MissingExtra without aiomqtt."""
        self._library, self.broker, self.timeout_s = library(), broker, timeout_s
        self.name = "mqtt"

    def wants(self, operator: str) -> bool:
        """Returns True for any operator with an id, as each has a topic."""
        return bool(operator)

    def send(self, alert: dict[str, Any]) -> None:
        """Connects, publishes, and waits for the broker's word; BackendError when it does not come."""
        try:
            asyncio.run(self._publish(alert))
        except (self._library.MqttError, OSError, TimeoutError) as error:
            raise BackendError(f"mqtt: {error}") from error

    async def _publish(self, alert: dict[str, Any]) -> None:
        """Publishes the alert on its operator's topic, at least once (QoS 1)."""
        async with connect_to(self.broker, self.timeout_s) as client:
            topic = f"skidpad/{alert['operator']}/alerts"
            await client.publish(topic, json.dumps(alert), qos=1)
