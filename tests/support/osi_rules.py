"""ASAM's rules for OSI messages: read from the comments of its own definitions, as betterosi ships them.

ASAM's own checker, qc-osi-trace, is in no package registry. A rule is read as it reads it: within one
message of a trace, and every `check_if` by itself. A list has no presence in Protocol Buffers, so that
it counts as set under `check_if`: the outermost lane has no neighbour.
"""

from __future__ import annotations

import operator
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from google.protobuf.descriptor_pb2 import DescriptorProto, FileDescriptorSet
from google.protobuf.message import Message

from support.asam import require_asam_python

VERSION = "3.8.0"
Rules = dict[str, dict[str, list[str]]]  # of fields of messages
COMPARISONS: dict[str, Callable[[Any, Any], bool]] = {
    "is_greater_than": operator.gt,
    "is_greater_than_or_equal_to": operator.ge,
    "is_less_than": operator.lt,
    "is_less_than_or_equal_to": operator.le,
    "is_equal_to": operator.eq,
    "is_different_to": operator.ne,
}
WHERE = re.compile(r"check_if this\.(\w+) (\w+) (\w+) else do_check is_set")
WORDS = {"true": "1", "false": "0"}


def read_rules() -> Rules:
    """Returns the rules by message and field; skips the test where they are not installed."""
    above = Path(require_asam_python()).parents[1]
    name = f"lib/python3*/site-packages/betterosi/generated/{VERSION}/osi3_descriptor_set.pb"
    found = next(above.glob(name), None)
    if found is None:
        pytest.skip(
            "the environment of the ASAM checkers has no betterosi, which holds ASAM's rules"
        )
    rules: Rules = {}
    for file in FileDescriptorSet.FromString(found.read_bytes()).file:
        for place in file.source_code_info.location:
            blocks = re.findall(r"\\rules(.*?)\\endrules", place.leading_comments, re.DOTALL)
            lines = [line.strip() for block in blocks for line in block.strip().splitlines()]
            if lines:
                message, field = _named(file.message_type, list(place.path))
                rules.setdefault(f"osi3.{message}", {})[field] = lines
    return rules


def _named(messages: Iterable[DescriptorProto], path: list[int]) -> tuple[str, str]:
    """Returns the names of the message and the field that a path of a definition leads to."""
    held, names = list(messages), []
    while True:
        message = held[path[1]]
        names.append(message.name)
        path = path[2:]
        if path[0] == 2:
            return ".".join(names), message.field[path[1]].name
        held = list(message.nested_type)


def _all(message: Message) -> Iterator[Message]:
    """Yields a message and those in it."""
    yield message
    for field, value in message.ListFields():
        if field.message_type is not None:
            for part in [value] if isinstance(value, Message) else value:
                yield from _all(part)


def broken_rules(rules: Rules, message: Message) -> list[str]:
    """Returns what a message of a trace breaks."""
    parts = list(_all(message))
    held = [p for p in parts if "id" in p.DESCRIPTOR.fields_by_name and p.HasField("id")]
    ids = Counter(p.id.value for p in held)
    kinds = {p.id.value: p.DESCRIPTOR.full_name for p in held}
    broken = []
    for part in parts:
        for field, lines in rules.get(part.DESCRIPTOR.full_name, {}).items():
            held_by = getattr(part, field)
            is_list = part.DESCRIPTOR.fields_by_name[field].is_repeated
            if is_list:
                values = list(held_by)
                lines = [line for line in lines if not line.startswith("check_if")]
            else:
                values = [held_by] if part.HasField(field) else []
            for line in lines:
                if not _keeps(part, line, values, ids, kinds):
                    broken.append(f"{part.DESCRIPTOR.full_name}.{field}: {line}: {values}"[:200])
    return broken


def _keeps(
    part: Message, line: str, values: list[Any], ids: Counter[int], kinds: dict[int, str]
) -> bool:
    """Returns whether the values of a field, none where it is not set, keep a rule."""
    rule, _, bound = line.partition(": ")
    if line == "is_set":
        return bool(values)
    if where := WHERE.fullmatch(line):
        other, how, what = where.groups()
        asked = float(WORDS.get(what, what))
        holds = part.HasField(other) and COMPARISONS[how](getattr(part, other), asked)
        return bool(values) or not holds
    if line == "is_globally_unique":
        return all(ids[v.value] <= 1 for v in values)
    if rule == "refers_to":
        return all(kinds.get(v.value) == f"osi3.{bound}" for v in values)
    if line == "is_iso_country_code":
        return all(0 <= v <= 999 for v in values)
    return all(COMPARISONS[rule](v, float(bound)) for v in values)
