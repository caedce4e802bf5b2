"""Whether a run may use its bench's calibration: refused before anything is opened."""

from __future__ import annotations

import datetime
from collections.abc import Mapping

from tactile_lab.planning.timeline import Timeline
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene


def check_calibration(scene: Scene, drive: Timeline) -> tuple[str, ...]:
    """What speaks against the calibration, where forces are asked for.

    Raises:
        SceneError: it was changed since it was written, or it has expired and the
            bench does not say ``allow_expired = true``.
    """
    magnet = scene.bench.magnet
    used = magnet.calibration
    if used is None:
        return ()
    told: tuple[str, ...] = ()
    if drive.asks_force:
        told = used.check(today=datetime.date.today(), beyond_date=magnet.allow_expired)
    current = drive.current
    if current is not None and (
        current.value.min() < used.least or current.value.max() > used.most
    ):
        told = (
            *told,
            f"the coil current goes beyond the calibration {used.path.name} "
            f"({show(used.least, 'A')} to {show(used.most, 'A')}); force and field are "
            "not known there and shown as at its ends",
        )
    return told


def check_coil(
    scene: Scene, settings: Mapping[str, Mapping[str, str]]
) -> tuple[str, ...]:
    """What the source that answered has against the calibration; it is still off.

    Args:
        scene: its bench names the calibration.
        settings: read back from the opened instruments, by instrument.

    Raises:
        SceneError: the calibration belongs to another coil and the bench does not say
            ``allow_other_coil = true``.
    """
    magnet = scene.bench.magnet
    used = magnet.calibration
    if used is None or not used.head:
        return ()
    coil = settings.get("coil", {}).get("identity")
    return used.check(coil=coil, other_coil=magnet.allow_other_coil)
