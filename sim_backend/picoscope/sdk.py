"""The ps3000a library's C functions in front of a simulated PicoScope.

Prototypes are written from the vendor's header (ps3000aApi.h), not taken from the
driver's table, so that a wrong width in one of them shows.
"""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Callable, Sequence
from ctypes import (
    POINTER,
    c_double,
    c_float,
    c_int8,
    c_int16,
    c_int32,
    c_uint32,
    c_void_p,
)
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from sim_backend.picoscope import codes as unit
from sim_backend.picoscope.faults import ScopeFault
from sim_backend.picoscope.generator import (
    CLOCK,
    MEMORY,
    PHASE,
    Output,
    SimulatedGenerator,
    nowhere,
)
from sim_backend.picoscope.scope import SimulatedPicoScope, UnitModel
from sim_backend.plant.scope_source import SampleSource
from tactile_lab.clock import Clock

_TIME_UNITS = {0: 1e15, 1: 1e12, 2: 1e9, 3: 1e6, 4: 1e3, 5: 1.0}
_HANDLE = 1

if sys.platform == "win32":
    convention = ctypes.WINFUNCTYPE
else:
    convention = ctypes.CFUNCTYPE

# typedef void (*ps3000aStreamingReady)(...)
StreamingReady = convention(
    None, c_int16, c_int32, c_uint32, c_int16, c_uint32, c_int16, c_int16, c_void_p
)

_Method = TypeVar("_Method", bound=Callable[..., int])


FUNCTIONS: dict[str, tuple[Callable[..., int], tuple[Any, ...]]] = {}
"""Method and argument types of each C function, by its name without "ps3000a"."""


def header(*argtypes: Any) -> Callable[[_Method], _Method]:
    """Enter a method ``_do_it`` as the C function ``ps3000aDoIt`` with these arguments.

    A first argument of int16_t is the handle, which the method does not get.
    """

    def enter(method: _Method) -> _Method:
        name = method.__name__.title().replace("_", "")
        FUNCTIONS[name] = (method, argtypes)
        return method

    return enter


