"""Which single thing that is other than believed explains a run's misfit.

Each suspect is fitted alone, by a deviation of one size, to V_C1 and to the intervals
between spikes. Whatever the bench states a band for (offset of V_C1's channel, clocks,
follower, lag, force, temperature) may take any value in its band: what it does is taken
to first order about the value found before, until that leaves no less. The suspect that
leaves only the noise is named, if every other leaves clearly more; those that do not
are named with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tactile_lab.analysis.belief import PART, Belief
from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.evidence import Residuals
from tactile_lab.analysis.spike_pairs import irregularity
from tactile_lab.analysis.twin import Measured
from tactile_lab.arrays import FloatArray
from tactile_lab.deviation import Deviation, DrivenCircuit
from tactile_lab.errors import NotIdentifiableError, TactileLabError
from tactile_lab.quantity import printed, rounded, show

SUSPECTS: Mapping[str, float] = {
    "input_bias": 30e-12,
    "V_GS": 3e-3,
    "force": 0.02,
    "lag": 2e-3,
    "temperature": 2.0,
    "R1": 0.02,
}
"""Names in `Deviation`, and the step each is fitted in."""
TITLES = {
    "input_bias": ("the follower's input bias", "A"),
    "V_GS": ("V_GS", "V"),
    "force": ("the force", "%"),
    "lag": ("the lag of the field", "s"),
    "temperature": ("the sensor's temperature", "K"),
    "R1": ("R1", "%"),
}
"""What each is called, and its unit; a part of itself in %."""
OWN = {"input_bias": "follower"}
"""Name of the cause of uncertainty where it is not the suspect's own."""
SYSTEMATIC = 0.03
"""Of one code: what the mean of dithered codes is off by, alike at each level."""
DITHERED = 0.1
"""Of one code: noise smooths a converter's steps where they leave less than this."""
LEAST = 0.15e-3
"""What V_C2 at firing is known to at best, V."""
FEWEST = 3
"""Fewer data than this tell nothing."""
BAND = 1.25
"""Of its 95 % band that a stated uncertainty may take to explain a misfit."""
NOTICED = 3.0
"""Times the noise from which a misfit is worth an explanation."""
EXPLAINED = 1.5
"""Times the noise that a suspect may leave and still explain it."""
CLEARLY = 1.35
"""Times the misfit of the best that every other suspect must leave at least."""

AGAIN, SETTLED, FARTHEST = 8, 0.1, 0.5
"""So often what the bands do is taken anew at most; until none moves by this part of
itself; and the most it may move at once."""
FALLS = 0.97
"""Part to which a misfit falls at most, from one time to the next, while it falls."""
CLOCKS = np.linspace(-1, 1, 17)
"""Parts of the clocks' band from which the best is sought."""
ROUNDS, DIFFERENCE, LONGEST, CLOSE = 8, 0.03, 3.0, 3e-3
"""Of the search for a size, in its steps."""


@dataclass(frozen=True)
class Suspect:
    """One suspect, fitted alone.

    Attributes:
        name: in `Deviation`.
        size: true less believed, SI.
        misfit: what it leaves, in multiples of the noise (root mean square).
    """

    name: str
    size: Estimate
    misfit: float

    @property
    def text(self) -> str:
        """What differs, by how much: "V_GS +4 mV (3.6 to 4.4 mV, 95 %)".

        Without the interval where it explains nothing: that is of the noise alone.
        """
        (title, unit), size = TITLES[self.name], self.size
        if self.misfit <= EXPLAINED:
            told = size.text(unit, 100.0) if unit == "%" else size.shown(unit)
        elif unit == "%":
            told = printed(f"{100 * size.value:.3g} %")
        else:
            told = show(size.value, unit, 3)
        sign = "+" if size.value > 0 else ""
        return f"{title} {sign}{told} from what is believed"


