"""A Rigol DS1000Z over a simulated USB bus, as a block-only scope."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from voltages import Voltages

from drivers.usbtmc.scope import UsbtmcScope
from sim_backend.serial_line.scpi import ScpiParser
from sim_backend.usbtmc.bus import SimulatedBus
from sim_backend.usbtmc.device import SimulatedDevice
from sim_backend.usbtmc.faults import UsbFault
from sim_backend.usbtmc.function import INTERFACE, UsbtmcFunction
from sim_backend.usbtmc.rigol_ds1000z import SimulatedDs1000z
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import (
    BadReplyError,
    InstrumentError,
    LimitError,
    LinkLostError,
    NoReplyError,
    RefusedError,
    SceneError,
)
from tactile_lab.instruments.dialects import dialect_ids, parse_dialect, scope_dialect
from tactile_lab.scope import Block, Channel

ROW = scope_dialect("rigol-ds1000z")
TRIO = (
    Channel(signal="V_K", input="3", range=4.0, offset=-1.0),
    Channel(signal="V_C1", input="1", range=0.8),
    Channel(signal="coil_current", input="4", range=2.0, scale=2.0),
)
VOLTS = {
    "1": lambda t: 0.5 * np.sin(2 * np.pi * 40 * t),
    "3": lambda t: 2.0 + np.cos(2 * np.pi * 25 * t),
    "4": lambda t: np.where(t > 0.2, 3.0, 0.25),
}


class Lab:
    def __init__(
        self,
        *faults: UsbFault,
        sluggish: int = 0,
        clock_error: float = 0.0,
        **function: object,
    ) -> None:
        self.clock = SimulatedClock()
        self.rigol = SimulatedDs1000z(
            Voltages(VOLTS), self.clock, sluggish=sluggish, clock_error=clock_error
        )
        self.function = UsbtmcFunction(self.rigol, **function)  # type: ignore[arg-type]
        self.device = SimulatedDevice(
            vendor=0x1AB1, product=0x04CE, serial="DS1ZSIM0001", maker="Rigol",
            title="DS1000Z Series", function=self.function, interface=INTERFACE,
            packet=64, faults=faults,
        )  # fmt: skip
        bus = SimulatedBus([self.device], self.clock)
        self.scope = UsbtmcScope(ROW, clock=self.clock, backend=bus)

    def records(self, count: int, interval: float = 1e-6) -> list[Block]:
        blocks: list[Block] = []
        with self.clock.taking_part("scope"):
            self.scope.open()
            self.scope.start(TRIO, interval)
            while len(blocks) < count:
                self.clock.sleep_until(self.clock.now() + self.scope.poll_interval)
                block = self.scope.poll()
                blocks += [] if block is None else [block]
            self.scope.close()
        return blocks


@pytest.mark.parametrize("header_once", [False, True])
def test_records_mean_the_volts_at_the_inputs(header_once: bool) -> None:
    lab = Lab(header_once=header_once)
    blocks = lab.records(3)
    stream = lab.scope._stream
    assert stream is not None and stream.interval <= 1e-6
    assert not lab.scope.capability.gapless
    assert lab.function.protocol_errors == []
    for block in blocks:
        assert block.codes.shape == (3, 30_000)
        assert block.codes.flags.c_contiguous and block.codes.dtype == np.int16
        began = stream.started + block.first * stream.interval
        time = began + np.arange(block.samples) * stream.interval
        for row, channel in enumerate(TRIO[:2]):
            gain, offset = stream.volts_per_code(row)
            seen = gain * block.codes[row] + offset
            truth = VOLTS[channel.input](time) * channel.scale
            half_a_code = channel.range / 200
            assert np.max(np.abs(seen - truth)) < 1.02 * half_a_code
    firsts = [block.first for block in blocks]
    assert all(b > a + 30_000 for a, b in itertools.pairwise(firsts))
    assert blocks[0].overrange == (False, False, False)


def test_a_wrong_sample_clock_does_not_shift_records() -> None:
    lab, seen = Lab(clock_error=0.01), []

    class Source(Voltages):
        def render(self, acquisition, first, samples):  # type: ignore[no-untyped-def]
            begun = acquisition.started + first * acquisition.interval * 1.01
            seen.append(begun - (lab.clock.now() - samples * acquisition.interval))
            return super().render(acquisition, first, samples)

    lab.rigol._source = Source(VOLTS)
    lab.records(40)
    # each is read within some polls after its end, the last as soon as the first
    assert -0.1 < min(seen) and max(seen) < 1e-3


def test_out_of_range_is_flagged() -> None:
    lab = Lab()
    lab.clock._now = 0.3
    (block,) = lab.records(1)
    assert block.overrange == (False, False, True)
    assert block.codes[2].max() == 127 * 256


def test_slow_sampling_takes_its_time() -> None:
    lab = Lab()
    (block,) = lab.records(1, interval=1e-4)
    assert block.samples == 30_000
    assert lab.clock.now() > 1.0


def test_the_record_before_is_not_taken_for_the_new_one() -> None:
    first, second = Lab(sluggish=3).records(2)
    assert second.first >= first.first + first.samples
    assert second.received > first.received + 0.024


def test_another_of_its_kind_stands_in_the_settings() -> None:
    lab = Lab()
    lab.records(1)
    assert "others" not in lab.scope.settings()
    other = SimulatedDevice(vendor=0x1AB1, product=0x04CE, serial="DS1ZSIM0002")
    lab.scope._link._backend.plug(other)
    lab.records(1)
    assert lab.scope.settings()["others"] == "DS1ZSIM0002"


def test_another_model_is_refused() -> None:
    lab = Lab()
    lab.rigol.identity = "SIGLENT,SDS1104X-E,1,1"
    with pytest.raises(BadReplyError, match=r"SIGLENT.*rigol-ds1000z"):
        lab.records(1)
    assert not lab.device.claimed


def test_settings_the_scope_refuses_are_told() -> None:
    lab = Lab()
    lab.rigol._set_timebase = None  # type: ignore[method-assign,assignment]
    lab.rigol.parser._table = [
        (p, run) for p, run in lab.rigol.parser._table if "SCAL" not in p.pattern
    ]
    with pytest.raises(RefusedError, match='setting up: -113,"Undefined header"'):
        lab.records(1)


@pytest.mark.parametrize(
    ("knob", "turned", "told"),
    [
        ("scale", 0.5, r"V_C1 .* Leave its knobs alone"),
        ("offset", 0.2, r"V_C1 .* offset 0\.2 V .* knobs"),
    ],
)
def test_a_knob_turned_meanwhile_is_noticed(knob, turned, told) -> None:
    """Of a trace moved by hand all volts were wrong by as much, and nobody was told."""
    lab = Lab()
    with lab.clock.taking_part("scope"):
        lab.scope.open()
        lab.scope.start(TRIO, 1e-6)
        setattr(lab.rigol.channels["1"], knob, turned)
        with pytest.raises(BadReplyError, match=told):
            for _ in range(100):
                lab.clock.sleep_until(lab.clock.now() + 0.02)
                lab.scope.poll()


@pytest.mark.parametrize(
    ("question", "place", "answer"),
    [
        ("ACQuire:SRATe?", 0, "nan"),
        ("ACQuire:SRATe?", 0, "0"),
        ("ACQuire:SRATe?", 0, "-1.25E6"),
        ("ACQuire:SRATe?", 0, "9.9E37"),
        ("WAVeform:PREamble?", 4, "NAN"),
        ("WAVeform:PREamble?", 5, "9.91E37"),
        ("WAVeform:PREamble?", 7, "nan"),
        ("WAVeform:PREamble?", 8, "nan"),
        ("WAVeform:PREamble?", 9, "inf"),
        ("WAVeform:PREamble?", 9, "300"),
    ],
)
def test_what_is_no_number_is_told(question: str, place: int, answer: str) -> None:
    """SCPI's 9.91E37 was a time, NaN agreed with every setting."""
    lab = Lab()
    table = lab.rigol._commands()
    told = table[question]

    def spoilt(argument: str) -> str:
        parts = (told(argument) or "").split(",")
        parts[place] = answer
        return ",".join(parts)

    lab.rigol.parser = ScpiParser({**table, question: spoilt})
    with pytest.raises(BadReplyError, match=re.escape(repr(answer))):
        lab.records(1)


