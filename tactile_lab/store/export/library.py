"""Libraries that only some formats need, loaded when one is asked for."""

from __future__ import annotations

import importlib
from typing import Any

from tactile_lab.errors import RunFolderError


def library(module: str, package: str | None = None) -> Any:
    """The module, or an error that says how it is installed.

    Args:
        module: what is imported.
        package: what pip calls it, where that is another name.

    Raises:
        RunFolderError: it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        name = package or module
        raise RunFolderError(
            f"{name} is not installed; `pip install {name}`, or export as csv, which "
            "needs nothing more."
        ) from error
