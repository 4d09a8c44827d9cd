"""Seeded mutations of files: bytes of any kind, and the elements and attributes of XML."""

from __future__ import annotations

import random
import re

import numpy as np
from lxml import etree

WORDS = (
    b"", b"nan", b"inf", b"-inf", b"-1", b"0", b"-0.0", b"1e308", b"1e999", b"1e-320", b"3.5",
    b"2147483648", b"9" * 30, b"9" * 5000, b"\xc2\xb2", b"\xd9\xa3", b"null", b"true", b"[]", b"{}",
    b"[1, 2]", b"\x00", b"\xff\xfe", b"../../x", b"x" * 5000, b"\xed\xa0\x80", b"!!binary", b"*a", b"&a",
    b"'", b'"', b"2001-99-99", b"$x", b"${1/0}", b"$" + b"-" * 3000 + b"1", b"completed",
)  # fmt: skip
TEXTS = tuple(word.decode("utf-8", "ignore").replace("\x00", "") for word in WORDS)
TOKEN = re.compile(rb"[-+]?\d[\w.+-]*|\w+")
NEAR = 300  # bytes
NUMBERS = (
    0.0, -1.0, 1.0, 0.5, np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 1e9, -1e9, 1e18, 7.0,
)  # fmt: skip


def mutated(rng: random.Random, data: bytes) -> bytes:
    """One to three mutations of bytes, by what the content looks like or blindly."""
    for _ in range(rng.randint(1, 3)):
        data = rng.choice(OPERATIONS)(rng, data)
    return data


def _flip(rng: random.Random, data: bytes) -> bytes:
    if not data:
        return b"\x00"
    i = rng.randrange(len(data))
    return data[:i] + bytes([data[i] ^ rng.randrange(1, 256)]) + data[i + 1 :]


def _span(rng: random.Random, data: bytes) -> tuple[int, int]:
    i = rng.randrange(len(data) + 1)
    return i, min(len(data), i + rng.choice((1, 4, 30, 1000)))


def _cut(rng: random.Random, data: bytes) -> bytes:
    i, j = _span(rng, data)
    return data[:i] + data[j:]


def _twice(rng: random.Random, data: bytes) -> bytes:
    i, j = _span(rng, data)
    return data[:j] + data[i:j] * rng.choice((1, 1, 50)) + data[j:]


def _shorten(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _insert(rng: random.Random, data: bytes) -> bytes:
    i = rng.randrange(len(data) + 1)
    return data[:i] + rng.choice(WORDS) + data[i:]


def _replace(rng: random.Random, data: bytes) -> bytes:
    token = _token(rng, data)
    if token is None:
        return _flip(rng, data)
    found = _token(rng, data) if rng.random() < 0.3 else None
    other = found[0] if found else rng.choice(WORDS)
    return data[: token.start()] + other + data[token.end() :]


def _token(rng: random.Random, data: bytes) -> re.Match[bytes] | None:
    """A number or word near a place; a long file is not searched whole."""
    i = rng.randrange(len(data) + 1)
    found = list(TOKEN.finditer(data, max(0, i - NEAR), i + NEAR))
    return rng.choice(found) if found else None


def _nest(rng: random.Random, data: bytes) -> bytes:
    i = rng.randrange(len(data) + 1)
    left, right = rng.choice(((b"[", b"]"), (b'{"a":', b"}"), (b"(", b")"), (b"- ", b"")))
    n = rng.choice((3, 100, 3000))
    return data[:i] + left * n + right * n + data[i:]


OPERATIONS = (_flip, _flip, _cut, _twice, _shorten, _insert, _replace, _replace, _replace, _nest)


def mutated_xml(rng: random.Random, data: bytes) -> bytes:
    """Elements removed, repeated or moved, and attributes with other values."""
    root = etree.fromstring(data)
    for _ in range(rng.randint(1, 3)):
        nodes = [n for n in root.iter() if isinstance(n.tag, str)]
        node, what = rng.choice(nodes), rng.randrange(6)
        if what == 0 and node.getparent() is not None:
            node.getparent().remove(node)
        elif what == 1 and node.getparent() is not None:
            node.getparent().append(etree.fromstring(etree.tostring(node)))
        elif what == 2 and len(node):
            node.append(etree.fromstring(etree.tostring(rng.choice(nodes[1:] or nodes))))
        elif node.attrib:
            name = rng.choice(sorted(node.attrib))
            if what == 3:
                del node.attrib[name]
            else:
                other = rng.choice(nodes)
                texts = [*TEXTS, *map(str, other.attrib.values())]
                node.set(name, "".join(c for c in rng.choice(texts) if c >= " "))
    return etree.tostring(root)
