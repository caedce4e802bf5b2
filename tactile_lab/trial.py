"""What a protocol asks for, and what it gets back."""

from __future__ import annotations

import inspect
import math
from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_origin

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator
from pydantic.fields import FieldInfo

from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import Conclusion
from tactile_lab.errors import ParameterError, SceneError, TactileLabError, fault_in
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.measurement import Measurement
    from tactile_lab.plot import Plot

Probes = Literal["circuit", "ground", "supply"]
"""What the probes of the circuit's voltages touch: their nodes, 0 V, or V_S."""

BASELINE = 0.1
"""Time at rest that is recorded before the first trial and after each recovery, s."""

ROUNDING = 1e-9
"""Time by which a hold may outlast its trial, s."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One force waveform and what to record.

    Attributes:
        force: N against s, time 0 is the start of the trial; lasts until its last
            point or `duration`, whichever is later.
        label: for people ("120 mN").
        level: the force a result is filed under, N; None where there is no one level.
        duration: s; None for the waveform's end.
        pause: a planned recovery: neither streamed nor stored, and no gap.
        hold: (start s, end s) of the part that adaptation is judged on, or None.
        current: drive the coil by this current (A against s) instead of `force`, for
            calibrations that know no force yet.
        voltages: of the circuit, by name, V: what a source meter of the bench is to
            hold from just before this trial on; those not named stay.
        probes: where a person puts the probes of V_C1, V_C2 and V_K before the trial;
            a simulated bench does it itself.
    """

    force: Waveform
    label: str
    level: float | None = None
    duration: float | None = None
    pause: bool = False
    hold: tuple[float, float] | None = None
    current: Waveform | None = None
    voltages: Mapping[str, float] = field(default_factory=dict)
    probes: Probes = "circuit"

    @property
    def length(self) -> float:
        """Duration of the trial, s."""
        end = (self.current or self.force).end
        return end if self.duration is None else self.duration

    @property
    def onset(self) -> float | None:
        """When what is asked for begins to change, s; None where it never does."""
        return (self.current or self.force).departure(0.0, self.length, near=0.0)


def playable(given: object) -> Trial:
    """What a protocol gave, if it is a trial that comes to an end.

    A run asks as the plan does: what it measured may have gone into the trial.

    Raises:
        TypeError: it is no trial.
        SceneError: it has no length, or no end, or its `hold` lies outside it.
    """
    if not isinstance(given, Trial):
        raise TypeError(f"trials gave {type(given).__name__}; yield a Trial")
    length = given.length
    if not 0 < length < math.inf:
        raise SceneError(
            f'trial "{given.label}" lasts {length:g} s; it must be longer than 0 s, '
            "and end."
        )
    start, end = given.hold or (0.0, length)
    if not 0 <= start < end <= length + ROUNDING:
        raise SceneError(
            f'trial "{given.label}" lasts {length:g} s, and its hold from {start:g} to '
            f"{end:g} s: a hold is a part of its trial."
        )
    return given


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """What one trial gave.

    Attributes:
        trial: what was asked.
        index: number of the trial in the run, from 0.
        start: on the run's time axis, s.
        spike_times: shape (k,), s from the trial's start, detected on V_K.
        current: applied current: shape (n, 2), s from the trial's start and A.
        rest: mean of each measured signal just before the trial, by name; not a number
            where it left its channel's range.
        traces: decimated measured signals by name: shape (n, 2), s and SI unit.
        skipped: coil set-points that were skipped because they came too late.
        source_late: whether the source's answers held them up, not this computer.
        codes: one code of the converter for each measured signal, SI; empty where it
            is not known, as in a plan.
        drift: change of the rest V_C1 since the first trial that looked at it, V, less
            what the film still remembers of the forces; None where V_C1 is not
            measured. It is stored with the trial, as is the rest V_C1 itself.
        cut_off: measured signals that left their channel's range.
    """

    trial: Trial
    index: int
    start: float
    spike_times: FloatArray
    current: FloatArray
    rest: dict[str, float] = field(default_factory=dict)
    traces: dict[str, FloatArray] = field(default_factory=dict)
    skipped: int = 0
    source_late: bool = False
    codes: dict[str, float] = field(default_factory=dict)
    drift: float | None = None
    cut_off: frozenset[str] = frozenset()