@dataclass(frozen=True)
class Explanation:
    """What the usual suspects make of a run's misfit.

    Attributes:
        misfit: of what is believed, within its bands, in multiples of the noise (root
            mean square).
        suspects: best first.
    """

    misfit: float
    suspects: tuple[Suspect, ...]

    @property
    def text(self) -> str:
        """For a person."""
        if not self.suspects:
            return "The model can follow none of the usual suspects."
        best, *others = self.suspects
        falls = f"from {rounded(self.misfit)} to {rounded(best.misfit)} times the noise"
        if not self.candidates:
            names = ", ".join(TITLES[s.name][0] for s in self.suspects)
            return (
                f"What explains it cannot be told: of {names}, the best, "
                f"{best.text}, leaves {rounded(best.misfit)} times the noise"
                + "".join(
                    f" and {TITLES[o.name][0]} {rounded(o.misfit)} times"
                    for o in others[:1]
                )
                + ". Something else, or more than one thing, is other than believed."
            )
        if self.cause is None:
            each = "".join(
                f"; {s.text}: to {rounded(s.misfit)} times" for s in self.candidates[1:]
            )
            return (
                f"Each of {len(self.candidates)} causes would explain it alone, and "
                f"this run cannot tell them apart. The misfit falls by {best.text}: "
                f"{falls}{each}."
            )
        next_best = "".join(
            f"; the next best, {TITLES[o.name][0]}, leaves {rounded(o.misfit)} times"
            for o in others[:1]
        )
        return (
            f"One cause explains it: {best.text}. With it the misfit falls {falls}"
            f"{next_best}."
        )

    @property
    def candidates(self) -> tuple[Suspect, ...]:
        """Those of which each alone explains the misfit, about as well as the best."""
        if not self.suspects or self.suspects[0].misfit > EXPLAINED:
            return ()
        most = CLEARLY * self.suspects[0].misfit
        return tuple(s for s in self.suspects if s.misfit <= most)

    @property
    def cause(self) -> Suspect | None:
        """The one that explains the misfit; None: it cannot be told."""
        return self.candidates[0] if len(self.candidates) == 1 else None


def explain(
    belief: Belief,
    duration: float,
    *,
    V_C1: Measured | None = None,
    spike_times: FloatArray | None = None,
) -> Explanation | None:
    """Try the usual suspects on a run; None where there is nothing to explain.

    Args:
        belief: sensor and bench as they are believed to be.
        duration: of the run, s.
        V_C1: measured, decimated.
        spike_times: detected spikes, s.
    """
    problem = Residuals(belief.circuit, (), belief.force, duration, V_C1, spike_times)
    if problem.size < FEWEST:
        return None
    plain = problem.under(belief.driven)
    code = 0.0 if V_C1 is None else V_C1.resolution
    noise = _noise(plain, problem.bins, 0.0 if V_C1 is None else _steps(V_C1))
    weight = np.ones(problem.size)
    if V_C1 is not None and code > 0:
        weight[: problem.bins] = math.sqrt(_levels(V_C1) / problem.bins)
    trial = _Trial(belief, problem, noise, weight)
    misfit = _within_bands(trial, belief)
    if misfit >= NOTICED:  # a wide band of the clocks bends too much for its slope
        misfit = min(misfit, _within_bands(trial.timed(belief), belief))
    if misfit < NOTICED:
        return None
    found = [s for name in SUSPECTS if (s := trial.fitted(name)) is not None]
    found.sort(key=lambda suspect: suspect.misfit)
    return Explanation(misfit, tuple(found))


def _within_bands(about: _Trial, belief: Belief) -> float:
    """The least misfit that the bands leave, what they do taken anew where they are."""
    left = about.freed(about.plain)
    least = before = about.misfit(left)
    for _ in range(AGAIN):
        if least < NOTICED:
            break
        about = about.about(belief, about.taken(left))
        left = about.freed(about.plain)
        now = about.misfit(left)
        least = min(least, now)
        if about.settled(left) and now > FALLS * before:
            break
        before = now
    return least


def _steps(V_C1: Measured) -> float:
    """What the converter's steps put the mean of a bin off by, V, root mean square.

    Steps that no noise smooths are off by anything up to `V_C1.steps`, evenly.
    """
    if V_C1.steps <= DITHERED * V_C1.resolution:
        return SYSTEMATIC * V_C1.resolution
    return V_C1.steps / math.sqrt(3)


