"""Seeded mutations of the numbers inside a recording's messages."""

from __future__ import annotations

import io
import random
from functools import cache
from typing import Any

from mcap.reader import make_reader
from mcap.writer import Writer

from skidpad.recording.channels import channels_pb2 as pb
from support.faults.mutation import NUMBERS


@cache
def messages(data: bytes) -> list[Any]:
    """Schema, channel and message of each record."""
    return list(make_reader(io.BytesIO(data)).iter_messages())


def mutated_messages(rng: random.Random, data: bytes) -> bytes:
    """A recording with other numbers in its messages, well packed."""
    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    schemas: dict[str, int] = {}
    topics: dict[str, int] = {}
    found = messages(data)
    harmed = {rng.randrange(len(found)) for _ in range(rng.choice((1, 3, len(found))))}
    for k, (schema, channel, message) in enumerate(found):
        if schema.name not in schemas:
            schemas[schema.name] = writer.register_schema(schema.name, schema.encoding, schema.data)
        if channel.topic not in topics:
            topics[channel.topic] = writer.register_channel(
                channel.topic, channel.message_encoding, schemas[schema.name]
            )
        body = message.data
        if k in harmed:
            parsed = getattr(pb, schema.name.removeprefix("skidpad.")).FromString(body)
            _harm(rng, parsed)
            body = parsed.SerializeToString()
        writer.add_message(topics[channel.topic], message.log_time, body, message.publish_time)
    writer.finish()
    return out.getvalue()


def _harm(rng: random.Random, message: Any) -> None:
    field = rng.choice(message.DESCRIPTOR.fields)
    value = getattr(message, field.name)
    if hasattr(value, "extend"):
        if value and rng.random() < 0.7:
            _put(rng, field, value, rng.randrange(len(value)))
        elif rng.random() < 0.5:
            del value[:]
        else:
            value.extend(list(value))
    elif field.message_type is None and not hasattr(value, "update"):
        number = rng.choice(NUMBERS)
        if field.cpp_type == field.CPPTYPE_DOUBLE:
            setattr(message, field.name, number)


def _put(rng: random.Random, field: Any, values: Any, i: int) -> None:
    if field.cpp_type in (field.CPPTYPE_DOUBLE, field.CPPTYPE_FLOAT):
        values[i] = rng.choice(NUMBERS)
    elif field.cpp_type != field.CPPTYPE_STRING:
        values[i] = rng.choice((0, 1, 3, 63, 64, 2**31 - 1))
