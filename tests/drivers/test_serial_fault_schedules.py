"""Random schedules of faults: no report is wrong and no limit broken, come what may."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from resistor import Resistor

from drivers.coil.source import CoilSource
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.faults import ANSWER_KINDS, SerialFault
from sim_backend.serial_line.wires import plug_in, unplug
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import TactileLabError
from tactile_lab.instruments.dialects import coil_dialect

KINDS = (*ANSWER_KINDS, "refused", "deaf", "stuck", "unplug")
LINES = ("", "CURR", "MEAS", "OUTP", "IDN", "VOLT", "ERR")


@st.composite
def faults(draw):
    return SerialFault(
        kind=draw(st.sampled_from(KINDS)),
        line=draw(st.sampled_from(LINES)),
        after=draw(st.floats(0.0, 4.0)),
        skip=draw(st.integers(0, 3)),
        times=draw(st.sampled_from([1, 1, 2, 5, None])),
        amount=draw(st.sampled_from([0.0, 0.05, 0.3, 1.0, 3.0])),
        form=draw(st.sampled_from(["usb", "closed", "reset"])),
    )


def session(clock, coil):
    """A short experiment; any error of ours may end it."""
    try:
        coil.open()
        coil.energise()
        for k in range(40):
            clock.sleep_until(clock.now() + coil.update_interval)
            coil.set_current(0.6 * math.sin(k / 5))
            if k % 8 == 0:
                coil.read_current()
    except TactileLabError:
        return


@settings(max_examples=60)
@given(schedule=st.lists(faults(), max_size=4))
def test_no_report_is_wrong_and_no_limit_broken(schedule):
    row = coil_dialect("kepco-bop")
    clock, plant = SimulatedClock(), Resistor()
    source = SimCoilSource(plant, row.id, clock)
    end = plug_in(source, row.serial, clock, "coil", schedule)
    coil = CoilSource(row, end.url, CoilLimits(), clock)
    with clock.taking_part("test"):
        session(clock, coil)
        begun = clock.now()
        report = coil.safe_off()
        assert clock.now() - begun < 30
        if report.verified:
            assert not source.output_on
            assert source.setpoint == 0.0 or "set-point" in report.text
            assert plant.coil_current(0) == 0.0
        else:
            assert "unknown" in report.text.lower()
        coil.close()
        end.faults.clear()
        end.unplugged = None
        if "never reached" not in report.text:
            assert coil.safe_off().verified  # healed, it can always be made safe
            assert not source.output_on
    unplug(end)
    changes = source.changes
    for k, change in enumerate(changes):
        if change.what == "output" and change.value:
            before = changes[:k]
            assert any(d.what == "limit" and d.value == 14.0 for d in before)
            assert [d.value for d in before if d.what == "set"][-1] == 0.0
    sets = [change for change in changes if change.what == "set"]
    assert all(abs(change.value) <= 2.0 for change in sets)


def test_without_faults_the_same_session_keeps_the_slew_limit():
    row = coil_dialect("kepco-bop")
    clock = SimulatedClock()
    source = SimCoilSource(Resistor(), row.id, clock)
    coil = CoilSource(row, plug_in(source, row.serial, clock).url, CoilLimits(), clock)
    with clock.taking_part("test"):
        session(clock, coil)
        assert coil.setpoint == pytest.approx(0.6 * math.sin(39 / 5), abs=1e-5)
        coil.close()
    sets = [change for change in source.changes if change.what == "set"]
    for a, b in itertools.pairwise(sets):
        assert abs(b.value - a.value) <= 5.0 * (b.time - a.time) + 6e-3
