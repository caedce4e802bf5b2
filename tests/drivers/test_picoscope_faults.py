"""Every fault of the scope: what was recorded is kept, and the message helps."""

from __future__ import annotations

import re

import numpy as np
import pytest
from voltages import Voltages

from drivers.picoscope.scope import PicoScope
from sim_backend.picoscope.faults import ScopeFault
from sim_backend.picoscope.scope import UnitModel
from sim_backend.picoscope.sdk import FakePs3000a
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import (
    InstrumentError,
    LimitError,
    LinkLostError,
    NotFoundError,
    RefusedError,
    SamplesLostError,
    TactileLabError,
)
from tactile_lab.scope import Channel

FOUR = tuple(
    Channel(signal=signal, input=name, range=5.0)
    for signal, name in zip(
        ("V_C1", "V_C2", "V_K", "coil_current"), "ABCD", strict=True
    )
)
SOURCE = Voltages({"A": lambda t: np.sin(2 * np.pi * 50 * t)})


class Rig:
    """A scope on the simulated library, and a loop that polls it."""

    def __init__(
        self, *faults: ScopeFault, make: UnitModel | None = None, **options: object
    ) -> None:
        self.clock = SimulatedClock()
        self.library = FakePs3000a(SOURCE, self.clock, make, faults)
        self.scope = PicoScope(clock=self.clock, library=self.library, **options)  # type: ignore[arg-type]
        self.samples = 0

    def stream(
        self, seconds: float, interval: float = 1e-5, step: float = 0.02
    ) -> None:
        self.samples = 0
        with self.clock.taking_part("scope"):
            self.scope.open()
            self.scope.start(FOUR, interval)
            until = self.clock.now() + seconds
            while self.clock.now() < until - 1e-9:
                self.clock.sleep_until(self.clock.now() + step)
                block = self.scope.poll()
                if block is not None:
                    assert block.first == self.samples
                    self.samples += block.samples
            self.scope.stop()

    def fails(self, error: type[Exception], match: str, **how: float) -> str:
        with pytest.raises(error, match=match) as caught:
            self.stream(**{"seconds": 3.0, **how})
        self.scope.close()
        self.library.raise_errors()
        return str(caught.value)

    def works(self) -> None:
        self.stream(0.2)
        assert self.samples == 20_000
        self.scope.close()
        self.library.raise_errors()


def test_a_healthy_stream_loses_nothing() -> None:
    rig = Rig()
    rig.stream(1.0)
    assert rig.samples == 100_000
    rig.works()


CALLS = (
    "GetUnitInfo", "MaximumValue", "SetChannel", "SetSimpleTrigger", "SetDataBuffer",
    "RunStreaming", "GetStreamingLatestValues",
)  # fmt: skip


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("nth", [1, 3])
def test_unplugged_at_any_call(call: str, nth: int) -> None:
    once = call in ("MaximumValue", "SetSimpleTrigger", "RunStreaming")
    rig = Rig(ScopeFault(kind="unplug", call=call, nth=1 if once else nth))
    rig.fails(LinkLostError, "unplugged or without power.*check cable and power")
    with pytest.raises(NotFoundError, match="check the USB cable"):
        rig.scope.open()
    rig.library.device.present = True
    rig.works()


@pytest.mark.parametrize("call", ["Stop", "CloseUnit"])
def test_unplugged_while_stopping_still_lets_go(call: str) -> None:
    rig = Rig(ScopeFault(kind="unplug", call=call))
    rig.stream(0.1)
    rig.scope.close()
    assert not rig.library.device.is_open
    rig.library.device.present = True
    rig.works()


@pytest.mark.parametrize("code", [0x14, 0x26])
def test_a_scope_that_cannot_be_closed_has_lost_no_samples(code: int) -> None:
    """ "Streaming stopped by itself" made the certificate call samples missing."""
    rig = Rig(ScopeFault(kind="status", call="CloseUnit", code=code, times=1))
    rig.stream(0.1)
    with pytest.raises(RefusedError, match=r"not let go of.*is kept.*USB cable"):
        rig.scope.close()


def test_unplugged_before_opening() -> None:
    rig = Rig(ScopeFault(kind="unplug", call="OpenUnit"))
    rig.fails(NotFoundError, "udev rule")


def test_samples_before_the_unplugging_are_kept() -> None:
    rig = Rig(ScopeFault(kind="unplug", time=0.5))
    rig.fails(LinkLostError, "0x7")
    assert rig.samples == pytest.approx(48_000, abs=2_100)