Trials = Generator[Trial, Outcome, None]


class Protocol(BaseModel):
    """A measurement protocol: its parameters, its trials, what they mean, their plots.

    A subclass is one file: its fields (with units and limits, see
    `tactile_lab.quantity`) become the scene's ``[protocol]`` keys, the ``--set`` keys,
    the window's form and the stored attributes. It writes `trials`, and `conclude` and
    `plots` where its answer is more than the traces.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", arbitrary_types_allowed=True, strict=True
    )

    name: ClassVar[str]
    title: ClassVar[str]
    signals: ClassVar[tuple[str, ...]] = (
        "force", "coil_current", "V_C1", "V_C2", "V_K", "spikes",
    )  # fmt: skip
    """Signals recorded unless the scene says otherwise."""
    as_wired: ClassVar[bool] = False
    """Of those, what the bench does not measure is left out without complaint."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Signals the generator looks at in outcomes: acquired even when not recorded."""
    moves_probes: ClassVar[bool] = False
    """The probes of the circuit's voltages are put on 0 V and V_S, too: their ranges
    are widened to see both, and the model is not compared with them."""
    counts: ClassVar[bool] = True
    """Its answer rests on the spikes it records: nothing is concluded from a trial in
    which they are not all counted."""
    sets: ClassVar[tuple[str, ...]] = ()
    """Voltages of the circuit that its trials set (`Trial.voltages`): a source meter of
    the bench must hold them, and the model is not compared with a run of it."""
    accuracy: ClassVar[float] = 1.0
    """Largest error of the force, as a part of its range, that its answer bears: by
    which way the coil plays it (`[coil] way`)."""
    checks: ClassVar[Literal["", "wiring", "field", "force"]] = ""
    """What of the bench it checks or calibrates; the connect dialog offers it there."""

    @field_validator("*", mode="before")
    @classmethod
    def _listed(cls, value: Any, info: ValidationInfo) -> Any:
        """A scene's lists come as tuples; a field may ask for either."""
        asked = cls.model_fields[str(info.field_name)].annotation
        listed = get_origin(asked) is list and isinstance(value, tuple)
        return list(value) if listed else value

    def trials(self) -> Trials:
        """Yield trials; each ``yield`` returns that trial's outcome."""
        raise NotImplementedError

    def conclude(self, run: Measurement) -> Conclusion:
        """What the trials mean; nothing by default.

        Raises:
            NotIdentifiableError: the run does not tell it. Any error is told in the
                report instead of the conclusion.
        """
        return Conclusion()

    def plots(self, run: Measurement) -> Iterable[Plot]:
        """Plots of the answer beside the general one of force, voltages and spikes."""
        return ()

    @classmethod
    def parameters(cls) -> dict[str, FieldInfo]:
        """All fields, the class's own before those it shares with others."""
        named = (
            n for kind in cls.__mro__ for n in vars(kind).get("__annotations__", ())
        )
        fields = cls.model_fields
        return {name: fields[name] for name in named if name in fields}

    def wishes(self) -> tuple[str, ...]:
        """Signals acquired where the bench has them, and missed without complaint."""
        return ()

    def on_sensor(self, tau: float, volts_per_newton: float) -> Protocol:
        """The same for a film that leaks with `tau` s and gives so many V/N."""
        return self

    def located(self, folder: Any) -> Protocol:
        """The same protocol with file parameters resolved against `folder` (a Path)."""
        return self

    @classmethod
    def fault(cls, error: BaseException) -> str:
        """What went wrong in this protocol, with file and line of its own code.

        For the errors of `tactile_lab.errors`, which are raised on purpose, it is
        their text; for those of other code their kind and text. A `ParameterError` is
        a mistake in the code that asked, too.
        """
        if isinstance(error, TactileLabError) and not isinstance(error, ParameterError):
            return str(error)
        return fault_in(inspect.getfile(cls), error)
