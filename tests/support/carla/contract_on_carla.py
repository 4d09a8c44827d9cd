"""Run all contract checks against a server; prints what failed, by name, as JSON."""

from __future__ import annotations

import json
import sys
import traceback

from skidpad.simulation.carla.backend import CarlaBackend
from skidpad.simulation.carla.options import CarlaOptions
from support.backend_contract import CHECKS


def main(port: int) -> dict[str, str]:
    made: list[CarlaBackend] = []

    def make() -> CarlaBackend:
        made.append(CarlaBackend(CarlaOptions(port=port)))
        return made[-1]

    failed = {}
    for check in CHECKS:
        try:
            check(make)
        except Exception:
            failed[check.__name__] = traceback.format_exc()
        finally:
            for backend in made:
                backend.close()
            made.clear()
    return failed


if __name__ == "__main__":
    print("RESULT", json.dumps(main(int(sys.argv[1]))), flush=True)
