"""What an update may hold: data that a vehicle's monitor reads, checked by the reader it is for."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from skidpad.core.errors import InputError
from skidpad.core.text.told import on_a_line
from skidpad.evidence.channels.choices import Identify
from skidpad.evidence.channels.hazards import default_form, load_only_rules
from skidpad.evidence.channels.identifier.model import load_model
from skidpad.evidence.channels.indicators.catalogue import load_thresholds
from skidpad.evidence.channels.indicators.settings import IndicatorSettings
from skidpad.evidence.channels.monitor import MonitorSettings
from skidpad.fleet.identity import digest
from skidpad.fleet.words import Refused

PAYLOAD_MAX = 64 * 1024 * 1024  # bytes


class PayloadKind(str, Enum):
    """Kinds of data; code and pickles are none."""

    RULES = "rules"  # hazard rules (YAML)
    THRESHOLDS = "thresholds"  # of the indicators (YAML)
    MODEL = "model"  # of the learned identifier (.npz, arrays and JSON)


SUFFIX = {PayloadKind.RULES: "yaml", PayloadKind.THRESHOLDS: "yaml", PayloadKind.MODEL: "npz"}


def _rule_settings(path: Path) -> dict[str, Any]:
    """Returns a monitor's settings from a file of rules: profile, rules and indicators."""
    profile, rules = load_only_rules(path)
    indicators = IndicatorSettings(form=default_form(profile))
    return {"profile": profile, "rules": rules, "indicators": indicators}


_READERS: dict[PayloadKind, Callable[[Path], dict[str, Any]]] = {
    PayloadKind.RULES: _rule_settings,
    PayloadKind.THRESHOLDS: lambda path: {"thresholds": load_thresholds(path)},
    PayloadKind.MODEL: lambda path: {
        "identify": Identify.BOTH, "detectors": load_model(path).identifier(),
    },
}  # fmt: skip


def payload_name(kind: PayloadKind, content: bytes) -> str:
    """Returns the name of an update: kind and digest, so that two different ones never share it."""
    return f"{kind.value}-{digest(content)[:24]}.{SUFFIX[kind]}"


def read_payload(kind: PayloadKind, path: Path) -> MonitorSettings:
    """Returns a monitor's settings under the update at `path`; FileError or ConfigError when it is none."""
    return MonitorSettings(**_READERS[kind](path))


def read_payload_content(kind: PayloadKind, content: bytes) -> MonitorSettings:
    """Returns the settings as `read_payload`; Refused (413, 422) for what a vehicle would not take."""
    if len(content) > PAYLOAD_MAX:
        raise Refused(413, f"an update may have {PAYLOAD_MAX} bytes")
    if kind is not PayloadKind.MODEL and b"&" in content:
        raise Refused(422, "an update in YAML may not use anchors")
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"payload.{SUFFIX[kind]}"
        path.write_bytes(content)
        try:
            return read_payload(kind, path)
        except InputError as error:
            raise Refused(422, f"the update is not valid: {on_a_line(error)}") from error
