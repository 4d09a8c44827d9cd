"""Drive until the server is gone; prints the error's sentence as JSON."""

from __future__ import annotations

import json
import sys

from skidpad.core.errors import BackendError
from skidpad.core.states import VehicleCommand
from skidpad.simulation.carla.backend import CarlaBackend
from skidpad.simulation.carla.options import CarlaOptions
from support.backend_contract import ALONE


def main(port: int) -> dict[str, str]:
    backend = CarlaBackend(CarlaOptions(port=port, timeout=3.0))
    backend.reset(ALONE, 0)
    print("DRIVING", flush=True)
    try:
        while True:
            backend.step(VehicleCommand())
    except BackendError as error:
        return {"error": str(error)}
    finally:
        backend.close()


if __name__ == "__main__":
    print("RESULT", json.dumps(main(int(sys.argv[1]))), flush=True)
