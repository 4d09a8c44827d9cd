"""The state of a run at one of its ticks, to which the run can go back any number of times."""

from __future__ import annotations

from lxml import etree

from skidpad.core.errors import CheckpointError
from skidpad.core.objects.checkpoint import Checkpoint
from skidpad.physics.segments import Segments
from skidpad.roads.kernels import LaneArrays
from skidpad.roads.queries import RoadMap
from skidpad.sensors.object_level.boxes import Walls
from skidpad.sensors.object_level.object_camera import CameraScratch, Eye
from skidpad.sensors.object_level.object_radar import RadarScratch
from skidpad.sensors.physical_radar.cells import Scratch
from skidpad.sensors.pictures.degradation import CameraNoise
from skidpad.sensors.pictures.shading import Shading
from skidpad.sensors.raster.passes import Pass
from skidpad.sensors.scene.static import StaticScene
from skidpad.simulation.world.traffic.network import Network

# the map and what is made of it; elements of a file; arrays that each tick fills before it reads them
FIXED = (
    RoadMap, type(etree.Element("element")), LaneArrays, Network, Segments, Walls, StaticScene,
    Eye, CameraScratch, RadarScratch, Scratch, Pass, Shading, CameraNoise,
)  # fmt: skip


class RunCheckpoint:
    """The state of a run: world, stack, supervisor, script, random streams and log.

    Attributes:
        tick: the tick that was driven last.
        nbytes: size of the arrays in it.
    """

    def __init__(self, run: object, tick: int) -> None:
        self._run, self.tick = run, tick
        self._state = Checkpoint(run, FIXED)

    @property
    def nbytes(self) -> int:
        """Returns the size of all arrays in it, in bytes."""
        return self._state.nbytes

    def restore(self, run: object) -> None:
        """Puts the run back to this tick; CheckpointError for another run."""
        if run is not self._run:
            raise CheckpointError(
                "a checkpoint can be restored only in the run that it was taken of"
            )
        self._state.restore()
