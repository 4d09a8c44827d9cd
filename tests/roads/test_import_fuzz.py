"""Damaged files either bake or are refused with a FileError; nothing else may happen."""

from __future__ import annotations

import copy
from contextlib import suppress

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

from skidpad.core.errors import FileError
from skidpad.roads.bundled import FOLDER
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.queries import RoadMap
from support.examples import examples

ROOT = etree.fromstring((FOLDER / "town.xodr").read_bytes())
for surplus in ROOT.findall("road")[12:]:
    ROOT.remove(surplus)
TEXTS = st.sampled_from(["", "x", "nan", "inf", "-1", "0", "1e308", "99999999999", "2", "-0.5"])


@given(st.data())
@settings(max_examples=examples(150), suppress_health_check=list(HealthCheck))
def test_damaged_files_are_refused_or_baked(data: st.DataObject) -> None:
    root = copy.deepcopy(ROOT)
    nodes = list(root.iter())
    for _ in range(data.draw(st.integers(1, 3))):
        node = nodes[data.draw(st.integers(1, len(nodes) - 1))]
        if data.draw(st.booleans()) and node.getparent() is not None:
            node.getparent().remove(node)
        elif node.attrib:
            name = data.draw(st.sampled_from(sorted(node.attrib)))
            if data.draw(st.booleans()):
                node.attrib.pop(name)
            else:
                node.set(name, data.draw(TEXTS))
    with suppress(FileError), np.errstate(all="ignore"):
        baked = bake(etree.tostring(root), "damaged")
        map = RoadMap(baked)
        assert map.project(1e4, 1e4, 0.0) is None
