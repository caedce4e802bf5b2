"""A run on disk as scripts, notebooks and other libraries take it."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tactile_lab import notebook
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError, RunFolderError
from tactile_lab.model.drain_current import DrainCurrent
from tactile_lab.quantity import show
from tactile_lab.signals import SIGNALS
from tactile_lab.store.applied_trial import holds, onsets
from tactile_lab.store.derived import derivable, drain_current_of
from tactile_lab.store.layout import RECORDS
from tactile_lab.store.selection import Selection
from tactile_lab.store.stored_run import StoredRun
from tactile_lab.store.uncounted import uncounted

if TYPE_CHECKING:
    import pandas
    import xarray

    from tactile_lab.analysis.circuit_adaptation import CircuitAdaptation


class Run(StoredRun):
    """One run on disk, running, complete or cut short, and what is derived from it.

    Attributes:
        path: the folder.
        info: what `run.json` says.
    """

    @property
    def I_DS(self) -> DrainCurrent:
        """Drain current from the stored V_C1, Eq. (16), in steps of about 1 ms.

        Raises:
            RunFolderError: V_C1 was not stored.
        """
        return drain_current_of(self)

    @property
    def holds(self) -> list[tuple[float, float] | None]:
        """When the force of each trial stood, (start, end) s from its start, or None.

        As applied: a coil that is set over a serial line comes there later than
        `trials` has it, which says what was asked.
        """
        return holds(self, self.trials)

    def adaptation(self, trial: int = 0) -> CircuitAdaptation:
        """The circuit's own law fitted to the spikes in a trial's hold, Eqs. (7), (15).

        Args:
            trial: its number among `trials`.

        Raises:
            NotIdentifiableError: no hold, spikes that are too few or not all counted,
                or a tau they leave open.
        """
        from tactile_lab.analysis.circuit_adaptation import (
            fit_circuit_adaptation,
            followed,
        )

        rows = self.trials
        held = holds(self, rows)[trial]
        if held is None:
            raise NotIdentifiableError("the trial has no hold")
        growing = self.status == "running"
        if why := (uncounted(self) if growing else self._uncounted)[trial]:
            raise NotIdentifiableError(why)
        start, circuit = float(rows[trial]["start"]), self.scene.circuit
        came = held[0] - (onsets(self, rows)[trial] or 0.0)
        return fit_circuit_adaptation(
            circuit,
            self.spikes["time"],
            (start + held[0] + followed(circuit, came), start + held[1]),
            self.scene.displaced.values(),
        )

    @cached_property
    def _uncounted(self) -> list[str]:
        return uncounted(self)

    def to_xarray(
        self,
        start: float = 0.0,
        end: float | None = None,
        *,
        signals: Sequence[str] | None = None,
        rate: float | None = None,
    ) -> xarray.Dataset:
        """Signals from `start` to `end` s as an xarray dataset (reads them).

        Args:
            start: s on the run's axis.
            end: s on the run's axis; None for the last sample.
            signals: stored ones, and "force", "rate" and "I_DS", which are derived;
                those stored and the force unless given.
            rate: S/s to average down to; None for every sample.

        Raises:
            RunFolderError: xarray is not installed, or there is no such signal.
        """
        made = _optional("xarray").Dataset
        time, columns = self._columns(start, end, signals, rate)
        dataset: xarray.Dataset = made(coords={"time": time})
        dataset["time"].attrs["units"] = "s"
        for name, values in columns.items():
            known = SIGNALS[name]
            attrs = {"units": known.unit, "long_name": known.title}
            dataset[name] = ("time", values, attrs)
        dataset.attrs.update(run=self.name, simulated=int(self.simulated))
        return dataset

    def to_pandas(
        self,
        what: str = "signals",
        start: float = 0.0,
        end: float | None = None,
        *,
        signals: Sequence[str] | None = None,
        rate: float | None = None,
    ) -> pandas.DataFrame:
        """Signals against time as a pandas table; or "spikes", "trials", "events", ...

        Args:
            what: "signals", or a table of records: spikes, trials, current, field,
                temperature, voltages, events, rate, gaps, segments, pauses or
                overrange.
            start: of the signals, s on the run's axis.
            end: the same; None for the last sample.
            signals: as for `to_xarray`.
            rate: S/s to average down to; None for every sample.

        Raises:
            RunFolderError: pandas is not installed, or there is no such table.
        """
        pd = _optional("pandas")
        frame: pandas.DataFrame
        if what == "signals":
            time, columns = self._columns(start, end, signals, rate)
            frame = pd.DataFrame(columns, index=pd.Index(time, name="time"))
            return frame
        if what in ("spikes", "rate"):
            rows = getattr(self, what)
        elif what in RECORDS:
            rows = self.records(what)
        else:
            raise RunFolderError(
                f"A run has no table {what!r}; give signals, rate or one of "
                f"{', '.join(RECORDS)}."
            )
        fields = {name: rows[name] for name in rows.dtype.names}
        for name, values in fields.items():
            if values.dtype.kind == "S":
                fields[name] = np.char.decode(values, "utf-8", errors="replace")
        frame = pd.DataFrame(fields)
        return frame

    def _columns(
        self,
        start: float,
        end: float | None,
        signals: Sequence[str] | None,
        rate: float | None,
    ) -> tuple[FloatArray, dict[str, FloatArray]]:
        if signals is None:
            force = "force" in derivable(self)
            signals = (*self.signals, "force") if force else self.signals
        names = (signals,) if isinstance(signals, str) else tuple(signals)
        return Selection(signals=names, start=start, end=end, rate=rate).read(self)

    def _repr_html_(self) -> str:
        """What a notebook shows: the run in a few words, and its trials."""
        info = self.info
        rows = [
            ("status", f"{self.status} {info.get('reason') or ''}".strip()),
            ("protocol", info.get("protocol")),
            ("bench", info.get("bench")),
            ("physics", "simulated" if self.simulated else "measured"),
            ("started", info.get("started")),
            ("duration", show(self.duration, "s")),
            ("signals", ", ".join(self.signals)),
            ("spikes", len(self.table("spikes"))),
            ("loss", (info.get("loss") or {}).get("text")),
            ("folder", self.path),
        ]
        trials = [
            (
                row["label"].decode(errors="replace"),
                show(row["start"], "s"),
                show(row["end"], "s"),
                row["spikes"],
            )
            for row in self.trials
        ]
        head = ("trial", "start", "end", "spikes")
        return notebook.facts(self.name, rows) + notebook.table(head, trials)


def _optional(name: str) -> Any:
    """A library that is installed only where it is wanted."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise RunFolderError(
            f"{name} is not installed; `pip install {name}`, or read arrays with "
            "run.signal()."
        ) from error
