"""Every kind of serial fault against every kind of line: what becomes of a session."""

from __future__ import annotations

import itertools
import math
from collections import Counter

from drivers.coil_source import CoilSource
from drivers.dialect import coil_dialect
from sim_backend.coil_source import SimCoilSource
from sim_backend.faults import ANSWER_KINDS, SerialFault
from sim_backend.serial_wires import plug_in, unplug
from sim_backend.serve import CoilOnly
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import TactileLabError
from tactile_lab.magnetics import Magnet

LINES = ("CURR [^M]", "MEAS:CURR", "MEAS:VOLT", "OUTP [01]", "OUTP\\?", "IDN", "VOLT")


def cases() -> list[SerialFault]:
    """Each kind on each line, once and for ever, and unplugs in each form."""
    found = [
        SerialFault(kind=kind, line=line, times=times, amount=amount)
        for kind, line, times in itertools.product(
            (*ANSWER_KINDS, "refused", "deaf", "stuck"), LINES, (1, None)
        )
        for amount in ((0.3, 1.5) if kind == "late" else (3.0,))
    ]
    for form, line, back in itertools.product(
        ("usb", "closed", "reset"), LINES, (0.0, 0.5)
    ):
        found.append(SerialFault(kind="unplug", form=form, line=line, amount=back))
    return found


def outcome(fault: SerialFault) -> str:
    """What became of one session with `fault`."""
    row, clock = coil_dialect("kepco-bop"), SimulatedClock()
    source = SimCoilSource(CoilOnly(Magnet(r=6e-3)), row.id, clock)
    end = plug_in(source, row.serial, clock, "coil", [fault])
    coil = CoilSource(row, end.url, CoilLimits(), clock)
    reason = ""
    with clock.taking_part("session"):
        try:
            coil.open()
            coil.energise()
            for k in range(40):
                clock.sleep_until(clock.now() + coil.update_interval)
                coil.set_current(0.6 * math.sin(k / 5))
                if k % 8 == 0:
                    coil.read_current()
                    coil.read_voltage()
        except TactileLabError as error:
            reason = str(error)
        report = coil.safe_off()
        really = not source.output_on and abs(source.measured_current()) < 5e-3
        coil.close()
    unplug(end)
    if not end.faults.struck:
        return "did not strike"
    if report.verified and not really:
        return "WRONG: called off, but on"
    if report.verified:
        return "went on" if not reason else "ended, verified off"
    return "state called unknown, and told to switch off by hand"


def table() -> list[str]:
    """Markdown lines: outcomes and how often."""
    found = Counter(outcome(fault) for fault in cases())
    wrong = "WRONG: called off, but on"
    found.setdefault(wrong, 0)
    lines = ["| outcome of a session with one fault | sessions |", "|---|---|"]
    lines += [f"| {what} | {times} |" for what, times in sorted(found.items())]
    lines.append(f"| all | {found.total()} |")
    return lines


if __name__ == "__main__":
    print("\n".join(table()))