def test_a_scope_that_never_triggers() -> None:
    lab = Lab()
    lab.rigol._status = lambda: "RUN"  # type: ignore[method-assign]
    with pytest.raises(NoReplyError, match="'RUN'"):
        lab.records(1)


@pytest.mark.parametrize("nth", [1, 7, 20, 60])
@pytest.mark.parametrize("call", ["write", "read"])
def test_unplugged_at_any_time(call: str, nth: int) -> None:
    lab = Lab(UsbFault(kind="unplug", call=call, nth=nth))  # type: ignore[arg-type]
    with pytest.raises(LinkLostError, match="unplugged"):
        lab.records(50)
    lab.scope.stop()
    lab.scope.close()


@pytest.mark.parametrize("kind", ["timeout", "stall", "io"])
@pytest.mark.parametrize("nth", [2, 12, 31])
def test_faults_of_the_wire_end_in_one_of_our_errors(kind: str, nth: int) -> None:
    lab = Lab(UsbFault(kind=kind, call="read", nth=nth))  # type: ignore[arg-type]
    with pytest.raises(InstrumentError):
        lab.records(50)
    # and the link is fit for a new start
    lab.device.faults.clear()
    assert len(lab.records(1)) == 1


@pytest.mark.parametrize(
    ("channels", "interval", "text"),
    [
        ((Channel(signal="V_K", input="A", range=4.0),), 1e-6, "scope has 1, 2, 3, 4"),
        ((Channel(signal="V_K", input="1", range=5.0),), 1e-6, "none of the scope's"),
        ((Channel(signal="V_K", input="1", range=4.0),), 1e-10, "every 1e-09 s to"),
        ((Channel(signal="V_K", input="1", range=4.0),), 1.0, "record.sample_rate"),
        ((), 1e-6, "No scope input"),
    ],
)
def test_what_the_scope_cannot_do_is_refused_before_it_is_told(
    channels: tuple[Channel, ...], interval: float, text: str
) -> None:
    lab = Lab()
    with lab.clock.taking_part("scope"):
        lab.scope.open()
        with pytest.raises(LimitError, match=text):
            lab.scope.start(channels, interval)
        lab.scope.close()


def test_timebases_sample_at_least_as_fast_as_asked() -> None:
    for interval in (1e-8, 4e-8, 1e-7, 1e-6, 3e-6, 1e-3):
        for inputs in (1, 2, 3, 4):
            scale = ROW.timebase(interval, inputs)
            actual = scale * ROW.divisions_wide / ROW.depth[inputs]
            assert actual <= interval * 1.0001
            assert actual > interval / 3


def test_rows_are_found_and_checked(tmp_path: Path) -> None:
    assert "rigol-ds1000z" in dialect_ids("scope")
    with pytest.raises(SceneError, match='did you mean "rigol-ds1000z"'):
        scope_dialect("rigol-ds1000")
    with pytest.raises(SceneError, match="not TOML"):
        parse_dialect("id = ", "my.toml")
    with pytest.raises(SceneError, match=r"my\.toml: id is missing"):
        parse_dialect("role = 'scope'\ntitle = 'x'", "my.toml")
    with pytest.raises(SceneError, match="cannot be read"):
        scope_dialect(str(tmp_path / "none.toml"))
