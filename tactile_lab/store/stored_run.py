"""Reads a run back: arrays with units, loaded only as far as they are indexed."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RunFolderError, to_type
from tactile_lab.quantity import count, show
from tactile_lab.spikes.detection import Detection
from tactile_lab.spikes.rate import rate_changes
from tactile_lab.store.applied import (
    BY_SAMPLES,
    VISIBLE,
    VISIBLE_CODES,
    AppliedCurrent,
    applied_current,
)
from tactile_lab.store.data_file import check_inside, open_data
from tactile_lab.store.folder import (
    DATA,
    SCENE,
    has_lost_data,
    is_live,
    read_info,
)
from tactile_lab.store.layout import NEWER, RECORDS
from tactile_lab.store.shunt import Shunt, shunt_of
from tactile_lab.store.signal import StoredSignal, TimeAxis
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.scene.scene import Scene

Records = NDArray[Any]

MOST_UNWRITTEN = 1 << 20
"""Rows that a table may claim beyond those it holds, as one that was cut short does."""


class StoredRun:
    """One run on disk, running, complete or cut short.

    Attributes:
        path: the folder.
        info: what `run.json` says.
    """

    def __init__(self, path: Path, info: dict[str, Any], file: h5py.File) -> None:
        self.path = path
        self.info = info
        self._file = file

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Open the run in folder `path` for reading, also while it is written.

        Raises:
            RunFolderError: not a run folder, or its data cannot be read.
        """
        path = Path(path)
        info = read_info(path)
        file, again = path / DATA, to_type("run", "--again", path)
        if has_lost_data(path, info):
            raise RunFolderError(
                f"{path} has no {DATA}, which was written: it was moved or deleted. "
                f"Put it back; `{again}` repeats the run."
            )
        if not file.exists():
            status = info["status"]
            how = "was cut short" if status == "running" else f"ended ({status})"
            shown = "says why" if info.get("reason") else "tells what it was to use"
            raise RunFolderError(
                f"{path} has no {DATA}: the run {how} before the first "
                f"sample was stored. `tactile-lab show` {shown}; "
                f"`{again}` repeats it."
            )
        try:
            live = info["status"] == "running" and is_live(path)
            opened = open_data(file, live=live)
            try:
                opened.attrs["schema"], opened["events"]  # the last that was declared
                check_inside(opened)
            except BaseException:
                opened.close()
                raise
        except (OSError, KeyError, RuntimeError) as error:
            raise RunFolderError(
                f"{file} cannot be read: {error}. A run that was cut short before its "
                "first sample has nothing to read; else `tactile-lab verify` says "
                "where the file is damaged."
            ) from error
        return cls(path, info, opened)

    @property
    def name(self) -> str:
        """Of its folder, also where that was given as `.`."""
        return self.path.resolve().name

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def refresh(self) -> None:
        """See what a living writer has added since."""
        self.info = read_info(self.path)
        for name in ("applied", "axis", "force", "samples"):
            vars(self).pop(name, None)

        def renew(name: str, node: Any) -> None:
            if isinstance(node, h5py.Dataset):
                node.refresh()

        self._file.visititems(renew)

    @property
    def status(self) -> str:
        """Running, complete, aborted, faulted or recovered."""
        return str(self.info["status"])

    @property
    def simulated(self) -> bool:
        """Whether physics was computed."""
        return bool(self._file.attrs["simulated"])

    @property
    def attributes(self) -> dict[str, Any]:
        """Calibration and other constants of the run."""
        return dict(self._file.attrs)

    @property
    def gapless(self) -> bool:
        """Whether a missing sample is a lost sample: not from a scope that polls."""
        return "record" not in self._file.attrs

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals stored sample by sample."""
        group = self._file.get("samples")
        return () if group is None else tuple(group)

    @property
    def checked(self) -> tuple[str, ...]:
        """Names of the signals that have checksums or a pyramid."""
        groups = (self._file.get(kind) for kind in ("checks", "pyramid"))
        return tuple(sorted({name for group in groups for name in group or ()}))

    @cached_property
    def samples(self) -> int:
        """Samples per channel that all channels have, checksum included."""
        lengths = [self.stored(name) for name in self.signals]
        return min(lengths, default=0)

    def signal(self, name: str) -> StoredSignal:
        """A stored signal by name, such as "V_C1".

        Raises:
            RunFolderError: the run did not store it.
        """
        if name not in self.signals:
            raise RunFolderError(
                f"{self.path} stores no {name}; it stores "
                f"{', '.join(self.signals) or 'no samples'}."
            )
        samples, _, pyramid = self.column(name)
        return StoredSignal(name, samples, pyramid, self.samples, self.axis)

    def column(self, name: str) -> tuple[h5py.Dataset, h5py.Dataset, h5py.Dataset]:
        """Datasets of one channel as stored: samples, checks, pyramid."""
        kinds = ("samples", "checks", "pyramid")
        samples, checks, pyramid = (self._file[f"{kind}/{name}"] for kind in kinds)
        return samples, checks, pyramid

    def overrange(self, name: str) -> FloatArray:
        """Stretches in which a stored signal left its range, shape (k, 2), s.

        The scope tells it block by block: a stretch is as long as the blocks are.
        """
        rows = self.records("overrange")
        rows = rows[rows["channels"] >> self.signal(name).row & 1 == 1]
        if not rows.size:
            return np.empty((0, 2))
        first, stop = rows["sample"], rows["sample"] + rows["samples"]
        edges = [0, *(np.flatnonzero(first[1:] != stop[:-1]) + 1).tolist(), rows.size]
        joined = [(first[a], stop[b - 1]) for a, b in pairwise(edges)]
        return self.axis.time_of(np.array(joined))

    @cached_property
    def axis(self) -> TimeAxis:
        """Where stored samples lie in time."""
        rows = self.records("segments")
        return TimeAxis(
            rows["first"].copy(),
            rows["time"].copy(),
            rows["interval"] * (1.0 + rows["drift"]),
        )

    @property
    def duration(self) -> float:
        """End of the newest sample, trial or reading, s on the run's axis."""
        ends = [0.0]
        if self.samples:
            ends.append(float(self.axis.time_of(float(self.samples))))
        trials = self.records("trials")
        ends += [float(last) for last in trials[ended(trials)]["end"][-1:]]
        ends += [float(last) for last in self.records("current")["time"][-1:]]
        return max(ends)

    def records(self, name: str) -> Records:
        """A table of fixed records by name; see `layout.RECORDS` for its fields.

        Empty where the run is older than the table.

        Raises:
            RunFolderError: it claims far more rows than it holds.
        """
        if name in NEWER and name not in self._file:
            return np.empty(0, RECORDS[name])
        table = self._file[name]
        held = table.id.get_storage_size() // table.dtype.itemsize
        if table.size > held + MOST_UNWRITTEN:
            raise RunFolderError(
                f"/{name} claims {table.size:,} rows and holds {held:,} at most: "
                f"{self.path / DATA} is damaged. `tactile-lab verify` says where else."
            )
        rows: Records = table[()]
        return rows

    def table(self, name: str) -> h5py.Dataset:
        """A table as the file holds it, unread."""
        return self._file[name]

    @property
    def spikes(self) -> Records:
        """Detected spikes: sample, time (s), amplitude (SI), width (s)."""
        rows = self.records("spikes")
        attrs = self._file["spikes"].attrs
        kind = np.dtype([(n, "f8") for n in ("sample", "time", "amplitude", "width")])
        spikes = np.empty(rows.size, kind)
        axis = self.axis
        spikes["sample"] = rows["sample"]
        spikes["time"] = rows["time"]
        if axis.first.size:
            spikes["time"] = axis.time_of(rows["sample"])
        gain, offset = attrs.get("gain", np.nan), attrs.get("offset", np.nan)
        if self.detection is not None:
            gain, offset = self.detection.amplitude_scale(gain, offset)
        spikes["amplitude"] = rows["amplitude"] * gain + offset
        step = axis.step[0] if axis.step.size else np.nan
        spikes["width"] = rows["width"] * step
        return spikes

    @property
    def detection(self) -> Detection | None:
        """How spikes were detected; None where nothing was searched."""
        attrs = self._file["spikes"].attrs
        if "signal" not in attrs:
            return None
        return Detection(
            signal=str(attrs["signal"]),
            threshold=int(attrs["threshold"]),
            hysteresis=int(attrs["hysteresis"]),
            refractory=int(attrs["refractory"]),
            polarity=1 if attrs["polarity"] > 0 else -1,
            kind="reset" if attrs["kind"] == "reset" else "crossing",
            span=int(attrs["span"]),
        )

    @property
    def gaps(self) -> Records:
        """Times without samples while the scope streamed: start, end (s), missing."""
        rows = self.records("gaps")
        gaps = np.empty(rows.size, [("start", "f8"), ("end", "f8"), ("missing", "i8")])
        interval = float(self.attributes.get("interval", 0.0))
        end: FloatArray = rows["time"]
        missing: FloatArray = rows["missing"] * interval
        gaps["start"], gaps["end"] = end - missing, end
        gaps["missing"] = rows["missing"]
        return gaps

    @property
    def trials(self) -> Records:
        """Trials: index, start, end (s), level (N), hold, spikes, label (bytes).

        One that was cut short, or goes on, is not `complete` and ends where the run was
        stopped; so does its hold, if it was reached. The fall after it is no trial's.
        Its spikes are those found by now: the last may have been over after its end.
        """
        rows = self.records("trials")
        for number in np.flatnonzero(~ended(rows)):
            row = rows[number]
            row["end"] = min(row["end"], self.duration, self.stopped)
            row["hold_end"] = min(row["hold_end"], row["end"] - row["start"])
            if not row["hold_start"] < row["hold_end"]:
                row["hold_start"] = row["hold_end"] = np.nan
        times = self.spikes["time"]
        first, stop = (np.searchsorted(times, rows[side]) for side in ("start", "end"))
        rows["spikes"] = stop - first
        return rows

    @property
    def stopped(self) -> float:
        """When the coil began to be made safe, s; infinite in a run that was not."""
        rows = self.records("events")
        return float(min(rows["time"][rows["kind"] == b"stopping"], default=np.inf))

    @property
    def current(self) -> Records:
        """Applied current: time (s), setpoint and measured (A; NaN where not read).

        Points of a list that the samples dated lie where the samples are now: their
        stretch was put in its place when it had ended.
        """
        rows = self.records("current")
        if "listed" in (rows.dtype.names or ()):
            dated = rows["listed"] == BY_SAMPLES
            rows["time"][dated] = self._in_place(rows["time"][dated])
        return rows

    def _in_place(self, time: FloatArray) -> FloatArray:
        """Where times of the samples as they came in lie, s; shape (n,)."""
        found = self.records("segments")
        if not found.size or not time.size:
            return time
        came_in = found["host"] - found["host"][0]
        k = np.clip(np.searchsorted(came_in, time, side="right") - 1, 0, None)
        since = (time - came_in[k]) * (1 + found["drift"][k])
        return np.asarray(found["time"][k] + since)

    @property
    def read_back(self) -> FloatArray:
        """Shape (n, 2): time, s, and coil current then, A: read back, else as sent."""
        rows = self.current
        read = np.where(np.isnan(rows["measured"]), rows["setpoint"], rows["measured"])
        return np.column_stack([rows["time"], read])

    @property
    def shunt(self) -> Shunt | None:
        """Reads the recorded coil current between two times; None without one."""
        if "coil_current" not in self.signals:
            return None
        signal = self.signal("coil_current")
        return shunt_of(signal, self.overrange("coil_current"))

    @property
    def visible_step(self) -> float:
        """Smallest step of the current an edge of which the shunt shows, A."""
        if "coil_current" not in self.signals:
            return VISIBLE
        return max(VISIBLE, VISIBLE_CODES * abs(self.signal("coil_current").gain))

    @cached_property
    def applied(self) -> AppliedCurrent:
        """What the source gave: levels as read back, edges by what the shunt saw.

        Raises:
            SceneError: the run's scene cannot be read any more.
        """
        rows = self.current
        columns = rows.dtype.names or ()  # older runs lack some
        return applied_current(
            rows["time"],
            rows["setpoint"],
            rows["measured"],
            self.shunt,
            self.scene.bench.magnet.coil_lag,
            rows["listed"] if "listed" in columns else False,
            rows["asked"] if "asked" in columns else np.nan,
            self.visible_step,
            rows["acted"] if "acted" in columns else np.nan,
        )

    @cached_property
    def scene(self) -> Scene:
        """The resolved scene that was run.

        Raises:
            SceneError: it cannot be read any more.
        """
        from tactile_lab.scene.load import load

        return load(self.path / SCENE)

    @cached_property
    def setpoint(self) -> Waveform:
        """What the coil's source was set to, A: each step until the next."""
        return Waveform.stairs(self.applied.steps, self.duration)

    @cached_property
    def force(self) -> Waveform:
        """The force that the applied current gives by the run's calibration, N.

        Raises:
            SceneError: the run's scene cannot be read any more.
        """
        return self.scene.bench.magnet.lagged_force(self.setpoint)[0]

    @property
    def field(self) -> Records:
        """Teslameter readings: time (s), field (T)."""
        return self.records("field")

    @property
    def temperature(self) -> Records:
        """Readings of the sensor's temperature: time (s), temperature (K)."""
        return self.records("temperature")

    @property
    def voltages(self) -> Records:
        """Held by source meters: time, s, name, setpoint, measured, V, current, A."""
        return self.records("voltages")

    @property
    def events(self) -> Records:
        """What happened: time (s), kind and text (bytes, UTF-8)."""
        return self.records("events")

    @property
    def rate(self) -> Records:
        """Instantaneous rate: when it changes, s, and to what, Hz.

        Each row holds until the next: 1/ISI from each spike on, 0 in silences and
        before the first row (`tactile_lab.spikes.rate`).
        """
        time, rate = rate_changes(self.spikes["time"], self.trials["start"])
        found = np.empty(time.size, [("time", "f8"), ("rate", "f8")])
        found["time"], found["rate"] = time, rate
        return found

    def stored(self, name: str) -> int:
        """Samples of one channel that have a checksum.

        Raises:
            RunFolderError: the checksums cannot be read.
        """
        samples, checks, _ = self.column(name)
        try:
            checked = int(checks["samples"].sum(dtype=np.int64))
        except OSError as error:
            then = "recover` makes whole a run that was cut off in the midst of a write"
            raise RunFolderError(
                f"{self.path / DATA}: the checksums of {name} cannot be read. "
                f"`tactile-lab {then}; `tactile-lab verify` says what else is damaged."
            ) from error
        return min(checked, int(samples.shape[0]))

    def __repr__(self) -> str:
        if not self._file:
            return f"<Run {self.name}: closed>"
        kind = "simulated" if self.simulated else "measured"
        trials, spikes = len(self.trials), len(self.table("spikes"))
        return (
            f"<Run of {self.info.get('scene') or self.name}: {self.status}, "
            f"{kind}, {show(self.duration, 's')}, {count(trials, 'trial')}, "
            f"{count(spikes, 'spike')}; {', '.join(self.signals) or 'no samples'}>"
        )


def ended(trials: Records) -> NDArray[np.bool_]:
    """Which of these trials came to their end; older runs stored only those.

    To be asked of the trials at hand: a run that goes on may have more by now.
    """
    if "complete" not in (trials.dtype.names or ()):
        return np.ones(trials.size, np.bool_)
    found: NDArray[np.bool_] = trials["complete"] != 0
    return found