def _noise(plain: FloatArray, bins: int, steps: float) -> FloatArray:
    """Scatter of V_C1 and of V_C2 at firing about any smooth course, V."""
    noise = np.empty(plain.size)
    for part, least in (
        (slice(0, bins), max(steps, 1e-5)),
        (slice(bins, plain.size), LEAST),
    ):
        found = irregularity(plain[part]) / 1.96
        noise[part] = max(found, least) if np.isfinite(found) else least
    return noise


def _levels(V_C1: Measured) -> float:
    """So many independent values V_C1 has: bins at one code share what it is off by."""
    _, bins = np.unique(np.round(V_C1.value / V_C1.resolution), return_counts=True)
    return float(bins.sum() ** 2 / (bins**2).sum())


class _Trial:
    """Residuals over their noise, by weight, freed of what the bench's bands allow."""

    def __init__(
        self,
        belief: Belief,
        problem: Residuals,
        noise: FloatArray,
        weight: FloatArray,
        parts: FloatArray | None = None,
    ) -> None:
        self._belief, self._problem, self._weight = belief, problem, weight
        self._noise, self._scale = noise, weight / noise
        size = len(belief.bands)
        self._parts = np.zeros(size) if parts is None else parts
        self.plain = self._under(belief.moved(self._parts))
        # V_C1's offset is of the channel, not of what is believed: its part stays 0
        self._bands = [
            (band[0], (self._under(belief.moved(self._parts + to)) - self.plain) / PART)
            for band, to in zip(belief.bands, PART * np.eye(size), strict=True)
        ]
        bins = problem.bins
        if bins and problem.offset > 0:
            shifted = np.zeros(problem.size)
            shifted[:bins] = problem.offset * self._scale[:bins]
            self._bands.append(("offset", shifted))
        self._bands += self._lists()

    def _lists(self) -> list[tuple[str, FloatArray]]:
        """What it does that each list may have begun elsewhere than the others.

        By then the force was 0 again, so what the clocks do within a list is all.
        """
        bands = zip(self._belief.bands, self._bands, strict=False)
        clocks = [change for (_, what, _), (_, change) in bands if what == "clock"]
        played = np.searchsorted(self._belief.begins, self._problem.times)
        return [
            ("clocks", np.where(played == number, change, 0.0))
            for change in clocks
            for number in range(1, self._belief.begins.size + 1)
        ]

    def about(self, belief: Belief, parts: FloatArray) -> _Trial:
        """The same about another belief, and `parts` of its bands."""
        return _Trial(belief, self._problem, self._noise, self._weight, parts)

    def timed(self, belief: Belief) -> _Trial:
        """The same about the part of the clocks' band that alone leaves least."""
        clocks = [what == "clock" for _, what, _ in belief.bands]
        tried = np.outer(CLOCKS, clocks)
        left = [np.linalg.norm(self._under(belief.moved(parts))) for parts in tried]
        return self.about(belief, tried[int(np.argmin(left))])

    def _under(self, driven: DrivenCircuit) -> FloatArray:
        return self._problem.under(driven) * self._scale

    def _free(self, but: str) -> tuple[FloatArray, FloatArray]:
        """What each band but one cause's does, shape (size, k), and its part here."""
        parts = np.zeros(len(self._bands))
        parts[: self._parts.size] = self._parts
        used = [cause != but for cause, _ in self._bands]
        columns = [change for cause, change in self._bands if cause != but]
        free = np.array(columns).reshape(-1, self._problem.size).T
        return free, parts[used]

    def taken(self, freed: FloatArray, but: str = "") -> FloatArray:
        """Of what `freed` gave, which part of each of the belief's bands was used."""
        used = iter(freed[self._problem.size :] / 1.96)
        taken = np.zeros_like(self._parts)
        for i, (cause, _, _) in enumerate(self._belief.bands):
            if cause != but:
                here = self._parts[i]
                part = np.clip(next(used), here - FARTHEST, here + FARTHEST)
                taken[i] = np.clip(part, -BAND, BAND)
        return taken

    def settled(self, freed: FloatArray, but: str = "") -> bool:
        """Whether the bands are used as far as they are here."""
        moved = self.taken(freed, but) - self._parts
        return float(np.max(np.abs(moved), initial=0.0)) < SETTLED

    def freed(self, scaled: FloatArray, but: str = "") -> FloatArray:
        """Residuals less what the bands explain best, then how far each was used.

        Args:
            scaled: shape (size,).
            but: the cause whose band may not be used.

        Returns:
            Shape (size + bands,): the parts of the 95 % bands used stand at the end, in
            standard deviations, so that the sum of squares weighs one with the other.
        """
        free, here = self._free(but)
        unused = scaled - free @ here
        prior = 1.96**2 * np.eye(here.size)
        taken = -np.linalg.solve(free.T @ free + prior, free.T @ unused)
        return np.concatenate([unused + free @ taken, 1.96 * taken])

    def misfit(self, freed: FloatArray) -> float:
        """Root mean square of each kind of evidence, or bands overused: the largest."""
        bins, size = self._problem.bins, self._problem.size
        scaled, taken = freed[:size] / self._weight, np.abs(freed[size:]) / 1.96
        parts = [part for part in (scaled[:bins], scaled[bins:]) if part.size]
        found = [float(np.sqrt(np.mean(part**2))) for part in parts]
        overused = float(np.max(taken, initial=0.0)) - 1
        return max(*found, NOTICED * overused / (BAND - 1))

    def _told(self, slope: FloatArray, but: str) -> float:
        """What the data tell of a size, 1/step^2, each band's cause left free in it."""
        free, _ = self._free(but)
        held = np.vstack([free, 1.96 * np.eye(free.shape[1])])
        seen = np.concatenate([slope, np.zeros(free.shape[1])])
        left = seen - held @ np.linalg.lstsq(held, seen, rcond=None)[0]
        told = float(left @ left)
        if told == 0:
            raise NotIdentifiableError("no data depend on it")
        return told

    def fitted(self, name: str) -> Suspect | None:
        """The suspect of its best size; None where the model cannot follow it."""
        own, trial, found, size = OWN.get(name, name), self, None, 0.0
        for _ in range(1 + AGAIN):
            try:
                found, left = trial._best(name, size)
                if trial is not self and trial.settled(left, own):
                    break
                size = found.size.value
                there = replace(self._belief, deviation=Deviation(**{name: size}))
                trial = self.about(there, trial.taken(left, own))
            except TactileLabError:
                break
        return found

    def _best(self, name: str, at: float) -> tuple[Suspect, FloatArray]:
        """The suspect, sought from `at`, where the belief is already; what it leaves.

        Raises:
            TactileLabError: the model cannot follow it.
        """
        step, own = SUSPECTS[name], OWN.get(name, name)
        believed = self._belief.deviation

        def residual(x: float) -> FloatArray:
            off = believed + Deviation(**{name: step * x})
            moved = replace(self._belief, deviation=off).moved(self._parts)
            return self._under(moved)

        # no lag is less than none
        lag = self._belief.magnet.eddy_lag
        lowest = -(lag + at) / step if name == "lag" else -math.inf
        x, left = _least(lambda x: self.freed(residual(x), own), lowest)
        slope = (residual(x + DIFFERENCE) - residual(x)) / DIFFERENCE
        misfit = self.misfit(left)
        error = step * max(misfit, 1.0) / math.sqrt(self._told(slope, own))
        size = Estimate.of(at + step * x, error, self._problem.size - 1)
        return Suspect(name, size, misfit), left


def _least(
    residual: Callable[[float], FloatArray], lowest: float
) -> tuple[float, FloatArray]:
    """Where a residual is least, not below `lowest`, and what it is there.

    By Gauss and Newton from 0, at most `LONGEST` at once, halved where that leads up.
    """
    x, left = 0.0, residual(0.0)
    for _ in range(ROUNDS):
        slope = (residual(x + DIFFERENCE) - left) / DIFFERENCE
        square = float(slope @ slope) or math.inf
        way = float(np.clip(-(slope @ left) / square, -LONGEST, LONGEST))
        way = max(way, lowest - x)
        for _ in range(4):
            there = residual(x + way)
            if there @ there <= left @ left:
                x, left = x + way, there
                break
            way /= 2
        if abs(way) < CLOSE:
            break
    return x, left