def test_samples_read_in_the_same_poll_as_the_failure_are_kept() -> None:
    # the ring wraps in the first poll; the second call of that poll fails
    fault = ScopeFault(kind="unplug", call="GetStreamingLatestValues", nth=2)
    rig = Rig(fault, ring=1500)
    rig.fails(LinkLostError, "0x7", step=0.014)
    assert rig.samples == 1400
    rig = Rig(
        ScopeFault(kind="unplug", call="GetStreamingLatestValues", nth=3), ring=1500
    )
    rig.fails(LinkLostError, "0x7", step=0.014)
    assert rig.samples == 1500


def test_a_link_that_falls_silent_is_found_out_by_the_watchdog() -> None:
    rig = Rig(ScopeFault(kind="silent", time=0.5), watchdog=0.3)
    text = rig.fails(LinkLostError, "has sent nothing for .* does not answer")
    assert "unplugged" in text
    assert rig.clock.now() == pytest.approx(0.5 + 0.3, abs=0.05)


def test_a_scope_that_answers_but_sends_nothing() -> None:
    busy = ScopeFault(
        kind="status", call="GetStreamingLatestValues", nth=10, code=0x27, times=1000
    )
    rig = Rig(busy, watchdog=0.3)
    with pytest.raises(LinkLostError, match="answers a ping but sends no data"):
        rig.stream(3.0)


def test_streaming_that_stops_by_itself() -> None:
    rig = Rig(ScopeFault(kind="stream_fails", time=0.3))
    rig.fails(SamplesLostError, "stopped by itself")
    rig.works()


def test_streaming_that_fails_because_the_link_is_dead_is_called_that() -> None:
    rig = Rig(
        ScopeFault(kind="status", call="GetStreamingLatestValues", nth=5, code=0x14),
        ScopeFault(kind="unplug", call="PingUnit"),
    )
    rig.fails(LinkLostError, "unplugged")


def test_a_call_that_hangs_and_then_fails() -> None:
    rig = Rig(
        ScopeFault(kind="hang", call="GetStreamingLatestValues", nth=7, duration=5.0)
    )
    rig.fails(LinkLostError, "unplugged")
    assert rig.clock.now() > 5.0
    assert rig.samples == 6 * 2000


@pytest.mark.parametrize("lost", [4, 1_200, 10_000])
def test_a_gap_the_scope_does_not_tell_is_found_by_counting(lost: int) -> None:
    rig = Rig(ScopeFault(kind="gap", time=0.5, samples=lost))
    text = rig.fails(SamplesLostError, "Samples are missing")
    about = int(re.search(r"about (\d+) too few", text).group(1))  # type: ignore[union-attr]
    assert about == pytest.approx(lost, abs=2)


def test_a_gap_just_before_the_end_is_found_too() -> None:
    rig = Rig(ScopeFault(kind="gap", time=0.9, samples=5_000))
    rig.fails(SamplesLostError, "Samples are missing", seconds=1.0)


def test_polling_later_than_the_ring_lasts_is_a_loss() -> None:
    rig = Rig(ring=1 << 12)
    rig.fails(SamplesLostError, "polled 0.05 s after .* holds 0.041 s", step=0.05)
    assert rig.library.device.dropped > 0


def test_a_small_fifo_in_the_scope_starves_and_shows() -> None:
    rig = Rig(make=UnitModel(fifo=1_500))
    rig.fails(SamplesLostError, "Samples are missing|few")
    assert rig.library.device.dropped > 0


def test_buffer_stall() -> None:
    rig = Rig(ScopeFault(kind="stall", time=0.3))
    rig.fails(SamplesLostError, "overwritten; lower the sample rate")
    rig.works()


def test_overrange_on_a_schedule() -> None:
    rig = Rig(ScopeFault(kind="overrange", time=0.05, duration=0.04, inputs=("C",)))
    flags = []
    with rig.clock.taking_part("scope"):
        rig.scope.open()
        rig.scope.start(FOUR, 1e-5)
        for _ in range(6):
            rig.clock.sleep_until(rig.clock.now() + 0.02)
            block = rig.scope.poll()
            assert block is not None
            flags.append(block.overrange)
            if block.overrange[2]:
                assert block.codes[2].max() == 32512
    assert [f[2] for f in flags] == [False, False, True, True, True, False]
    assert not any(f[0] or f[1] or f[3] for f in flags)
    rig.scope.close()


