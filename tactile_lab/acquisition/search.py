"""A scene's ``[detect]`` in the codes of a running stream."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from tactile_lab.errors import ParameterError
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.scene.tables import AUTO
from tactile_lab.scope import Stream
from tactile_lab.spikes.detection import Detection

if TYPE_CHECKING:  # compiled code, which a run without spikes does not load
    from tactile_lab.spikes.crossings import Codes
    from tactile_lab.spikes.detector import Detector, ResetDetector

RESET_EDGE = 0.5e-6
"""Longest a reset of V_C2 takes at the follower's output, s: 4 V at 13 V/us."""

REST = 0.1
"""Length of the record that a threshold is estimated from, s."""


class SpikeSearch:
    """How one run searches spikes: on line, and again in its stored samples.

    Args:
        scene: with the settings, as given or "auto".
        signal: name of the channel that is searched.
    """

    def __init__(self, scene: Scene, signal: str) -> None:
        self._scene = scene
        self.signal = signal
        self._learnt: tuple[int, int] | None = None

    @classmethod
    def of(cls, scene: Scene, signal: str | None) -> SpikeSearch | None:
        """The search on a channel, ready; None where no spikes are looked for.

        Its loop is compiled here, the first time on a computer for some seconds: at
        the first block the run would stand still for longer than the coil waits.
        """
        if signal is None:
            return None
        from tactile_lab.spikes.detector import compile_search

        compile_search()
        return cls(scene, signal)

    @property
    def must_learn(self) -> bool:
        """Whether the threshold is still to be estimated from noise."""
        auto = self.signal == "V_K" and self._scene.detect.threshold == AUTO
        return auto and self._learnt is None

    def row(self, stream: Stream) -> int:
        """Row of the stream's blocks that is searched."""
        return [channel.signal for channel in stream.channels].index(self.signal)

    def learn(self, stream: Stream, codes: Codes) -> None:
        """Estimate threshold and hysteresis from the channel's codes at rest.

        Raises:
            ParameterError: the noise leaves no room for a threshold in the range.
        """
        from tactile_lab.spikes.detector import estimate

        self._learnt = estimate(codes, step=1 << stream.shift)

    def detection(self, stream: Stream) -> Detection:
        """The settings in codes of the stream; the same for the whole run."""
        chosen = self._scene.detect
        gain, offset = stream.volts_per_code(self.row(stream))
        refractory = round(chosen.refractory / stream.interval)
        if self.signal != "V_K":
            return Detection(
                signal=self.signal,
                threshold=round(self._scene.circuit.swing / 2 / gain),
                hysteresis=1,
                refractory=refractory,
                kind="reset",
                span=max(2, math.ceil(RESET_EDGE / stream.interval)),
            )
        if self._learnt is not None:
            threshold, hysteresis = self._learnt
        elif isinstance(chosen.threshold, float) and isinstance(
            chosen.hysteresis, float
        ):
            threshold = round((chosen.threshold - offset) / gain)
            hysteresis = max(1, round(chosen.hysteresis / gain))
        else:
            raise ParameterError(
                "No noise was recorded to estimate the spike threshold from; set "
                "detect.threshold."
            )
        return Detection(
            signal=self.signal,
            threshold=threshold,
            hysteresis=hysteresis,
            refractory=refractory,
        )

    def amplitude_scale(self, stream: Stream) -> tuple[float, float]:
        """Gain and offset, V, that make volts of the amplitude of a spike found."""
        scale = stream.volts_per_code(self.row(stream))
        return self.detection(stream).amplitude_scale(*scale)

    def detector(self, stream: Stream) -> Detector | ResetDetector:
        """A fresh detector for the stream."""
        from tactile_lab.spikes.detector import detector_of

        return detector_of(self.detection(stream))

    def describe(self, stream: Stream) -> dict[str, Any]:
        """The settings in SI, for `run.json`."""
        gain, offset = stream.volts_per_code(self.row(stream))
        found = self.detection(stream)
        reset = found.kind == "reset"
        return {
            "signal": found.signal,
            "kind": found.kind,
            "threshold_V": found.threshold * gain + (0.0 if reset else offset),
            "hysteresis_V": None if reset else found.hysteresis * gain,
            "refractory_s": found.refractory * stream.interval,
            "from": "noise" if self._learnt is not None else "scene",
        }

    def told(self, stream: Stream) -> str:
        """What was learnt, for a person."""
        known = self.describe(stream)
        return (
            f"spike threshold {show(known['threshold_V'], 'V', 3)} on {self.signal}, "
            f"hysteresis {show(known['hysteresis_V'], 'V', 3)}: estimated from the "
            f"noise of the first {show(REST, 's')}"
        )
