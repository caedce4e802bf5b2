"""What the model makes of each trial, told while the run goes on."""

from __future__ import annotations

import numpy as np

from tactile_lab.acquisition.events import CoilCurrent
from tactile_lab.acquisition.live_model import LiveModel
from tactile_lab.analysis.spike_pairs import match
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import TactileLabError
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.trial import Outcome


class ModelComparison:
    """Compares each outcome with the model under the current that was applied.

    Each set-point is taken to act as the source begins to answer, and how far that may
    be off is said; the report puts it where the shunt saw it.

    Args:
        scene: that is run.
        searched: whether spikes are looked for.
        counted: whether each spike is found; else a count is of those that were seen.
    """

    def __init__(self, scene: Scene, *, searched: bool, counted: bool = True) -> None:
        self._model: LiveModel | None = LiveModel.of(scene)
        self._searched, self._counted = searched, counted
        self._doubt = 0.0
        self._model.until(0.0)  # compiles, before the coil waits for anything

    def add(self, applied: CoilCurrent) -> None:
        """The source has given a current."""
        if self._model is not None:
            self._doubt = max(self._doubt, applied.doubt)
            self._model.add(applied.acted, applied.amperes)

    def ended(self, outcome: Outcome) -> str:
        """One sentence on a trial; "" where there is nothing to compare.

        After a force the model cannot follow it says so, once, and is silent then.
        """
        if self._model is None:
            return ""
        trial, start = outcome.trial, outcome.start
        end = max(start + trial.length, self._model.reached)
        try:
            begin = self._model.reached
            out = self._model.until(end)
            # a look at the rest between trials is no result either
            if trial.pause or (trial.level is None and trial.force.peak == 0):
                return ""
            trace = outcome.traces.get("V_C1", np.empty((0, 2)))
            time = trace[:, 0] + start
            inside = (time >= begin) & (time <= end)
            told = []
            if self._searched:
                told.append(self._spikes(outcome, out.spike_times))
            if "V_C1" in outcome.cut_off:
                told.append("V_C1 left its range")
            elif inside.any():
                predicted = out.sample("V_C1", time[inside])
                off = trace[inside, 1] - predicted
                rms = show(float(np.sqrt(np.mean(off**2))), "V", 2)
                told.append(f"V_C1 {show(float(off.mean()), 'V', 2, '+')} ({rms} rms)")
        except TactileLabError as reason:
            self._model = None
            return f"the model cannot follow any more: {reason}"
        if not told:
            return ""
        return f"{trial.label}: measured less model: {', '.join(told)}"

    def _spikes(self, outcome: Outcome, spikes: FloatArray) -> str:
        start, length = outcome.start, outcome.trial.length
        mine = spikes[(spikes >= start) & (spikes < start + length)] - start
        count = outcome.spike_times.size
        seen = "" if self._counted else " seen, not all"
        text = f"{count} spike{'' if count == 1 else 's'}{seen} (model {mine.size})"
        offsets = match(outcome.spike_times, mine).offsets
        if offsets.size:
            text += f", {show(float(np.median(offsets)), 's', 2, '+')} (median"
            if self._doubt > 0:
                known = show(self._doubt, "s", 2)
                text += f"; the coil's steps are known to ±{known}"
            text += ")"
        return text
