"""For every test."""

from __future__ import annotations

import os
import tempfile
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
for _name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME"):
    os.environ[_name] = tempfile.mkdtemp(prefix="tactile-lab-test-")

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

WAITING = frozenset({
    "tests/commands/test_cli.py",
    "tests/commands/test_killed_run.py",
    "tests/commands/test_killed_with_a_source_meter.py",
    "tests/commands/test_loaded.py",
    "tests/commands/test_monitor.py",
    "tests/commands/test_run_endings.py",
    "tests/commands/test_run_on_served_source.py",
    "tests/commands/test_starting.py",
    "tests/docs/test_documents.py",
    "tests/drivers/test_acceptance_rehearsal.py",
    "tests/drivers/test_guard.py",
    "tests/drivers/test_serial_acceptance_rehearsal.py",
    "tests/engine/test_link.py",
    "tests/gui/test_on_screen.py",
    "tests/sim_backend/test_serial_servers.py",
})  # fmt: skip
"""Files whose tests wait, for processes, wires or a screen, more than they compute."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """A worker for each core, and one for what waits."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(
    config: pytest.Config, log: Producer
) -> LoadFileScheduling | None:
    """Give all files that wait to one worker, first of all; each other file to one."""
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
    """Put what waits first: it is to last no longer than the rest."""
    items.sort(key=lambda item: item.nodeid.partition("::")[0] not in WAITING)