class FakePs3000a:
    """An object with the C function pointers of libps3000a.

    What goes wrong inside is remembered in `errors` and answered with
    PICO_OPERATION_FAILED, because an exception cannot pass through C.

    Args:
        source: what lies at the scope's inputs.
        clock: the time the scope lives in.
        make: what the scope is and how it is connected.
        faults: what goes wrong, and when.
        output: what the waveform generator is wired to.
    """

    def __init__(
        self,
        source: SampleSource,
        clock: Clock,
        make: UnitModel | None = None,
        faults: Sequence[ScopeFault] = (),
        output: Output = nowhere,
    ) -> None:
        error = (make or UnitModel()).clock_error
        self.generator = SimulatedGenerator(clock, output, error)
        self.device = SimulatedPicoScope(source, clock, make or UnitModel(), faults)
        self.errors: list[BaseException] = []
        self.in_callback = False
        self._busy = threading.Lock()
        self.buffers: dict[int, NDArray[np.int16]] = {}
        for name, (method, argtypes) in FUNCTIONS.items():
            entry = convention(c_uint32, *argtypes)(self._guarded(name, method))
            setattr(self, f"ps3000a{name}", entry)

    def raise_errors(self) -> None:
        """Raise the oldest exception that was answered with OPERATION_FAILED."""
        if self.errors:
            raise self.errors.pop(0)

    def _guarded(self, name: str, method: Any) -> Callable[..., int]:
        takes_handle = name not in ("OpenUnit", "EnumerateUnits")

        def entry(*arguments: Any) -> int:
            if not self._busy.acquire(blocking=False):
                return unit.USER_CALLBACK if self.in_callback else unit.DRIVER_FUNCTION
            try:
                if takes_handle and arguments[0] != _HANDLE:
                    return unit.INVALID_HANDLE
                status = self.device.enter(name)
                if name == "CloseUnit":
                    self.device.close()
                if status != unit.OK:
                    return status
                return int(method(self, *arguments[1 if takes_handle else 0 :]))
            except BaseException as error:
                self.errors.append(error)
                return unit.OPERATION_FAILED
            finally:
                self._busy.release()

        return entry

    @header(POINTER(c_int16), POINTER(c_int8))
    def _open_unit(self, handle: Any, serial: Any) -> int:
        if not handle:
            return unit.NULL_PARAMETER
        text = ctypes.string_at(serial).decode("ascii") if serial else None
        status = self.device.open(text)
        handle[0] = 0 if status == unit.NOT_FOUND else _HANDLE
        return status

    @header(POINTER(c_int16), POINTER(c_int8), POINTER(c_int16))
    def _enumerate_units(self, count: Any, serials: Any, length: Any) -> int:
        make = self.device.make
        text = ",".join((make.serial, *make.others)).encode() + b"\0"
        if not count or not length or not serials or length[0] < len(text):
            return unit.NULL_PARAMETER
        count[0], length[0] = 1 + len(make.others), len(text)
        ctypes.memmove(serials, text, len(text))
        return unit.OK

    @header(c_int16)
    def _close_unit(self) -> int:
        self.buffers.clear()
        return unit.OK

    @header(c_int16, POINTER(c_int8), c_int16, POINTER(c_int16), c_uint32)
    def _get_unit_info(self, string: Any, length: int, needed: Any, info: int) -> int:
        make = self.device.make
        # PICO_DRIVER_VERSION, PICO_USB_VERSION, PICO_HARDWARE_VERSION, ...
        known = {
            0: "PS3000A simulated 1.0", 1: make.usb, 2: "1", 3: make.variant,
            4: make.serial, 5: "01Jan26", 6: "1.0", 9: "1.0.0.0", 10: "1.0.0.0",
        }  # fmt: skip
        if info not in known:
            return unit.INVALID_PARAMETER
        text = known[info].encode() + b"\0"
        if needed:
            needed[0] = len(text)
        if not string or length < len(text):
            return unit.NULL_PARAMETER
        ctypes.memmove(string, text, len(text))
        return unit.OK

    @header(c_int16)
    def _ping_unit(self) -> int:
        return unit.OK

    @header(c_int16, c_uint32)
    def _change_power_source(self, power: int) -> int:
        return self.device.acknowledge(power)

    @header(c_int16, POINTER(c_int16))
    def _maximum_value(self, value: Any) -> int:
        value[0] = unit.FULL_SCALE
        return unit.OK

    @header(c_int16, c_int32, c_int32, POINTER(c_float), POINTER(c_float))
    def _get_analogue_offset(
        self, scale: int, coupling: int, most: Any, least: Any
    ) -> int:
        if scale not in unit.RANGE_VOLTS:
            return unit.INVALID_VOLTAGE_RANGE
        if coupling not in unit.COUPLING_NAMES:
            return unit.INVALID_COUPLING
        most[0], least[0] = unit.offset_limit(scale), -unit.offset_limit(scale)
        return unit.OK

    @header(c_int16, c_int32, c_int16, c_int32, c_int32, c_float)
    def _set_channel(
        self, channel: int, enabled: int, coupling: int, scale: int, offset: float
    ) -> int:
        return self.device.set_input(channel, bool(enabled), coupling, scale, offset)

    @header(c_int16, c_int16, c_int32, c_int16, c_int32, c_uint32, c_int16)
    def _set_simple_trigger(
        self, enable: int, source: int, threshold: int, direction: int, delay: int,
        automatic_ms: int,
    ) -> int:  # fmt: skip
        # a stream that never ends waits for no trigger
        return unit.INVALID_PARAMETER if enable else unit.OK

    @header(c_int16, c_int32, POINTER(c_int16), c_int32, c_uint32, c_int32)
    def _set_data_buffer(
        self, channel: int, buffer: Any, length: int, segment: int, mode: int
    ) -> int:
        if channel not in range(self.device.make.inputs):
            return unit.INVALID_CHANNEL
        if segment != 0 or mode != 0 or length < 0:
            return unit.INVALID_PARAMETER
        self.buffers.pop(channel, None)
        if buffer and length:
            self.buffers[channel] = np.ctypeslib.as_array(buffer, (length,))
        return unit.OK

    @header(
        c_int16, POINTER(c_uint32), c_int32, c_uint32, c_uint32, c_int16, c_uint32,
        c_int32, c_uint32,
    )  # fmt: skip
    def _run_streaming(
        self, interval: Any, time_unit: int, before: int, after: int, auto_stop: int,
        ratio: int, mode: int, overview: int,
    ) -> int:  # fmt: skip
        if not interval:
            return unit.NULL_PARAMETER
        if time_unit not in _TIME_UNITS or auto_stop or ratio != 1 or mode or before:
            return unit.INVALID_PARAMETER
        used = [self.buffers.get(number) for number in self.device.settings]
        if any(buffer is None for buffer in used):
            return unit.BUFFERS_NOT_SET
        ring = min((len(buffer) for buffer in used if buffer is not None), default=0)
        if overview == 0 or overview > ring:
            return unit.INVALID_PARAMETER
        per_second = _TIME_UNITS[time_unit]
        status, actual = self.device.run(interval[0] / per_second, ring)
        interval[0] = round(actual * per_second)
        return status

    @header(c_int16, StreamingReady, c_void_p)
    def _get_streaming_latest_values(self, ready: Any, parameter: int | None) -> int:
        for _ in range(self.device.make.parts):
            status, part = self.device.read()
            if status != unit.OK:
                return status
            if part is None:
                if self.device.make.empty_callbacks and self.device.streaming:
                    self._announce(ready, 0, 0, 0, parameter)
                break
            samples = part.codes.shape[1]
            for row, number in enumerate(part.rows):
                place = self.buffers[number][part.start : part.start + samples]
                place[:] = part.codes[row]
            self._announce(ready, samples, part.start, part.overflow, parameter)
        return unit.OK

    def _announce(
        self, ready: Any, samples: int, start: int, overflow: int, p: int | None
    ) -> None:
        self.in_callback = True
        try:
            ready(_HANDLE, samples, start, overflow, 0, 0, 0, p)
        finally:
            self.in_callback = False

    @header(c_int16)
    def _stop(self) -> int:
        return self.device.stop()

    @header(
        c_int16, c_int32, c_uint32, c_int16, c_float, c_float, c_float, c_float,
        c_int32, c_int32, c_uint32, c_uint32, c_int32, c_int32, c_int16,
    )  # fmt: skip
    def _set_sig_gen_built_in(
        self, offset: int, peaks: int, wave: int, *rest: Any
    ) -> int:
        if self.device.streaming:
            return unit.BUSY
        # PS3000A_DC_VOLTAGE, the only one that is of use here; triggered by nothing
        if wave != 8 or peaks or any(rest):
            return unit.INVALID_PARAMETER
        return self.generator.hold(offset)

    @header(
        c_int16, c_int32, c_uint32, c_uint32, c_uint32, c_uint32, c_uint32,
        POINTER(c_int16), c_int32, c_int32, c_int32, c_int32, c_uint32, c_uint32,
        c_int32, c_int32, c_int16,
    )  # fmt: skip
    def _set_sig_gen_arbitrary(
        self, offset: int, peaks: int, start: int, stop: int, increment: int,
        dwell: int, samples: Any, size: int, sweep: int, operation: int, index: int,
        shots: int, sweeps: int, edge: int, trigger: int, level: int,
    ) -> int:  # fmt: skip
        if self.device.streaming:
            return unit.BUSY
        if not samples:
            return unit.NULL_PARAMETER
        unused = (increment, dwell, sweep, operation, index, sweeps, edge, level)
        # one shot at the software's trigger (PS3000A_SIGGEN_SOFT_TRIG)
        if start != stop or any(unused) or shots != 1 or trigger != 4:
            return unit.INVALID_PARAMETER
        return self.generator.load(offset, peaks, start, samples[:size])

    @header(
        c_int16, POINTER(c_int16), POINTER(c_int16), POINTER(c_uint32),
        POINTER(c_uint32),
    )  # fmt: skip
    def _sig_gen_arbitrary_min_max_values(
        self, low: Any, high: Any, least: Any, most: Any
    ) -> int:
        low[0], high[0], least[0], most[0] = -32768, 32767, 1, MEMORY
        return unit.OK

    @header(c_int16, c_double, c_int32, c_uint32, POINTER(c_uint32))
    def _sig_gen_frequency_to_phase(
        self, frequency: float, index: int, length: int, phase: Any
    ) -> int:
        if index:
            return unit.INVALID_PARAMETER
        phase[0] = round(frequency * length / MEMORY * PHASE / CLOCK)
        return unit.OK

    @header(c_int16, c_int16)
    def _sig_gen_software_control(self, state: int) -> int:
        return self.generator.trigger()
