"""A serial port by the name that stays, and the file in which something of it is kept.

Linux numbers adapters as they come: `/dev/ttyUSB0` may be `/dev/ttyUSB1` once its cable
was pulled and put back, and another's. Under `/dev/serial/by-id` each has a name by its
serial number. Drivers find their instruments by it, and a coil its heat.
"""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import quote

from tactile_lab.lab import state_folder

BY_ID = Path("/dev/serial/by-id")
"""Where Linux names serial ports by their adapters."""


def lasting_name(port: str) -> str | None:
    """Name of a port by the serial number of its adapter, where the system has one."""
    if not BY_ID.is_dir():
        return None
    real = os.path.realpath(port)
    names = (one for one in sorted(BY_ID.iterdir()) if os.path.realpath(one) == real)
    return next(map(str, names), None)


def kept_of_port(kind: str, port: str) -> Path:
    """Where programs on this computer keep one `kind` of what is known of a port."""
    return state_folder() / kind / f"{quote(port, safe='')}.json"
