"""Asking every instrument of a bench who it is, and making the coil safe."""

from __future__ import annotations

from gui.session.messages import Checked, Identified, Refused
from gui.session.request import Request
from gui.state import Fault
from tactile_lab.bench import Bench, OffReport
from tactile_lab.engine.bench import open_bench
from tactile_lab.errors import TactileLabError
from tactile_lab.planning.needs import needs
from tactile_lab.scene.scene import Scene


def check_bench(request: Request, *, realtime: bool = True) -> Checked | Refused:
    """Who answers on a request's bench, or why it cannot be used.

    Args:
        request: names the bench.
        realtime: pace a simulated bench by the wall clock.
    """
    try:
        scene = request.load()
        return check(scene, open_bench(scene, needs(scene), realtime=realtime))
    except (TactileLabError, OSError) as error:
        return Refused(Fault("The bench cannot be used.", str(error)))
    except Exception as error:  # a driver of the user's own may raise anything
        text = f"{type(error).__name__}: {error}"
        return Refused(Fault("Asking the instruments broke.", text))


def check(scene: Scene, bench: Bench) -> Checked:
    """Open, identify and close each instrument; the coil is verified off on the way."""
    found: list[Identified] = []
    off: OffReport | None = None
    with bench.clock.taking_part("check"):
        coil = bench.coil
        if coil is not None:
            try:
                coil.open()
                found.append(Identified("coil", coil.identity, ""))
            except (TactileLabError, OSError) as error:
                found.append(Identified("coil", "", str(error)))
            else:
                off = coil.safe_off()
                coil.close()
        for role, instrument in (("scope", bench.scope), ("meter", bench.field_meter)):
            if instrument is None:
                continue
            try:
                instrument.open()
                found.append(Identified(role, instrument.identity, ""))
                instrument.close()
            except (TactileLabError, OSError) as error:
                found.append(Identified(role, "", str(error)))
    return Checked(scene.bench.name, scene.bench.simulated, tuple(found), off)
