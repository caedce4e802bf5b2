"""Block-mode C functions of the simulated ps3000a library."""

from __future__ import annotations

from ctypes import POINTER, c_float, c_int16, c_int32, c_uint32, c_void_p
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_backend.picoscope import codes as unit
from sim_backend.picoscope.scope import SimulatedPicoScope
from sim_backend.picoscope.sdk_header import BlockReady, header


class BlockFunctions:
    """The functions that capture into the unit's memory; prototypes from the header."""

    device: SimulatedPicoScope
    buffers: dict[int, NDArray[np.int16]]

    @header(c_int16, c_int16, c_int32, c_int16, c_int32, c_uint32, c_int16)
    def _set_simple_trigger(
        self, enable: int, source: int, threshold: int, direction: int, delay: int,
        automatic_ms: int,
    ) -> int:  # fmt: skip
        if enable and delay:
            return unit.INVALID_PARAMETER
        return self.device.memory.set_trigger(
            bool(enable), source, threshold, direction, automatic_ms
        )

    @header(c_int16, c_uint32, POINTER(c_int32))
    def _memory_segments(self, segments: int, most: Any) -> int:
        if segments == 0 or not most:
            return unit.INVALID_PARAMETER
        self.device.memory.segments = segments
        most[0] = self.device.memory.capacity(1)
        return unit.OK

    @header(
        c_int16,
        c_uint32,
        c_int32,
        POINTER(c_float),
        c_int16,
        POINTER(c_int32),
        c_uint32,
    )
    def _get_timebase2(
        self, timebase: int, samples: int, interval_ns: Any, oversample: int, most: Any,
        segment: int,
    ) -> int:  # fmt: skip
        memory, inputs = self.device.memory, len(self.device.settings)
        interval = memory.interval(timebase, inputs)
        if interval is None:
            return unit.INVALID_TIMEBASE
        if segment >= memory.segments:
            return unit.INVALID_PARAMETER
        if samples > memory.capacity(inputs):
            return unit.TOO_MANY_SAMPLES
        if interval_ns:
            interval_ns[0] = interval * 1e9
        if most:
            most[0] = memory.capacity(inputs)
        return unit.OK

    @header(
        c_int16, c_int32, c_int32, c_uint32, c_int16, POINTER(c_int32), c_uint32,
        BlockReady, c_void_p,
    )  # fmt: skip
    def _run_block(
        self, before: int, after: int, timebase: int, oversample: int, indisposed: Any,
        segment: int, ready: Any, parameter: int | None,
    ) -> int:  # fmt: skip
        if ready or segment or before < 0 or after < 0:
            # a callback would have to come from another thread; IsReady is simulated
            return unit.INVALID_PARAMETER
        if indisposed:
            indisposed[0] = 0
        return self.device.memory.run(self.device.settings, before, after, timebase)

    @header(c_int16, POINTER(c_int16))
    def _is_ready(self, ready: Any) -> int:
        ready[0] = int(self.device.memory.ready())
        return unit.OK

    @header(
        c_int16, c_uint32, POINTER(c_uint32), c_uint32, c_int32, c_uint32,
        POINTER(c_int16),
    )  # fmt: skip
    def _get_values(
        self, start: int, samples: Any, ratio: int, mode: int, segment: int,
        overflow: Any,
    ) -> int:  # fmt: skip
        if not samples or start or ratio > 1 or mode or segment:
            return unit.INVALID_PARAMETER
        status, rows, bits = self.device.memory.values()
        if status != unit.OK:
            return status
        if any(number not in self.buffers for number in rows):
            return unit.BUFFERS_NOT_SET
        count = min([samples[0], *(codes.size for codes in rows.values())])
        for number, codes in rows.items():
            if count > self.buffers[number].size:
                return unit.INVALID_PARAMETER
            self.buffers[number][:count] = codes[:count]
        samples[0] = count
        if overflow:
            overflow[0] = bits
        return unit.OK
