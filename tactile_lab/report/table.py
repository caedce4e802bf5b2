"""The tables of a run's trials: for the terminal as text, for the report as cells."""

from __future__ import annotations

from collections.abc import Iterator

from tactile_lab.analysis.estimate import Estimate, standard_error
from tactile_lab.conclusion import Table
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.quantity import plus_minus, show
from tactile_lab.signals import NO_COUNT

NONE = "–"


def trials_table(run: Measurement) -> Table:
    """One row per trial: force, spikes, latency, rates, fall, time constant.

    Where only the field is looked at: current and field.
    """
    if not run.searched and run.trace("V_C1") is None and run.field is not None:
        return _field_table(run)
    if not run.searched:
        return Table(
            headings=("Trial", "Start", "Length", "V_C1 before"),
            rows=tuple(
                (
                    trial.name,
                    show(trial.start, "s"),
                    show(trial.duration, "s"),
                    _shown(trial.rest, "V", 4),
                )
                for trial in run.results
            ),
            note="V_K was not searched for spikes.",
        )
    note = (
        "In ramps: spikes outside the hold as applied, part of the whole. First spike: "
        "time from the onset of the force, ± how well the clocks of coil and scope are "
        "aligned. "
        "Peak and final rate: highest, and of the last two spikes, within the hold. "
        "Fall: from the highest rate within the hold to the final one. Time constant: "
        "1/|β| with its 95 % interval."
    )
    if run.force_uncertainty is not None:
        note += " Force: ± its 95 % uncertainty by calibration and geometry."
    if any(trial.uncounted for trial in run.results):
        note += f" {NO_COUNT}"
    named = any(trial.name != _force(trial) for trial in run.results)
    headings = (
        *("Trial",) * named,
        *("Force", "Spikes", "In ramps", "First spike", "Peak rate", "Final rate"),
        *("Fall in hold", "Time constant"),
    )
    rows = tuple(
        (*(trial.name,) * named, force, *_row(trial), constant)
        for trial, force, constant in zip(
            run.results, _forces(run), _time_constants(run), strict=True
        )
    )
    return Table(headings=headings, rows=rows, note=note)


def _field_table(run: Measurement) -> Table:
    """Current and field of each trial, at the end of its hold."""
    rows = []
    for trial in run.results:
        start, end = trial.held or (trial.start, trial.start + trial.duration)
        current = run.current_at(end)
        held = trial.held is not None
        field = run.field_held(trial) if held else run.field_between(start, end)
        shown = NONE
        if field.size > 1:
            mean = Estimate.of(
                float(field.mean()), standard_error(field), field.size - 1
            )
            shown = _with(mean.value, mean.half, "T", 4)
        elif field.size:
            shown = show(float(field[0]), "T", 4)
        at, read = show(trial.start, "s"), str(field.size)
        rows.append((trial.name, at, _shown(current, "A", 4), shown, read))
    return Table(
        headings=("Trial", "Start", "Current", "Field", "Readings"),
        rows=tuple(rows),
        note="Current at the end of the hold as read back; field: mean of the readings "
        "in it once the current stood, ± what their scatter leaves open of it (95 %).",
    )


def fits_table(run: Measurement) -> Table:
    """The fitted decays, one row per trial that has one."""
    rows = []
    for trial in run.results:
        fit = trial.adaptation
        if fit is None:
            continue
        cells = [trial.name]
        for estimate, unit in ((fit.alpha, "Hz"), (fit.beta, "1/s"), (fit.gamma, "Hz")):
            cells.append(estimate.text(unit, level="") + "*" * fit.systematic)
        cells += [f"{fit.irregularity:.3f}", f"{fit.r_squared:.4f}", str(fit.intervals)]
        rows.append(tuple(cells))
    return Table(
        title="Adaptation: α exp(βt) + γ",
        headings=("Trial", "α", "β", "γ", "Irregularity", "R²", "Intervals"),
        rows=tuple(rows),
        note="95 % intervals in brackets; t from the start of the hold to the last "
        "spike: the law knows no silence. The exponential describes the decay, to "
        "compare with the paper; it is not the law of this circuit. *: the rates leave "
        "the curve systematically (runs test), its intervals are too narrow.",
    )


def circuit_fits_table(run: Measurement) -> Table:
    """The circuit's own law fitted to holds, one row per trial that has one."""
    rows = []
    for trial in run.results:
        fit, _ = run.circuit_adaptation(trial)
        if fit is None:
            continue
        last = NONE if fit.silent_from is None else show(fit.silent_from, "s", 4)
        rows.append(
            (
                trial.name,
                fit.tau.text("s", level=""),
                plus_minus(fit.V_GS.value, fit.V_GS.half, "V"),
                plus_minus(fit.V_P.value, fit.V_P.half, "V"),
                show(fit.rms, "Hz", 2),
                last,
                str(fit.intervals),
            )
        )
    return Table(
        title="Adaptation: Eq. (15) with V_P(t) of Eq. (7)",
        headings=(
            "Trial", "τ", "V_GS", "V_P at first", "Rate rms", "Last spike", "Intervals",
        ),
        rows=tuple(rows),
        note="Fitted to the charge of C2 from spike to spike and to the silence after "
        "the last one, from when the applied force was there; all other parts of the "
        "circuit as given. ±: 95 %, the follower's input bias within, and the "
        "temperature where the scene says how well it is known. Last spike: by the "
        "law, going on from the last one measured, from the trial's start.",
    )  # fmt: skip


def _forces(run: Measurement) -> Iterator[str]:
    """The force of each trial, as finely as it takes to tell one level from another.

    Levels of one run share the error of the scale: they differ by less than its band.
    """
    levels = {trial.level for trial in run.results if trial.level is not None}
    told: dict[float, str] = {}
    for digits in (2, 3, 4):
        told = {at: _with(at, run.uncertain(at), "N", 4, digits) for at in levels}
        if len(set(told.values())) == len(levels):
            break
    for trial in run.results:
        yield NONE if trial.level is None else told[trial.level]


def _row(trial: MeasuredTrial) -> tuple[str, ...]:
    response, latency = trial.response, NONE
    if response.latency is not None:
        latency = _with(response.latency, trial.clock_uncertainty, "s", 3)
    return (
        trial.seen,
        str(response.ramp_spikes) if response.ramp_spikes else NONE,
        latency,
        _shown(response.peak_rate, "Hz"),
        _shown(response.final_rate, "Hz"),
        NONE if response.fall is None else f"{100 * response.fall:.0f} %",
    )


def _force(trial: MeasuredTrial) -> str | None:
    """How a trial is called that is told from the others by its force alone."""
    return None if trial.level is None else show(trial.level, "N")


def _time_constants(run: Measurement) -> Iterator[str]:
    """1/|beta| of each trial with its 95 % interval, or why there is none.

    Why is said once of trials that one after the other have the same reason.
    """
    said = ""
    for trial in run.results:
        fit = trial.adaptation
        if fit is not None:
            said = ""
            yield fit.time_constant.text("s", level="")
        elif trial.response.spikes == 0 and not trial.uncounted:
            yield NONE
        else:
            yield "as above" if trial.why_not == said else trial.why_not
            said = trial.why_not


def _with(
    value: float, uncertainty: float | None, unit: str, digits: int, of_band: int = 2
) -> str:
    """A value with its uncertainty to `of_band` digits, where that is known."""
    if uncertainty is None:
        return show(value, unit, digits)
    return plus_minus(value, uncertainty, unit, of_band)


def _shown(value: float | None, unit: str, digits: int = 3) -> str:
    return NONE if value is None else show(value, unit, digits)
