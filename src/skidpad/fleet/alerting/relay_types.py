"""The kinds of alert relays that `skidpad fleet serve` can use, as entries of a registry."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from skidpad.core.errors import ConfigError
from skidpad.core.objects.registry import Registry
from skidpad.fleet.alerting.relays import Mqtt, Relay, Webhook
from skidpad.fleet.broker import Broker


@dataclass(frozen=True, slots=True)
class RelayHost:
    """What the service offers to the relays that it starts.

    Attributes:
        find_operator: Returns an operator's id by the tenant's name; ConfigError for an unknown one.
        hosts: The only hosts that a relay may send to over HTTP.
        broker: The MQTT broker of the service, where it has one.
    """

    find_operator: Callable[[str], str]
    hosts: Sequence[str] = ()
    broker: Broker | None = None


@dataclass(frozen=True, slots=True)
class RelayType:
    """A kind of alert relay.

    Attributes:
        name: The name of the kind, as `--relay NAME=SETTING` takes it.
        title: A few words for tables.
        units: What SETTING is.
        factory: `factory(setting, host)` returns a relay with `name`, `wants(operator)` and
            `send(alert)`; it raises ConfigError for a setting that cannot be used.
    """

    name: str
    title: str
    units: str
    factory: Callable[[str, RelayHost], Relay]


def make_webhook(setting: str, host: RelayHost) -> Relay:
    """Returns the webhook of a setting TENANT=URL; ConfigError for another form, tenant or host."""
    tenant, equals, url = setting.partition("=")
    if not equals:
        raise ConfigError(f"--webhook must read TENANT=URL, got {setting!r}")
    return Webhook(host.find_operator(tenant), url, host.hosts)


def make_mqtt(setting: str, host: RelayHost) -> Relay:
    """Returns the relay to the broker of the service; ConfigError without one. The setting is not read."""
    del setting
    if host.broker is None:
        raise ConfigError("the relay mqtt needs a broker: give --mqtt HOST[:PORT]")
    return Mqtt(host.broker)


RELAYS = Registry(
    "alert relay",
    "skidpad.relays",
    RelayType,
    lambda: (
        RelayType("webhook", "POST to an operator's server", "TENANT=URL", make_webhook),
        RelayType("mqtt", "Publish to an MQTT 5 broker", "the broker of --mqtt", make_mqtt),
    ),
)


def make_relays(asked: Sequence[str], host: RelayHost) -> list[Relay]:
    """Makes relays from texts NAME=SETTING, in their order."""
    found = []
    for text in asked:
        name, _, setting = text.partition("=")
        found.append(RELAYS.get(name).factory(setting, host))
    return found
