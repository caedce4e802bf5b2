"""A run on disk as the plain values a report is written from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import date, datetime
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.analysis.belief import Belief
from tactile_lab.arrays import FloatArray
from tactile_lab.bench import COPPER
from tactile_lab.calibration import UNCERTAINTY
from tactile_lab.errors import SceneError
from tactile_lab.instruments.registry import coil_capability
from tactile_lab.measurement import (
    BETWEEN_SAMPLES,
    MeasuredTrial,
    RecordedSignal,
)
from tactile_lab.model.temperature import temperature
from tactile_lab.quantity import count, exact, show
from tactile_lab.report.driven import played, told, undated
from tactile_lab.report.mains import told as mains_told
from tactile_lab.report.run_data import Loss, RunData
from tactile_lab.scene.scene import Scene
from tactile_lab.scene.tables import CELSIUS, ZERO_CELSIUS
from tactile_lab.store.applied_trial import holds, onsets
from tactile_lab.store.overrange import told as overrange_told
from tactile_lab.store.progress import Progress, each, nothing
from tactile_lab.store.remarks import read_remarks
from tactile_lab.store.run import Run
from tactile_lab.store.stored_run import ended
from tactile_lab.store.uncounted import samples_catch_spikes, uncounted
from tactile_lab.store.warned import told as warned_told

CELLS = 4000
"""Cells of a trace over the whole run."""


def read(folder: Path, progress: Progress = nothing) -> RunData:
    """The run in `folder`, decimated.

    Raises:
        RunFolderError: not a run, or one without data.
        SceneError: its resolved scene cannot be read any more.
    """
    with Run.load(folder) as run:
        info, scene = run.info, run.scene
        current = run.applied.steps
        started = _for_people(str(info.get("started", "")))
        settings: Mapping[str, Mapping[str, str]] = info.get("instruments") or {}
        changed = tuple(info.get("instruments_changed") or ())
        warnings = (*(info.get("warnings") or ()), *changed)
        return RunData(
            title=str(info.get("title", scene.protocol.title)),
            protocol=scene.protocol,
            scene=str(info.get("scene", "")),
            run=folder.resolve().name,
            started=started,
            status=run.status,
            simulated=run.simulated,
            bench=scene.bench.name,
            duration=run.duration,
            took=info.get("took_s"),
            trials=_trials(run),
            force=run.force,
            current=current,
            warming=_warming(run),
            field=_field(run),
            temperature=_temperature(run),
            voltages=_voltages(run),
            force_uncertainty=scene.bench.magnet.force_uncertainty,
            field_per_ampere=_field_per_ampere(scene),
            newtons_per_tesla=scene.bench.magnet.newtons_per_tesla,
            traces=_traces(run, progress),
            circuit=scene.circuit,
            belief=_belief(run, scene),
            compared=scene.compared,
            counted=samples_catch_spikes(run),
            displaced=scene.displaced,
            listed=played(run),
            lag=scene.bench.magnet.lag,
            lag_uncertainty=scene.bench.magnet.lag_uncertainty,
            searched=bool({"spikes", "rate"} & set(scene.record.signals)),
            start=scene.start,
            asks_I_DS="I_DS" in scene.record.signals,
            loss=_loss(info),
            accuracy=str(info.get("accuracy") or ""),
            warnings=tuple(
                dict.fromkeys(
                    (
                        *_as_it_fell(run),
                        *overrange_told(run),
                        *mains_told(run),
                        *undated(run),
                        *warnings,
                        *_doubts(scene, started, settings, warnings),
                        *warned_told(run),
                    )
                )
            ),
            assumptions=(*(info.get("assumptions") or ()), *told(run)),
            parameters=_texts(scene, "protocol"),
            sensor=sensor_texts(scene),
            settings=settings,
            calibration=_calibration(scene),
            conditions=_conditions(info) | _said(run.path),
            environment=info.get("environment") or {},
        )


def _belief(run: Run, scene: Scene) -> Belief | None:
    """What is believed of sensor and bench; the clocks by what timed the current."""
    applied = run.applied
    if not len(applied.steps):
        return None
    clock = _clock(run, scene)
    return Belief(
        circuit=scene.circuit,
        magnet=scene.bench.magnet,
        setpoint=run.setpoint,
        followers=scene.bench.followers,
        temperature=scene.sensor.temperature_uncertainty,
        clock=clock or 0.0,
        dated=applied.uncertainty() is not None,
        steps=applied.steps,
        doubt=applied.doubt,
        begins=run.trials["start"] if played(run) else np.empty(0),
    )


def _clock(
    run: Run, scene: Scene, start: float = -np.inf, end: float = np.inf
) -> float | None:
    """How far measured times may lie from the current's, s; None: never told.

    Args:
        run: of which.
        scene: of it.
        start: from which time on the current is meant, s.
        end: up to which, s.
    """
    sample = float(run.attributes.get("interval", 0.0))  # a spike lies within one
    told = run.applied.uncertainty(start, end)
    if told is not None:
        return math.hypot(told, sample)
    known = run.records("segments")["uncertainty"]
    if not np.isfinite(known).any():
        return None
    clock = math.hypot(float(np.nanmax(known)), sample)
    if scene.bench.coil is not None:  # it acted within one update before it told
        clock = math.hypot(clock, coil_capability(scene.bench.coil).update_interval)
    return clock


def _conditions(info: Mapping[str, Any]) -> dict[str, str]:
    """Under which the run was made, and what its protocol's source was."""
    found = {str(name): str(text) for name, text in (info.get("notes") or {}).items()}
    temperature = info.get("temperature") or {}
    if temperature.get("K") is not None:
        value = f"{temperature['K'] - ZERO_CELSIUS:.4g} {CELSIUS}"
        found["temperature"] = f"{value} ({temperature['from']})"
    detection = info.get("detection") or {}
    if detection:
        origin = "estimated from noise" if detection["from"] == "noise" else "as given"
        value = show(detection["threshold_V"], "V", 3)
        found["spike threshold"] = f"{value} on {detection['signal']}, {origin}"
    for name, digest in (info.get("files") or {}).items():
        found[name] = f"SHA-256 {digest[:16]}…"
    return found


