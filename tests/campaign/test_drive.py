"""The one loop: anybody's stack, failures as outcomes, equal bytes, supervision, snapshots."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace
from PIL import Image

from skidpad.campaign.runs.drive import drive
from skidpad.campaign.runs.run import Run
from skidpad.campaign.runs.run import run as run_spec
from skidpad.core.courses import Edges, Roads
from skidpad.core.errors import ConfigError
from skidpad.core.frames import Frame, Segments, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.run import RunSpec
from skidpad.core.setup import ActorCommand
from skidpad.core.specs import CameraSpec, LidarSpec, Modality, PointSensorSpec, SensorSpec
from skidpad.core.states import ContactEvent, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import Outcome, RelocationReason, SensorLevel, Supervision, Tier
from skidpad.evidence.drive.metrics import run_metrics
from skidpad.recording.run.log_files import log_hash
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.runs import adas_run
from support.stadium import written


class Gentle:
    """A stack of somebody else: a little throttle, straight on."""

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        self.throttle = float(settings.get("throttle", 0.3))
        self.fail_at = settings.get("fail_at")
        self.answer = settings.get("answer")

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        if frame.tick == self.fail_at:
            raise RuntimeError("out of ideas")
        if self.answer is not None:
            return self.answer  # type: ignore[no-any-return]
        return VehicleCommand(throttle=self.throttle)


class Blind(Gentle):
    """Steers into the guardrail."""

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        return VehicleCommand(throttle=1.0, steer=0.05)


def short(stack: type[Gentle] = Gentle, seconds: float = 3.0, **options: Any) -> Run:
    return drive(stack, duration=seconds, sensors="objects", seed=2, stack_settings=options)


def cell(number: int = 4, duration: float = 8.0, **changes: Any) -> RunSpec:
    return adas_run(number, seed=5, duration=duration, **changes)


def test_any_class_with_the_stack_interface_drives() -> None:
    from skidpad import drive as public

    assert public is drive
    run = short(seconds=2.0)
    assert (run.outcome, len(run.log), run.error) == (Outcome.COMPLETED, 40, "")
    assert run.log.requested.throttle == pytest.approx(0.3)
    assert short(throttle=0.6).log.v_ego[-1] > run.log.v_ego[-1] > 0.0
    named = drive(f"{__name__}:Gentle", duration=0.5, sensors="objects")
    assert len(named.log) == 10


@pytest.mark.parametrize(
    ("options", "said", "ticks"),
    [
        ({"fail_at": 20}, "out of ideas", 20),
        ({"answer": "full speed"}, "must return a VehicleCommand", 0),
        ({"answer": VehicleCommand(throttle=float("nan"))}, "throttle must be between", 0),
        ({"throttle": "a lot"}, "could not be built", 0),
    ],
)
def test_a_stack_that_fails_is_an_outcome_with_its_traceback(
    options: dict[str, Any], said: str, ticks: int
) -> None:
    run = short(**options)
    assert run.outcome is Outcome.AGENT_ERROR
    assert said in run.error
    assert len(run.log) == ticks


@pytest.mark.req("X-1", "X-8", "X-12")
def test_same_seed_same_content_whatever_ran_before() -> None:
    backend = EmbeddedBackend()
    first = run_spec(cell(), backend=backend)
    run_spec(replace(cell(1), seed=9, duration=2.0), backend=backend)
    again = run_spec(cell(), backend=backend)
    assert log_hash(first.log) == log_hash(again.log)
    assert log_hash(run_spec(replace(cell(), seed=6)).log) != log_hash(first.log)


@pytest.mark.req("X-11")
def test_nobody_keeps_a_buffer_beyond_its_tick() -> None:
    wanted = cell(3, 2.0, sensors=SensorLevel.PIXELS)
    clean = run_spec(wanted)
    poisoned = run_spec(wanted, backend=EmbeddedBackend(poison=True))
    assert log_hash(clean.log) == log_hash(poisoned.log)


class Curious(Gentle):
    """Asks for sensors, and looks at them."""

    def sensors(self) -> tuple[SensorSpec, ...]:
        return (LidarSpec("lidar", Pose(0.0, 0.0, 2.0)), PointSensorSpec("gps", "gnss"))

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        assert set(frame.extra) == {"lidar", "gps"}
        assert len(frame.extra["lidar"].xyz) > 100
        assert frame.extra["gps"].latitude == pytest.approx(48.1, abs=0.1)
        return super().tick(frame)


class Silent(Gentle):
    """Is given nothing that it did not ask for."""

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        assert not frame.extra
        return super().tick(frame)


@pytest.mark.req("L-3")
@pytest.mark.parametrize("level", ["objects", "pixels"])
def test_sensors_asked_for_change_nothing_else(level: str) -> None:
    plain, curious = (
        drive(kind, duration=1.0, sensors=level, vehicles=3) for kind in (Silent, Curious)
    )
    assert plain.outcome is curious.outcome is Outcome.COMPLETED, curious.error
    for a, b in zip(plain.log.actors, curious.log.actors, strict=True):
        assert np.array_equal(a, b)


class WithCamera(Gentle):
    """Asks for a camera."""

    def sensors(self) -> tuple[SensorSpec, ...]:
        return (CameraSpec("mine", Modality.SEMANTIC, 64, 48, 90.0, Pose(1.0, 0.0, 1.5)),)

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        image = frame.extra["mine"]
        assert image is frame.images["mine"]
        assert image.labels.shape == (48, 64)
        return super().tick(frame)


@pytest.mark.req("L-3")
def test_a_camera_asked_for_needs_pixels() -> None:
    assert drive(WithCamera, duration=0.2, vehicles=0).error == ""
    run = drive(WithCamera, duration=0.2, vehicles=0, sensors="objects")
    assert run.outcome is Outcome.AGENT_ERROR
    assert "run with --sensors pixels" in run.error


@pytest.mark.req("L-3")
def test_the_example_with_a_lidar_follows_and_does_not_hit() -> None:
    where = Path(__file__).parents[2] / "examples" / "lidar_brake.py"
    run = drive(f"{where}:LidarBrake", duration=25.0, sensors="objects", seed=1)
    assert run.outcome is Outcome.COMPLETED, run.error
    assert run.log.contacts == ()
    assert 10.0 < run.log.v_ego.max() < 15.0


def test_a_run_is_shown_in_one_line() -> None:
    run = drive(0, duration=0.5, vehicles=2, sensors="objects", seed=3)
    assert repr(run.log) == "<RunLog: 10 ticks of 0.05 s, 3 actors, 0 contacts of the ego>"
    assert repr(run).startswith("<Run of ")
    assert "completed after 0.5 s on figure8, clear-noon, seed 3; 0 contacts" in repr(run)


class Wrapped:
    """The embedded simulator with something changed on the way."""

    def __init__(self) -> None:
        self.inner = EmbeddedBackend()

    def reset(self, setup: Any, seed: int) -> Frame:
        return self.inner.reset(setup, seed)

    def step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand] = ()) -> Frame:
        return self.inner.step(command, actor_commands)

    def truth(self) -> WorldTruth:
        return self.inner.truth()

    def relocate(self, pose: Pose, v: float) -> None:
        self.inner.relocate(pose, v)

    def close(self) -> None:
        self.inner.close()


class TruthGone(Wrapped):
    """Truth about the others is NaN."""

    def truth(self) -> WorldTruth:
        true = self.inner.truth()
        states = true.states.copy()
        for column in states[:-1]:
            column[1:] = np.nan
        return dataclasses.replace(true, states=states)


@pytest.mark.req("A-014", "L-3")
def test_the_stack_never_sees_the_truth() -> None:
    with_truth = run_spec(cell())
    without = run_spec(cell(), backend=TruthGone())
    for a, b in zip(with_truth.log.requested, without.log.requested, strict=True):
        assert np.array_equal(a, b)
    assert np.isnan(without.log.actors.x[:, 1]).all()


@pytest.mark.req("R-6")
def test_on_a_town_without_barriers_leaving_the_road_counts(tmp_path: Path) -> None:
    # Without the outcome configuration 0 drove 20 km over grass and scored no collision.
    town = written(tmp_path)
    run = drive(0, map=town, duration=60.0, vehicles=0, sensors="objects")
    found = run_metrics(run.log, load_map(town))
    reasons = {r.reason for r in run.log.relocations}
    assert RelocationReason.OFF_ROAD in reasons
    assert found.off_road is not None
    assert found.off_road >= 1
    assert found.road_departures == found.fatal_collisions
    assert found.collisions_vehicle == 0
    assert found.off_lanes_pct is not None
    assert 0.0 < found.off_lanes_pct < 5.0
    assert run.off_road is not None
    edges = np.flatnonzero(np.diff(np.r_[0, run.off_road.astype(int), 0]))
    assert (
        np.diff(edges)[::2].max() < 20
    )  # ticks: who is back within a second has not left the road
    street = load_map(town).edge.beyond(
        run.log.actors.x[:, 0], run.log.actors.y[:, 0], run.log.actors.z[:, 0]
    )
    assert street.max() < 8.0  # m


def test_rails_along_the_edges_end_what_would_be_a_departure(tmp_path: Path) -> None:
    course = Roads(map=str(written(tmp_path)), vehicles=0, edges=Edges.RAIL)
    run = run_spec(adas_run(0, duration=14.0, course=course))
    assert {c.static for c in run.log.contacts} == {"guardrail"}
    assert {r.reason for r in run.log.relocations} <= {RelocationReason.COLLISION}


@pytest.mark.req("A-257", "R-6")
def test_a_departure_leaves_a_picture(tmp_path: Path) -> None:
    run = drive(0, map=written(tmp_path), duration=16.0, vehicles=0, out=tmp_path)
    moves = [r for r in run.log.relocations if r.reason is RelocationReason.OFF_ROAD]
    assert len(run.snapshots) == len(moves) >= 1
    assert run.snapshots[0].name.endswith(f"_{moves[0].tick * 0.05:07.2f}s.png")


@pytest.mark.req("A-179", "A-191", "A-194")
def test_a_crash_is_recovered_recorded_and_hidden_from_no_one() -> None:
    run = short(Blind, seconds=20.0)
    phases = run.log.supervision
    assert {int(p) for p in Supervision} == set(phases.tolist())
    assert run.log.contacts[0].static == "guardrail"
    moved = run.log.relocations[0]
    assert moved.reason is RelocationReason.COLLISION
    k = int(np.flatnonzero(run.log.tick == moved.tick)[0])
    assert phases[k] == Supervision.REALIGN
    assert run.log.actors.x[k + 1, 0] == pytest.approx(moved.new.x, abs=0.5)
    braking = phases == Supervision.BRAKE
    assert (run.log.applied.brake[1:][braking[:-1]] == 1.0).all()
    assert (run.log.requested.brake[braking] == 0.0).all()


class StaleView(Wrapped):
    """A false contact in one tick; the cameras show the old scene for two frames after the move."""

    CONTACT_TICK, STALE = 60, 2

    def __init__(self) -> None:
        super().__init__()
        self.left = 0

    def truth(self) -> WorldTruth:
        true = self.inner.truth()
        if true.tick != self.CONTACT_TICK:
            return true
        return dataclasses.replace(
            true, contacts=(ContactEvent(true.tick, -1, "wall", 1.0, 1.0, 0.0, 0.0),)
        )

    def relocate(self, pose: Pose, v: float) -> None:
        super().relocate(pose, v)
        self.left = self.STALE if v == 0.0 else self.left

    def step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand] = ()) -> Frame:
        frame = super().step(command, actor_commands)
        if self.left == 0:
            return frame
        self.left -= 1
        near = Segments(
            np.array([200.0], np.float32),
            np.array([300.0], np.float32),
            np.array([100.0], np.float32),
            np.array([250.0], np.float32),
            np.array([1.5], np.float32),
            np.array([14], np.uint8),
        )
        return dataclasses.replace(frame, segments=dict.fromkeys(frame.segments, near))


@pytest.mark.req("A-195")
def test_stale_images_after_a_relocation_cause_no_emergency_braking() -> None:
    backend = StaleView()
    run = run_spec(replace(cell(1, vehicles=0), seed=1), backend=backend)
    phases, tier = run.log.supervision, run.log.report.tier
    warm = np.flatnonzero(phases == Supervision.WARM_UP)
    assert len(warm) == 10
    after = tier[warm[-1] + 1 :]
    assert len(after) > 20
    assert not np.isin(after, [Tier.HARD_STOP, Tier.STOPPED_TOO_CLOSE, Tier.EMERGENCY]).any()


@pytest.mark.req("A-257")
def test_each_collision_leaves_a_picture(tmp_path: Path) -> None:
    run = drive(Blind, duration=6.0, vehicles=0, out=tmp_path)
    assert len(run.snapshots) == len({c.tick for c in run.log.contacts}) > 0
    with Image.open(run.snapshots[0]) as picture:
        assert picture.size == (800, 600)
        assert np.asarray(picture).std() > 10.0
    time = run.log.contacts[0].tick * 0.05
    assert run.snapshots[0].name.endswith(f"clear-noon_{time:07.2f}s.png")


def test_a_wrong_level_or_weather_is_one_sentence() -> None:
    with pytest.raises(ConfigError, match="sensors"):
        drive(Gentle, sensors="lasers")
    with pytest.raises(ConfigError, match="weather"):
        drive(Gentle, weather="locusts")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("vehicles", -1, "vehicles must be between 0 and 80, got -1"),
        ("duration", -1.0, "duration must be between 0.05 and 100000, got -1.0"),
    ],
)
def test_a_number_out_of_its_range_is_named_before_anything_is_driven(name, value, said) -> None:
    """NumPy's `negative dimensions` came through."""
    with pytest.raises(ConfigError, match=said):
        drive(Gentle, **{name: value})
