"""A CARLA server as a backend: the same promises as the embedded simulator (decision L-4)."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from skidpad.core.errors import BackendError
from skidpad.core.frames import Frame
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Outside
from skidpad.core.setup import ActorCommand, Setup
from skidpad.core.states import VehicleCommand, WorldTruth
from skidpad.simulation.carla.connection import connect, speaking
from skidpad.simulation.carla.options import CarlaOptions, Optimisation
from skidpad.simulation.carla.session import Session
from skidpad.simulation.carla.watchdog import Watchdog
from skidpad.simulation.carla.weather import set_weather
from skidpad.simulation.pacing import Pacer


class CarlaBackend:
    """One server, one run at a time. The map is loaded anew at every reset (decision X-12)."""

    def __init__(self, options: CarlaOptions | None = None) -> None:
        self.options = CarlaOptions() if options is None else options
        self.watchdog = Watchdog(self.options.watchdog)
        self._session: Session | None = None
        self._pacer: Pacer | None = None
        self._period = 0.0  # s of the wall per tick; 0: as fast as it can

    @property
    def session(self) -> Session:
        """The run on the server; BackendError before the first reset and after `close`."""
        if self._session is None:
            raise BackendError("the CARLA backend was not reset, or was closed")
        return self._session

    def reset(self, setup: Setup, seed: int) -> Frame:
        """Begins a run on a freshly loaded map and returns its first frame; ends the run before.

        BackendError where the server fails or is none.
        """
        self.close()
        connection = connect(self.options)
        self.watchdog.feed()
        try:
            with speaking(self.options, "setting up the run"):
                self._session = session = Session(connection, setup, seed)
                session.begin()
                frame = session.frame()
        except BaseException:
            self.close()
            raise
        self._pacer = Pacer(self.options.uses(Optimisation.GC_IN_PAUSE))
        self._period = setup.dt if self.options.pace else 0.0
        self._pacer.begin()
        self.watchdog.feed()
        return frame

    def step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand] = ()) -> Frame:
        """Applies the commands for one tick, waits for all sensors and returns the frame.

        BackendError where the server fails. Sleeps as long as the pace asks for.
        """
        session = self.session
        with speaking(self.options, f"driving tick {session.tick + 1}"):
            session.step(command, actor_commands)
            frame = session.frame()
        assert self._pacer is not None
        self._pacer.tick(self._period)
        self.watchdog.feed()
        return frame

    def truth(self) -> WorldTruth:
        """Returns the ground truth of the present tick."""
        return self.session.truth()

    def relocate(self, pose: Pose, v: float) -> None:
        """Puts the ego at `pose` with speed v along it; its height follows from the road."""
        with speaking(self.options, "relocating the ego"):
            self.session.relocate(pose, v)

    def change(self, outside: Outside) -> None:
        """Changes the server's weather and holds lights; grip and headlights stay as the run began."""
        session = self.session
        session.programme.hold(outside.lights)
        with speaking(self.options, "changing the weather"):
            set_weather(session.carla, session.world, outside.weather)

    def close(self) -> None:
        """Ends the run: sensors first, then actors, then the time mode; a dead server does not matter.

        Does nothing without a run.
        """
        if self._pacer is not None:
            self._pacer.end()
            self._pacer = None
        if self._session is not None:
            session, self._session = self._session, None
            self.watchdog.feed()
            with suppress(RuntimeError, BackendError):
                session.close()
        self.watchdog.stop()