def _said(path: Path) -> dict[str, str]:
    """What people noted of the run, by what it is."""
    said = read_remarks(path)
    found = {f"note {k}": str(note) for k, note in enumerate(said.notes, 1)}
    named = {"title": said.title, "tags": ", ".join(said.tags)}
    return {name: text for name, text in named.items() if text} | found


def _trials(run: Run) -> tuple[MeasuredTrial, ...]:
    """The trials, and what came after the last in a run that ended before its time."""
    spikes, scene = run.spikes["time"], run.scene
    rows = run.trials
    trials = [
        _trial(
            row,
            complete,
            spikes,
            onset,
            hold,
            _clock(run, scene, float(row["start"]), float(row["end"])),
            why_not,
        )
        for row, complete, onset, hold, why_not in zip(
            rows,
            ended(rows).tolist(),
            onsets(run, rows),
            holds(run, rows),
            uncounted(run),
            strict=True,
        )
    ]
    end = max((t.start + t.duration for t in trials), default=0.0)
    late = spikes[(spikes >= end) & (spikes < run.stopped)] - end
    if late.size and run.status != "complete":
        trials.append(
            MeasuredTrial(
                label="not known",
                level=None,
                start=end,
                duration=run.duration - end,
                spike_times=late,
                onset=None,
                complete=False,
                clock_uncertainty=_clock(run, scene, end, run.duration),
                uncounted="" if samples_catch_spikes(run) else BETWEEN_SAMPLES,
            )
        )
    return tuple(trials)


def _as_it_fell(run: Run) -> tuple[str, ...]:
    """How many spikes came after the run was stopped, which are no trial's."""
    if ended(run.records("trials")).all():
        return ()
    fell = np.count_nonzero(run.spikes["time"] >= run.stopped)
    if not fell:
        return ()
    said = count(int(fell), "spike")
    return (
        f"{said} came as the force fell after the run was stopped, at "
        f"{show(run.stopped, 's', 4)}; they belong to no trial.",
    )


def _trial(
    row: Any,
    complete: bool,
    spikes: FloatArray,
    onset: float | None,
    hold: tuple[float, float] | None,
    clock: float | None,
    why_not: str,
) -> MeasuredTrial:
    start, end, level = (float(row[name]) for name in ("start", "end", "level"))
    return MeasuredTrial(
        label=bytes(row["label"]).decode("utf-8", errors="replace"),
        level=None if np.isnan(level) else level,
        start=start,
        duration=end - start,
        spike_times=spikes[(spikes >= start) & (spikes < end)] - start,
        onset=onset,
        hold=hold,
        pause=bool(row["pause"]),
        complete=complete,
        rest=_number(row, "rest_V_C1"),
        drift=_number(row, "drift_V_C1"),
        clock_uncertainty=clock,
        uncounted=why_not,
        skipped=int(row["skipped"]),
    )


def _number(row: Any, name: str) -> float | None:
    """A column of a trial that older runs lack and that may be empty."""
    if name not in (row.dtype.names or ()) or np.isnan(row[name]):
        return None
    return float(row[name])


def _traces(run: Run, progress: Progress) -> tuple[RecordedSignal, ...]:
    """What was recorded; a scope that was lost at once has left nothing of a signal."""
    traces = (_trace(run, name) for name, _ in each(run.signals, progress))
    return tuple(trace for trace in traces if trace.time.size)


def _trace(run: Run, name: str) -> RecordedSignal:
    signal = run.signal(name)
    cells = signal.trace(cells=CELLS)
    # where the next cell comes after a gap, or not at all, a cell is as long as usual
    half = np.full(len(cells), cells.width / 2)
    joined = ~cells.gap[1:]
    half[:-1][joined] = np.diff(cells.time)[joined] / 2
    return RecordedSignal(
        signal=name,
        time=cells.time + half,
        mean=cells.mean,
        low=cells.low,
        high=cells.high,
        scale=float(signal.attributes.get("scale", 1.0)),
        code=abs(signal.gain),
        overrange=run.overrange(name),
        samples=cells.width / signal.interval,
    )


