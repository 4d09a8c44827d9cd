"""Shared fixtures and options."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from support.examples import register_profiles
from support.programs import needs_program
from support.slow_tests import SlowTests, is_slow

register_profiles()

TOWNS = Path(__file__).resolve().parents[2] / "shared" / "maps"
# Words in a reason to skip that CI does not accept, because it has installed for them.
MUST_RUN = os.environ.get("SKIDPAD_MUST_RUN", "").split()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--rewrite-references", action="store_true", help="write reference recordings anew"
    )
    parser.addoption("--fuzz", type=int, default=None, help="damaged files per reader")
    parser.addoption("--draws", type=int, default=2000, help="draws per case of test_promises")
    parser.addoption(
        "--program-tests", action="store_true", help="only tests that need a program of the system"
    )
    parser.addoption("--write-slow", action="store_true", help="write tests/slow_tests.txt anew")
    parser.addoption("--fuzz-from", type=int, default=0, help="number of the first of them")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--write-slow") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(SlowTests(), "slow-tests")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        if is_slow(item.nodeid):
            item.add_marker(pytest.mark.slow)
    if config.getoption("--program-tests"):
        items[:] = [item for item in items if needs_program(item)]


@pytest.fixture(scope="session")
def towns() -> Path:
    """The folder with CARLA's towns as OpenDRIVE; tests that need it skip when it is absent."""
    if not TOWNS.is_dir():
        pytest.skip("CARLA's towns are not here")
    return TOWNS


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.skipped and isinstance(report.longrepr, tuple):
        reason = report.longrepr[2]
        word = next((w for w in MUST_RUN if w in reason.lower()), None)
        if word and "towns" not in reason:
            FORBIDDEN.append(f"{report.nodeid}: {reason}")


FORBIDDEN: list[str] = []


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    if FORBIDDEN and not hasattr(session.config, "workerinput"):
        print("\nskipped, although this machine was set up for them:", *FORBIDDEN, sep="\n  ")
        if exitstatus == 0:
            session.exitstatus = 1
