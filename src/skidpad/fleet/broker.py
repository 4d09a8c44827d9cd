"""An MQTT 5 broker, and what a request over it looks like."""

from __future__ import annotations

import ssl
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from skidpad.core.errors import ConfigError, MissingExtra
from skidpad.pages.server import is_local

TOPIC = "skidpad/batches"  # and the kind of a batch
ANSWERS = "skidpad/answers"  # and a name that the vehicle draws
ANSWER_MAX = 1024 * 1024  # bytes of a receipt: 2000 ids and room


@dataclass(frozen=True, slots=True, kw_only=True)
class Broker:
    """Address and credentials of an MQTT broker."""

    host: str
    port: int = 1883
    user: str | None = None
    password: str | None = None
    ca: Path | None = None  # PEM; given: TLS

    def __post_init__(self) -> None:
        if self.ca is None and not is_local(self.host):
            raise ConfigError(f"--mqtt {self.host} leaves this machine and needs --mqtt-ca")


def library() -> ModuleType:
    """Returns the library aiomqtt; MissingExtra without it."""
    try:
        import aiomqtt
    except ImportError as error:
        raise MissingExtra("--mqtt", "fleet") from error
    return aiomqtt


def connect_to(
    broker: Broker, timeout_s: float, largest: int = ANSWER_MAX, waiting: int = 1
) -> AbstractAsyncContextManager[Any]:
    """Returns a client as context that connects by MQTT 5 when entered.

    largest: bytes of a message that the broker may pass on. waiting: messages kept until looked at.
    """
    aiomqtt = library()
    tls = None if broker.ca is None else ssl.create_default_context(cafile=str(broker.ca))
    client: AbstractAsyncContextManager[Any] = aiomqtt.Client(
        broker.host, broker.port, username=broker.user, password=broker.password,
        timeout=timeout_s, protocol=aiomqtt.ProtocolVersion.V5, tls_context=tls,
        properties=_properties("CONNECT", MaximumPacketSize=largest),
        max_queued_incoming_messages=waiting,
    )  # fmt: skip
    return client


def request_properties(answer_to: str, told: dict[str, str]) -> Any:
    """Returns MQTT 5 properties of a vehicle's message: response topic, key, and `told` as user's own."""
    return properties(
        ResponseTopic=answer_to, CorrelationData=told["key"].encode(), UserProperty=[*told.items()]
    )


def properties(**values: Any) -> Any:
    """Returns MQTT 5 properties of a message to publish, by their names."""
    return _properties("PUBLISH", **values)


def _properties(packet: str, **values: Any) -> Any:
    """Returns MQTT 5 properties for a type of packet, such as "CONNECT", with these values."""
    from paho.mqtt.packettypes import PacketTypes
    from paho.mqtt.properties import Properties

    kind: Any = Properties
    found = kind(getattr(PacketTypes, packet))
    for name, value in values.items():
        setattr(found, name, value)
    return found