def _warming(run: Run) -> float | None:
    """Temperature the winding gained between two looks at its resistance, K."""
    rows = run.current
    if "resistance_ratio" not in (rows.dtype.names or ()):
        return None
    ratio = rows["resistance_ratio"]
    ratio = ratio[np.isfinite(ratio)]
    return float(ratio[-1] - ratio[0]) / COPPER if ratio.size > 1 else None


def _field_per_ampere(scene: Scene) -> float:
    """Slope of the assumed or calibrated field around 0 A, T/A."""
    low, high = scene.bench.magnet.field([-1e-3, 1e-3])
    return float(high - low) / 2e-3


def _temperature(run: Run) -> FloatArray:
    """Readings of the temperature, shape (n, 2), s and K."""
    rows = run.temperature
    return np.column_stack([rows["time"], rows["temperature"]])


def _voltages(run: Run) -> dict[str, FloatArray]:
    """What source meters held, by voltage, shape (n, 2), s and V."""
    rows = run.voltages
    return {
        name.decode(): np.column_stack([mine["time"], mine["measured"]])
        for name in np.unique(rows["name"])
        for mine in [rows[rows["name"] == name]]
    }


def _field(run: Run) -> FloatArray:
    """Teslameter readings, shape (m, 2), s and T."""
    rows = run.field
    names = rows.dtype.names or ()
    value = "field" if "field" in names else "value"
    return np.column_stack([rows["time"], rows[value]])


def _loss(info: Mapping[str, Any]) -> Loss | None:
    loss = info.get("loss")
    if not loss:
        return None
    return Loss(
        samples_produced=loss["produced"],
        samples_stored=loss["written"],
        spikes_online=loss["spikes_online"],
        spikes=loss["spikes"],
        sentence=loss["text"],
        covered=loss.get("covered_s"),
        streamed=loss.get("streamed_s"),
    )


def _texts(scene: Scene, table: str) -> dict[str, str]:
    entries = scene.to_dict()[table]
    return {
        name: ", ".join(map(_readable, value))
        if isinstance(value, list | tuple)
        else _readable(value)
        for name, value in entries.items()
    }


def sensor_texts(scene: Scene) -> dict[str, str]:
    """The sensor's keys; what its temperature changes as it is there."""
    found, given, used = _texts(scene, "sensor"), scene.sensor, scene.sensor.circuit
    for name, unit in (("V_T", "V"), ("I_S", "A"), ("I_T1s", "A")):
        there = getattr(used, name)
        if there != getattr(given, name):
            told = f"{found[name]} at {show(temperature(given), 'K')}"
            found[name] = f"{show(there, unit)} ({told})"
    return found


def _readable(value: Any) -> str:
    """An entry of a scene, a quantity with the prefix that suits it: "9.58 MOhm"."""
    number, _, unit = str(value).partition(" ")
    try:
        return exact(float(number), unit) if unit else str(value)
    except ValueError:  # a text, or a unit of its own
        return str(value)


def _doubts(
    scene: Scene,
    started: str,
    settings: Mapping[str, Mapping[str, str]],
    told: Sequence[str],
) -> tuple[str, ...]:
    """What speaks against the calibration on the day of the run, not yet told."""
    calibration = scene.bench.magnet.calibration
    if calibration is None:
        return ()
    try:
        day = date.fromisoformat(started[:10])
    except ValueError:
        day = None
    coil = settings.get("coil", {}).get("identity")
    try:
        found = calibration.check(
            today=day, coil=coil, beyond_date=True, other_coil=True
        )
    except SceneError as reason:  # changed since: say so, and keep the run's numbers
        found = (str(reason),)
    return tuple(text for text in found if text not in told)


def _calibration(scene: Scene) -> dict[str, str]:
    magnet = scene.bench.magnet
    found = {
        "Force per current at 0 A": f"{show(magnet.newtons_per_ampere, 'N')}/A",
        "r": show(magnet.r, "m"),
        "A1": show(magnet.A1, "m^2"),
        "A2": show(magnet.A2, "m^2"),
        "B1": show(magnet.B1, "T"),
    }
    if magnet.calibration is None:
        found["B2 per current"] = f"{show(magnet.B2_per_ampere, 'T')}/A, assumed linear"
    else:
        found["Calibration file"] = magnet.calibration.path.name
        names = ("date", "valid until", "coil", "sha256", *UNCERTAINTY.values())
        head = magnet.calibration.head
        found |= {name.capitalize(): head[name] for name in names if name in head}
    known = magnet.force_uncertainty
    found["Uncertainty of a force"] = "not stated" if known is None else known.text
    return found


def _for_people(started: str) -> str:
    try:
        return f"{datetime.fromisoformat(started):%Y-%m-%d %H:%M:%S}"
    except ValueError:
        return started
