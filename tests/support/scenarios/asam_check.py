"""Run by the Python of the ASAM checkers' own environment: prints issues and skipped checks."""

import json
import sys
from datetime import datetime

from qc_baselib import Configuration, Result


def check(kind, path):
    if kind == "xosc":
        from qc_openscenario import constants
        from qc_openscenario.main import run_checks
    else:
        from qc_opendrive import constants
        from qc_opendrive.main import run_checks
    config, result = Configuration(), Result()
    config.set_config_param("InputFile", path)
    result.register_checker_bundle(
        name=constants.BUNDLE_NAME,
        description="check",
        version=constants.BUNDLE_VERSION,
        build_date=datetime(2000, 1, 1).strftime("%Y-%m-%d"),  # noqa: DTZ001
    )
    result.set_result_version(version=constants.BUNDLE_VERSION)
    run_checks(config, result)
    checkers = result._report_results.checker_bundles[0].checkers
    return {
        "issues": [(c.checker_id, i.description) for c in checkers for i in c.issues],
        "skipped": [c.checker_id for c in checkers if c.status.name == "SKIPPED"],
        "completed": [c.checker_id for c in checkers if c.status.name == "COMPLETED"],
    }


if __name__ == "__main__":
    print(
        "ASAM " + json.dumps({path: check(path.rsplit(".", 1)[1], path) for path in sys.argv[1:]})
    )
