"""The live scene: what is sent, read back through its own schema."""

from __future__ import annotations

import json
import socket

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

foxglove = pytest.importorskip("foxglove", reason="foxglove is not installed")
from mcap.reader import make_reader  # noqa: E402

from skidpad.core.channels import Decision  # noqa: E402
from skidpad.live.scene import ScenePublisher  # noqa: E402
from support.channel_worlds import frame  # noqa: E402

EGO = (1.0, 2.0, np.pi / 2, 0.0, 5.0)


def decoded(schema, data):
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
    return kind.FromString(data)


@pytest.mark.req("C-202")
def test_every_cycle_has_every_channels_world_and_who_drives(tmp_path):
    publisher = ScenePublisher(("a", "b"), tmp_path / "x.mcap", 0)
    with socket.create_connection(("127.0.0.1", publisher.server.port), timeout=60.0):
        pass  # somebody may come and go
    writer = foxglove.open_mcap(tmp_path / "seen.mcap", context=publisher.context)
    (tmp_path / "x.monitor").mkdir()
    for k in range(3):
        t = 0.1 * k
        other = (5.0, 2.0 + k, np.pi / 2, 0.0, 5.0)
        publisher.hear(0, frame(t, EGO, [other]))
        publisher.hear(1, frame(t, (np.nan,) * 5, [(np.nan,) * 5]))  # nothing to draw
        publisher.hear(None, Decision(t, "a", "kept", (0.9, np.nan)))
        if k == 1:
            (tmp_path / "x.monitor" / "alarms.jsonl").write_text(
                '{"hazard": "ego_tailgated"}\n{"ha'
            )
        publisher.cycle_over(k, t)
    writer.close()
    publisher.close()
    with (tmp_path / "seen.mcap").open("rb") as stream:
        rows = [(c.topic, s, m.data) for s, c, m in make_reader(stream).iter_messages()]
    scenes = [decoded(schema, data) for topic, schema, data in rows if topic == "/scene"]
    assert len(scenes) == 3
    one, two = scenes[2].entities
    assert (one.id, two.id) == ("a", "b")
    ego, other = one.cubes
    assert (ego.size.x, ego.size.y) == pytest.approx((4.5, 1.8))
    assert (other.pose.position.x, other.pose.position.y) == pytest.approx((5.0, 4.0))
    assert ego.pose.orientation.z == pytest.approx(np.sin(np.pi / 4))
    assert len(one.lines) == 2
    assert len(two.cubes) == 0
    said = [json.loads(data) for topic, _, data in rows if topic == "/arbiter"]
    assert said[0] == {"t": 0.0, "driving": "a", "reason": "kept", "scores": {"a": 0.9}}
    alarms = [json.loads(data) for topic, _, data in rows if topic == "/alarms"]
    assert alarms == [{"hazard": "ego_tailgated"}]
