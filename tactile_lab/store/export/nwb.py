"""Neurodata Without Borders, through pynwb; spike times in seconds."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.errors import RunFolderError
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection

UNITS = {"V": "volts", "A": "amperes", "T": "tesla", "N": "newtons"}
"""What NWB calls SI units."""


def export(run: Run, file: Path, selection: Selection) -> list[Path]:
    """Write `file`: codes with conversion and offset, units table, trials, stimulus.

    Raises:
        RunFolderError: pynwb is not installed, a rate was asked for, or a signal or
            time the run does not have.
        OSError: the file cannot be written.
    """
    try:
        import pynwb
    except ImportError as error:
        raise RunFolderError(
            "pynwb is not installed; `pip install pynwb`, or export --to csv or mat."
        ) from error
    if selection.rate is not None:
        raise RunFolderError("NWB holds the samples as stored; leave out --rate.")
    selection.check(run)
    kind = "simulated" if run.simulated else "measured"
    notes = run.info.get("notes") or {}
    title = run.info.get("title") or run.info.get("protocol") or "run"
    session = pynwb.NWBFile(
        session_description=f"{title} on a spiking tactile sensor, {kind}",
        identifier=run.path.resolve().name,
        session_start_time=datetime.fromisoformat(run.info["started"]),
        experimenter=[notes["operator"]] if notes.get("operator") else None,
        institution=notes.get("institution"),
        experiment_description=run.info.get("scene"),
        notes=str(notes) if notes else None,
        keywords=["tactile sensor", "spikes", kind],
    )
    session.subject = pynwb.file.Subject(
        subject_id=str(notes.get("sensor") or "sensor"),
        description="a piezoelectric tactile sensor; no animal was involved",
        sex="O",
        age="P0D",
    )
    _add_signals(pynwb, session, run, selection)
    _add_slow(pynwb, session, run)
    _add_trials(session, run)
    for gap in selection.rows(run.gaps):
        session.add_invalid_time_interval(
            start_time=float(gap["start"]), stop_time=float(gap["end"])
        )
    times = selection.rows(run.spikes)["time"]
    if run.detection is not None:
        step = run.signal(run.signals[0]).interval if run.signals else -1.0
        session.units = pynwb.misc.Units(
            name="units", description="detected spikes", resolution=step
        )
        session.add_unit_column("signal", "the channel the spikes were detected on")
        session.add_unit(spike_times=times, signal=run.detection.signal)
    file.parent.mkdir(parents=True, exist_ok=True)
    with pynwb.NWBHDF5IO(str(file), "w") as writer:
        writer.write(session)
    return [file]


def _add_signals(pynwb: Any, session: Any, run: Run, selection: Selection) -> None:
    """One series per signal and stream; where it has gaps, each sample has a time."""
    spans = selection.spans(run)
    if spans and not run.gapless:
        spans = [(spans[0][0], spans[-1][1])]
    for name in selection.names(run):
        signal = run.signal(name)
        for number, (first, stop) in enumerate(spans):
            title = name if len(spans) == 1 else f"{name}_{number + 1}"
            times: dict[str, Any] = {
                "starting_time": float(run.axis.time_of(float(first))),
                "rate": 1.0 / signal.interval,
            }
            if not run.gapless:
                times = {"timestamps": signal.time(first, stop)}
            session.add_acquisition(
                pynwb.TimeSeries(
                    name=title,
                    description=f"{signal.title}, scope input "
                    f"{signal.attributes.get('input')}",
                    data=pynwb.H5DataIO(signal.codes[first:stop], compression="gzip"),
                    unit=UNITS.get(signal.unit, signal.unit),
                    conversion=signal.gain,
                    offset=signal.offset,
                    resolution=abs(signal.gain),
                    **times,
                )
            )


def _add_slow(pynwb: Any, session: Any, run: Run) -> None:
    """Applied current as stimulus, field readings as acquisition."""
    current = run.current
    if current.size:
        session.add_stimulus(
            pynwb.TimeSeries(
                name="applied_current",
                description="set-points sent to the coil's current source",
                data=current["setpoint"],
                timestamps=current["time"],
                unit="amperes",
            )
        )
    field = run.field
    if field.size:
        session.add_acquisition(
            pynwb.TimeSeries(
                name="field",
                description="teslameter readings",
                data=field["field"],
                timestamps=field["time"],
                unit="tesla",
            )
        )


def _add_trials(session: Any, run: Run) -> None:
    trials = run.trials
    if trials.size == 0:
        return
    session.add_trial_column("level", "force the trial is filed under, N")
    session.add_trial_column("label", "for people")
    for row in trials:
        level = float(row["level"])
        session.add_trial(
            start_time=float(row["start"]),
            stop_time=float(row["end"]),
            level=np.nan if np.isnan(level) else level,
            label=row["label"].decode(),
        )