def test_usb2_port_is_refused_unless_allowed() -> None:
    make = UnitModel(usb="2.0", powers=(0x11E,))
    Rig(make=make).fails(LimitError, "USB 2 port.*allow_usb2 = true")
    rig = Rig(make=make, allow_usb2=True)
    rig.stream(0.1)
    assert rig.scope.settings()["usb"] == "2.0"
    assert "NON_USB3_0_PORT" in rig.scope.settings()["power"]


def test_too_fast_for_usb2() -> None:
    rig = Rig(make=UnitModel(usb="2.0", powers=(0x11E,)), allow_usb2=True)
    rig.fails(
        LimitError, "sample rate is impossible.*record.sample_rate", interval=64e-9
    )
    Rig().stream(1e-3, interval=64e-9, step=1e-4)


def test_missing_mains_adapter_is_refused_unless_allowed() -> None:
    make = UnitModel(powers=(0x11A,))
    rig = Rig(make=make)
    rig.fails(LimitError, "mains adapter is not connected.*allow_usb_power = true")
    assert not rig.library.device.is_open
    Rig(make=make, allow_usb_power=True).works()


def test_two_power_states_one_after_the_other() -> None:
    make = UnitModel(powers=(0x11A, 0x11E), usb="2.0")
    Rig(make=make, allow_usb_power=True).fails(LimitError, "allow_usb2")
    Rig(make=make, allow_usb2=True, allow_usb_power=True).works()


def test_undervoltage_cannot_be_acknowledged() -> None:
    make = UnitModel(powers=(0x11A, 0x11C))
    rig = Rig(make=make, allow_usb_power=True)
    rig.fails(RefusedError, "cannot feed the scope; use the mains adapter")


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("supply_lost", "mains adapter is not connected"),
        ("supply_connected", "was plugged in, which aborts streaming"),
    ],
)
def test_power_that_changes_while_streaming(kind: str, text: str) -> None:
    rig = Rig(ScopeFault(kind=kind, time=0.5), allow_usb_power=True)  # type: ignore[arg-type]
    with pytest.raises(RefusedError, match=text):
        rig.stream(2.0)
    assert rig.samples == pytest.approx(48_000, abs=2_100)
    rig.works()


def test_power_lost_while_streaming_needs_leave_to_go_on() -> None:
    rig = Rig(ScopeFault(kind="supply_lost", time=0.5))
    with pytest.raises(RefusedError):
        rig.stream(2.0)
    with pytest.raises(LimitError, match="allow_usb_power"):
        rig.stream(0.1)
    rig.scope.close()


def test_undervoltage_while_streaming() -> None:
    rig = Rig(ScopeFault(kind="undervoltage", time=0.5))
    rig.fails(RefusedError, "cannot feed the scope")


def test_inputs_that_are_off_on_usb_power() -> None:
    make = UnitModel(powers=(0x11A,), usb_powered_inputs="AB")
    rig = Rig(make=make, allow_usb_power=True)
    rig.fails(RefusedError, r"input C \(V_K\).*connect the mains adapter")


@pytest.mark.parametrize("code", [0x27, 0x43])
def test_busy_and_overlap_answers_are_asked_again(code: int) -> None:
    rig = Rig(
        *(
            ScopeFault(
                kind="status",
                call="GetStreamingLatestValues",
                nth=n,
                code=code,
                times=3,
            )
            for n in (2, 6)
        )
    )
    rig.works()


def test_another_program_has_it() -> None:
    rig = Rig(make=UnitModel(taken=True))
    rig.fails(NotFoundError, "close other programs")


def test_another_serial_number_is_asked_for() -> None:
    rig = Rig(serial="AB999/999")
    rig.fails(NotFoundError, "Scope AB999/999 is not attached, but SIM04/0001")
    Rig(serial="SIM04/0001").works()


def test_a_library_that_opens_another_scope_than_asked_for_is_noticed() -> None:
    rig = Rig(serial="AB999/999")
    open_any = rig.library.device.open
    rig.library.device.open = lambda _: open_any(None)  # type: ignore[method-assign]
    rig.fails(NotFoundError, "Asked for scope AB999/999, the library opened SIM04/0001")


def test_hub_reset_brings_the_same_scope_back() -> None:
    rig = Rig(ScopeFault(kind="reset", time=0.4))
    rig.fails(LinkLostError, "unplugged")
    rig.works()


