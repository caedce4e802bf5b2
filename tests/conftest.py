"""For every test."""

import os
import tempfile

# PySide6's import hook, which pytest-qt brings, reads the source of modules that are
# only half imported; pydantic does not stand that unless its fields come first
import pydantic.fields  # noqa: F401
from hypothesis import HealthCheck, settings

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
