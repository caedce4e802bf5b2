"""For every test."""

from __future__ import annotations

import atexit
import gc
import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

# PySide6's import hook, which pytest-qt brings, reads the source of modules that are
# only half imported; pydantic does not stand that unless its fields come first
import pydantic.fields  # noqa: F401
import pytest
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from xdist.remote import Producer
    from xdist.scheduler import LoadFileScheduling

# what the program keeps for its user, and what its user told it, is no test's
HOME = Path(tempfile.mkdtemp(prefix="tactile-lab-test-"))
atexit.register(shutil.rmtree, HOME, ignore_errors=True)
for _name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME"):
    (HOME / _name).mkdir()
    os.environ[_name] = str(HOME / _name)

# as the program does, before numpy is loaded: workers share the cores
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

COILS = Path(os.environ["XDG_STATE_HOME"], "tactile-lab", "coils")


@pytest.fixture(autouse=True)
def _cold_coils() -> None:
    """No test finds the heat of another whose port had the same name."""
    if COILS.exists():
        shutil.rmtree(COILS)


# A busy machine is no failure, and one commit gives one verdict: examples are drawn
# from each test's own seed. `make search` draws new ones, and many more.
settings.register_profile(
    "settled",
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile(
    "search",
    deadline=None,
    max_examples=1000,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("settled")

WAITING = {
    "tests/gui/test_on_screen.py",
    "tests/commands/test_killed_run.py",
    "tests/commands/test_killed_with_a_source_meter.py",
    "tests/commands/test_monitor.py",
    "tests/commands/test_run_on_served_source.py",
    "tests/drivers/test_acceptance_rehearsal.py",
    "tests/drivers/test_guard.py",
    "tests/drivers/test_serial_acceptance_rehearsal.py",
    "tests/sim_backend/test_serial_servers.py",
}
"""Files that wait, for wires or other programs, more than they compute."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """A worker for each core, and one that waits: each takes 10 s to collect."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(
    config: pytest.Config, log: Producer
) -> LoadFileScheduling | None:
    """Give one worker all that waits, first of all, and then file by file."""
    from xdist.scheduler import LoadFileScheduling

    class Lanes(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = super()._split_scope(nodeid)
            return "waiting" if file in WAITING else file

    if config.getoption("dist") != "loadfile":
        return None
    config.option.loadscopereorder = False
    return Lanes(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put what waits first: something is left to compute as long as it waits."""
    items.sort(key=lambda item: item.nodeid.partition("::")[0] not in WAITING)


def pytest_collection() -> None:
    """Look for no circles among modules and tests: all of them stay."""
    gc.disable()


def pytest_collection_finish() -> None:
    """Look for circles among what tests make, not among all modules and tests, too."""
    gc.collect()
    gc.freeze()
    gc.enable()
