"""For every test."""

# PySide6's import hook, which pytest-qt brings, reads the source of modules that are
# only half imported; pydantic does not stand that unless its fields come first
import pydantic.fields  # noqa: F401
from hypothesis import HealthCheck, settings

# a busy machine is no failure
settings.register_profile(
    "unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("unhurried")
