"""What `data.h5` holds: every dataset is declared before the first sample.

    /samples/<signal>   codes, int8 or int16; signal = gain * code + offset
    /pyramid/<signal>   smallest, largest and sum of the codes of each `bin` samples
    /checks/<signal>    per chunk: samples in it, CRC-32 of their codes
    /segments           stretches without a gap, and where they lie in time
    /gaps /overrange    samples that never came; blocks in which an input left its range
    /spikes             found on line
    /current /field     applied current, teslameter readings
    /temperature        of the sensor, where a scope channel carries it
    /voltages           what source meters hold, read back
    /trials /pauses /events

SWMR allows no new datasets, attributes or variable-length types once writing has
started, hence fixed records. All times are in s on the run's axis, whose zero is the
first sample of the run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import h5py
import hdf5plugin
import numpy as np

from tactile_lab.errors import RecordingError
from tactile_lab.scope import Stream
from tactile_lab.signals import SIGNALS
from tactile_lab.spikes.detection import Detection
from tactile_lab.store.folder import SCHEMA

BIN = 512
"""Samples under one entry of the pyramid."""

CHUNK_TIME = 0.25
"""Length of one chunk, s: what a crash can cost at most."""

CHECK = np.dtype([("samples", "u4"), ("crc32", "u4")])
TABLES = {
    "segments": "first i8 sample, time f8 s, interval f8 s, host f8 s, drift f8 s/s, "
    "uncertainty f8 s",
    "gaps": "sample i8 sample, missing i8 sample, time f8 s",
    "overrange": "sample i8 sample, samples i8 sample, channels u4 bit per row",
    "spikes": "sample f8 sample, time f8 s, amplitude i2 code, width f4 sample",
    "current": "time f8 s, setpoint f8 A, measured f8 A, resistance_ratio f8 1, "
    "listed u1, asked f8 s, acted f8 s",
    "field": "time f8 s, field f8 T",
    "temperature": "time f8 s, temperature f8 K",
    "voltages": "time f8 s, name S8, setpoint f8 V, measured f8 V, current f8 A",
    "trials": "index u4, start f8 s, end f8 s, level f8 N, hold_start f8 s, "
    "hold_end f8 s, onset f8 s, spikes u4, skipped u4, pause u1, label S48, "
    "rest_V_C1 f8 V, drift_V_C1 f8 V, complete u1",
    "pauses": "start f8 s, end f8 s",
    "events": "time f8 s, kind S16, text S160",
}
"""Columns of each table: name, numpy's type, unit."""

RECORDS = {
    table: np.dtype([tuple(column.split(" ")[:2]) for column in columns.split(", ")])
    for table, columns in TABLES.items()
}
"""Type of each table's rows."""

NEWER = ("temperature", "voltages")
"""Tables that runs of former versions lack."""

PYRAMID_CHUNK = 8192
"""Entries in one chunk of the pyramid: few reads for a view of a whole run."""

SLOW_CHUNK = 256
"""Records in one chunk of the slow datasets."""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """What one run stores, known before it starts.

    Attributes:
        signals: scope channels to store; others may stream for detection only.
        detection: how spikes are found on line; None where nothing is searched.
        simulated: whether physics was computed.
        attributes: calibration and other constants, put on the file's root.
    """

    signals: tuple[str, ...]
    detection: Detection | None = None
    simulated: bool
    attributes: Mapping[str, float | str | bool] = field(default_factory=dict)

    def rows(self, stream: Stream) -> tuple[int, ...]:
        """Rows of the stream's blocks that are stored, in the order of `signals`.

        Raises:
            RecordingError: a signal to store is not streamed.
        """
        names = [channel.signal for channel in stream.channels]
        missing = [name for name in self.signals if name not in names]
        if missing:
            raise RecordingError(
                f"{', '.join(missing)} shall be stored but the scope streams only "
                f"{', '.join(names) or 'nothing'}."
            )
        return tuple(names.index(name) for name in self.signals)


def pyramid_record(code: np.dtype[Any]) -> np.dtype[Any]:
    """One entry of the pyramid over codes of that type."""
    return np.dtype([("low", code), ("high", code), ("sum", "i4")])


def chunk_length(interval: float) -> int:
    """Samples in one chunk: a power of two near `CHUNK_TIME`, 1024 to 2^20."""
    wanted = max(1.0, CHUNK_TIME / interval)
    return int(2 ** np.clip(round(np.log2(wanted)), 10, 20))


def declare(file: h5py.File, layout: Layout, stream: Stream | None) -> None:
    """Create every dataset and attribute of a run; afterwards SWMR may start.

    Args:
        file: new and open for writing.
        layout: what to store.
        stream: scaling of the samples; None where the run has no scope.
    """
    file.attrs.update(schema=SCHEMA, simulated=layout.simulated, **layout.attributes)
    for name, record in RECORDS.items():
        columns = [column.split(" ", 2) for column in TABLES[name].split(", ")]
        units = [f"{one[0]}: {one[2]}" for one in columns if len(one) > 2]
        create_table(file, name, record).attrs["units"] = ", ".join(units)
    spikes = file["spikes"].attrs
    if layout.detection is not None:
        spikes.update(asdict(layout.detection))
    if stream is None:
        return
    for row, channel in enumerate(stream.channels):
        if layout.detection is not None and channel.signal == layout.detection.signal:
            spikes["gain"], spikes["offset"] = stream.volts_per_code(row)
    chunk = chunk_length(stream.interval)
    file.attrs.update(interval=stream.interval, full_scale=stream.full_scale)
    if stream.record is not None:
        file.attrs["record"] = stream.record
    code = np.dtype(np.int8 if stream.shift == 8 else np.int16)
    for row in layout.rows(stream):
        channel = stream.channels[row]
        gain, offset = stream.volts_per_code(row)
        scale = 256 if stream.shift == 8 else 1
        samples = create_channel(file, channel.signal, code, chunk)
        signal = SIGNALS.get(channel.signal)
        samples.attrs.update(
            unit=signal.unit if signal else "V",
            gain=gain * scale,
            offset=offset,
            code_scale=scale,
            interval=stream.interval,
            input=channel.input,
            range=channel.range,
            analogue_offset=channel.offset,
            coupling=channel.coupling,
            scale=channel.scale,
            row=layout.signals.index(channel.signal),
        )


def create_table(file: h5py.File, name: str, record: np.dtype[Any]) -> h5py.Dataset:
    """Create an empty dataset of fixed records."""
    return file.create_dataset(
        name, (0,), record, maxshape=(None,), chunks=(SLOW_CHUNK,), fletcher32=True
    )


def create_channel(
    file: h5py.File, signal: str, code: np.dtype[Any], chunk: int
) -> h5py.Dataset:
    """Create one channel's samples (returned), checks and pyramid, all empty."""
    # damaged bytes make the filter crash; their checksum is looked at before
    samples = file.create_dataset(
        f"samples/{signal}",
        (0,),
        code,
        maxshape=(None,),
        chunks=(chunk,),
        fletcher32=True,
        **hdf5plugin.Bitshuffle(),
    )
    pyramid = file.create_dataset(
        f"pyramid/{signal}",
        (0,),
        pyramid_record(code),
        maxshape=(None,),
        chunks=(PYRAMID_CHUNK,),
        fletcher32=True,
    )
    pyramid.attrs["bin"] = BIN
    create_table(file, f"checks/{signal}", CHECK)
    return samples
