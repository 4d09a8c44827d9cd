"""Unpacking what was sent, never further than the limits allow."""

from __future__ import annotations

import zlib

from skidpad.core.text.told import on_a_line
from skidpad.fleet.words import Limits, Refused

GZIP = 16 + zlib.MAX_WBITS  # window bits by which zlib reads gzip and nothing else
FREE = 1024 * 1024  # bytes unpacked below which no ratio is asked for


def unpack(body: bytes, limits: Limits) -> bytes:
    """Returns the content of one gzip member; Refused (400, 413) when it is none, cut, or too large.

    At most the allowed size is ever produced, however much the body would unpack to.
    """
    if len(body) > limits.body:
        raise Refused(413, f"a body may have {limits.body} bytes, this one has {len(body)}")
    allowed = min(limits.unpacked, max(FREE, limits.ratio * len(body)))
    reader = zlib.decompressobj(GZIP)
    try:
        content = reader.decompress(body, allowed + 1)
    except zlib.error as error:
        raise Refused(400, f"the body is not gzip ({on_a_line(error)})") from error
    if len(content) > allowed:
        raise Refused(413, f"the body unpacks to more than {allowed} bytes")
    if not reader.eof or reader.unused_data:
        raise Refused(400, "the body must be one whole gzip member")
    return content