def test_an_unknown_status_is_shown_as_a_number() -> None:
    rig = Rig(ScopeFault(kind="status", call="RunStreaming", code=0x1234))
    rig.fails(InstrumentError, "PICO_STATUS 0x1234, unknown")


def test_random_busyness_never_loses_a_sample() -> None:
    random = np.random.default_rng(4)
    nths = np.sort(random.choice(np.arange(2, 200), 40, replace=False))
    rig = Rig(
        *(
            ScopeFault(
                kind="status",
                call="GetStreamingLatestValues",
                nth=int(n),
                code=int(random.choice([0x27, 0x43])),
                times=int(random.integers(1, 3)),
            )
            for n in nths
        )
    )
    rig.works()


def test_every_status_of_the_table_becomes_one_of_our_errors() -> None:
    from drivers.picoscope.status import MEANINGS, failure

    for code in MEANINGS:
        assert isinstance(failure(code, "Testing"), TactileLabError)
        assert f"0x{code:X}" in str(failure(code, "Testing"))


def test_samples_left_unread_because_it_was_busy_are_no_loss() -> None:
    # the third poll reaches the ring's end, and the call for the rest meets a busy one
    busy = ScopeFault(kind="status", call="GetStreamingLatestValues", nth=4, code=0x27)
    rig = Rig(busy, ring=3000)
    rig.stream(0.14, step=0.014)
    assert rig.samples == 14_000
    rig.scope.close()


def test_an_input_that_has_no_power_counts_as_switched_off() -> None:
    make = UnitModel(powers=(0x11A,), usb_powered_inputs="AB")
    rig = Rig(make=make, allow_usb_power=True)
    rig.scope.open()
    rig.scope.start(FOUR[:2], 1e-5)
    rig.scope.close()


def test_a_model_with_two_inputs() -> None:
    rig = Rig(make=UnitModel(variant="3203D"))
    rig.scope.open()
    assert rig.scope.capability.inputs == ("A", "B")
    with pytest.raises(LimitError, match="the scope has A, B"):
        rig.scope.start(FOUR, 1e-5)
    rig.scope.start(FOUR[:2], 1e-5)
    rig.scope.close()


def test_what_the_last_poll_found_is_raised_by_the_stop_and_only_once() -> None:
    rig = Rig()
    with rig.clock.taking_part("scope"):
        rig.scope.open()
        rig.scope.start(FOUR, 1e-5)
        for lost in (0, 0, 0, 700):
            rig.clock.sleep_until(rig.clock.now() + 0.02)
            rig.library.device.drop(lost)
            assert rig.scope.poll() is not None
        with pytest.raises(SamplesLostError, match="about 700 too few"):
            rig.scope.stop()
        rig.scope.stop()
        rig.scope.close()


@pytest.mark.parametrize(
    ("late", "begins", "lasts"),
    [(1_500, 0.95, 0.3), (60_000, 0.3, 0.65)],
    ids=["at the end", "a part of each poll, and the rest much later"],
)
def test_samples_that_come_late_are_not_called_lost(
    late: int, begins: float, lasts: float
) -> None:
    rig = Rig(
        ScopeFault(kind="late", time=begins, samples=late, duration=lasts),
        lag_tolerance=0.01,
    )
    rig.stream(1.0)
    rig.works()


@pytest.mark.parametrize("begins", [0.5, 0.97])
def test_samples_lost_shortly_before_the_end_are_told(begins: float) -> None:
    rig = Rig(ScopeFault(kind="gap", time=begins, samples=1_500), lag_tolerance=0.01)
    rig.fails(SamplesLostError, "about 15[0-9][0-9] too few", seconds=1.0)


def test_a_call_that_takes_longer_than_the_ring_holds_has_lost_nothing() -> None:
    """What the library hands over meanwhile is copied as it comes."""
    rig = Rig(make=UnitModel(parts=8), ring=3_000, lag_tolerance=0.01)
    device = rig.library.device
    render = device.source.render

    class Slow:
        def render(self, acquisition, first, samples):
            if 30_000 <= first < 60_000:  # ten times in a row, within the polls
                rig.clock.sleep_until(rig.clock.now() + 0.02)
            return render(acquisition, first, samples)

    device.source = Slow()
    rig.stream(1.0)
    assert rig.samples > 90_000
