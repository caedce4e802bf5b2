"""The plant: the one simulated physical world behind all simulated instruments.

Set-points go in; current, field and force follow by physics; the circuit answers; and
the scope's inputs see it through the measurement chain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sim_backend.plant.coupling import Capacitor
from sim_backend.plant.driven_coil import DrivenCoil
from sim_backend.plant.electromagnet import Electromagnet
from sim_backend.plant.noise import NoiseSource, SensorNoise
from sim_backend.plant.options import PlantOptions
from sim_backend.plant.pieces import Pieces
from sim_backend.plant.scope_input import PLACED, ScopeInput, scope_inputs
from sim_backend.plant.sensor import NEEDS, SimulatedSensor
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.follower import Pulse
from tactile_lab.magnetics import Magnet
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.temperature import temperature
from tactile_lab.scope import Channel
from tactile_lab.waveform import Waveform

MEMORY = 0.2
"""How long the plant remembers what has been rendered, s."""
BACKLOG = 4096
"""Commands that may wait to be solved while nobody looks."""
UNPOWERED = 0.1
"""Least supply and threshold the circuit is computed with, V."""
Coupled = tuple[ScopeInput, Capacitor | None]
SIGNALS = (*NEEDS, "coil_current", "field", "temperature", *PLACED)
"""What may lie at a scope input."""


class _Drive:
    """Force on the cantilever as the electromagnet gives it."""

    def __init__(
        self,
        electromagnet: Electromagnet,
        magnet: Magnet,
        options: PlantOptions,
        noise: NoiseSource | None,
    ) -> None:
        self._noise = noise
        self._electromagnet = electromagnet
        self._magnet = magnet
        self._attraction, self._scale = options.attraction, options.force
        self._sign = -1.0 if options.inverted_coil else 1.0
        self.next_command = electromagnet.next_command
        self.latest_command = electromagnet.latest_command

    def force(self, start: float, end: float) -> Waveform:
        time, current = self._electromagnet.foreseen(start, end)
        drive = self._magnet.force(current * self._sign) * self._scale
        force = Waveform(time, drive + self._attraction)
        return force if self._noise is None else self._noise.on(force)


class Plant(DrivenCoil):
    """Coil, magnet, cantilever, circuit and measurement chain; safe for all threads.

    Args:
        circuit: the sensor circuit; the followers' bias is added to its own.
        magnet: field and force per current.
        options: which parts of the world there are.
        seed: of all noise; the same seed and commands give the same codes.
        beyond: by how much the circuit's voltages exceed what a source gives, V.
        sampled: whether a scope may look at it: else the circuit is not solved.
    """

    def __init__(
        self,
        circuit: Circuit,
        magnet: Magnet,
        options: PlantOptions | None = None,
        seed: int = 1,
        beyond: Mapping[str, float] | None = None,
        *,
        sampled: bool = True,
    ) -> None:
        self._beyond, self._sampled = beyond or {}, sampled
        self._sourced = 0.0
        self.options = options = options or PlantOptions()
        self.circuit = replace(circuit, I_bias=circuit.I_bias + options.bias)
        self.magnet = magnet
        self.seed = seed
        super().__init__(options.electromagnet())
        irregular, noise = options.sensor_noise, None
        if irregular != SensorNoise():
            noise = NoiseSource(
                irregular, seed, circuit.k_F, magnet.newtons_per_ampere, options.mains
            )
        acting = noise if irregular.of_force else None
        self._drive = _Drive(self._electromagnet, magnet, options, acting)
        fire = noise.V_fire if noise is not None and irregular.V_fire > 0 else None
        self._kelvin = temperature(self.circuit)
        warmer = options.warmer if options.warming else None
        self._sensor = SimulatedSensor(self.circuit, self._drive, fire, warmer)
        swing = self.circuit.swing
        self._spike = options.speed.spike(swing, self.circuit.tau_K)
        self._edge = options.speed.edge(swing)
        self._rendered = 0.0
        self._acquisition: tuple[object, list[Coupled]] | None = None

    def field(self, time: float) -> float:
        """Flux density of the electromagnet at `time` s, T."""
        with self._lock:
            self._reach(time)
            return float(self.magnet.field(self._effective(time)))

    def temperature(self, time: float) -> float:
        """Temperature of the sensor at `time` s, K."""
        return self._kelvin + self.options.warmer(time)

    def force(self, time: float) -> float:
        """Force on the cantilever at `time` s, the constant attraction included, N."""
        with self._lock:
            self._reach(time)
            drive = float(self.magnet.force(self._effective(time)))
            return drive * self.options.force + self.options.attraction

    def set_voltage(self, name: str, time: float, volts: float) -> None:
        """Let a source give `volts`, V, as V_GS, V_S or V_th from `time` s on."""
        volts += self._beyond.get(name, 0.0)
        if name != "V_GS":
            volts = max(volts, UNPOWERED)
        with self._lock:
            if getattr(self._sensor.latest, name) == volts:
                return
            # what has been rendered stays, as with the coil's commands
            self._sourced = max(time, self._rendered, self._sourced)
            self._sensor.become(self._sourced, self._sensor.latest.at({name: volts}))

    def accuracy(self) -> str:
        """How far the computed circuit is from its equations' exact solution."""
        with self._lock:
            time, volts = self._sensor.error_spike_time, self._sensor.error_V_C1
        told = []
        if time > 0:
            told.append(f"spike times within {time:.1e} s")
        if volts > 0:
            told.append(f"V_C1 within {volts:.1e} V")
        if not told:  # nothing of the circuit was computed
            return ""
        return (
            f"Simulated circuit, by its own estimate: {' and '.join(told)} of the "
            "exact solution; force between set-points within 1e-4 of a step."
        )

    @cached_property
    def _noise(self) -> NDArray[np.int16]:
        """The table of noise, made where a scope samples."""
        from sim_backend.plant.render import noise_table

        return noise_table(self.seed)

    def render(
        self,
        first_sample: int,
        n: int,
        interval: float,
        started: float,
        channels: Sequence[Channel],
        full_scale: int,
        shift: int,
    ) -> tuple[NDArray[np.int16], tuple[bool, ...]]:
        """Codes of samples `first_sample` to ``first_sample + n`` of each channel.

        Sample k is taken at ``started + k * interval`` on the bench's clock, by a
        scope clock without drift. Ask in order of time; at most `MEMORY` s back.

        Args:
            first_sample: from 0.
            n: samples per channel, from 1.
            interval: s.
            started: s.
            channels: what is wired where, and how it is digitised.
            full_scale: code at the end of the range.
            shift: low bits of every code that are 0.

        Returns:
            Codes, shape (channels, n), and whether each input left its range.

        Raises:
            ParameterError: an impossible request, or a time already forgotten.
        """
        _check(first_sample, n, interval, started, full_scale, shift)
        interval *= 1 + self.options.drift
        start = started + first_sample * interval
        end = started + (first_sample + n) * interval
        codes = np.empty((len(channels), n), dtype=np.int16)
        with self._lock:
            self._reach(end)
            inputs = self._inputs(tuple(channels), started, full_scale, shift)
            signals = [each.signal for each, _ in inputs]
            self._sensor.need((s for s in signals if s in NEEDS), start)
            over = tuple(
                each.digitise(
                    codes[row],
                    first_sample,
                    started,
                    interval,
                    self._noise,
                    self._coupled(each.signal, capacitor, start, end),
                    self._pulses(each.signal, start, end),
                )
                for row, (each, capacitor) in enumerate(inputs)
            )
            self._rendered = max(self._rendered, end)
            self._sensor.forget(self._rendered - MEMORY)
        return codes, over

    def _command(self, time: float) -> None:
        # what has been rendered stays: a later command takes effect after it
        time = max(time, self._rendered, self._electromagnet.last_command)
        if self._electromagnet.command(time, self._driven):
            self._sensor.commanded(time)
        if self._electromagnet.commands > BACKLOG:
            if self._sampled:
                # the model must have passed what the electromagnet forgets
                old = self._electromagnet.time_of(BACKLOG // 2)
                self._sensor.reach(old)
                self._sensor.forget(old)
            self._electromagnet.forget(BACKLOG // 2)

    def _effective(self, time: float) -> float:
        sign = -1.0 if self.options.inverted_coil else 1.0
        return sign * self._electromagnet.effective(time)

    def _inputs(
        self, channels: tuple[Channel, ...], started: float, full_scale: int, shift: int
    ) -> list[Coupled]:
        """The inputs of an acquisition, worked out when it is first asked for."""
        asked = (channels, started, full_scale, shift)
        if self._acquisition is None or self._acquisition[0] != asked:
            inputs = scope_inputs(
                channels, self.options, self.seed, started, full_scale, shift
            )
            for channel, each in zip(channels, inputs, strict=True):
                if each.signal not in SIGNALS:
                    raise ParameterError(
                        f"Input {channel.input} cannot carry {each.signal!r}; the "
                        f"plant has {', '.join(SIGNALS)}."
                    )
            capacitors = [
                Capacitor(started) if channel.coupling == "AC" else None
                for channel in channels
            ]
            self._acquisition = asked, list(zip(inputs, capacitors, strict=True))
        return self._acquisition[1]

    def _coupled(
        self, signal: str, capacitor: Capacitor | None, start: float, end: float
    ) -> Pieces:
        if capacitor is None:
            return self._pieces(signal, start, end)
        return capacitor.passed(
            lambda low, high: self._pieces(signal, low, high), start, end
        )

    def _pieces(self, signal: str, start: float, end: float) -> Pieces:
        if signal == "supply":
            return Pieces.constant(self.circuit.V_S, start)
        if signal in (*PLACED, "V_K"):
            return Pieces.constant(0.0, start)
        if signal == "coil_current":
            return self._electromagnet.currents(start, end)
        if signal == "temperature":
            knots = np.linspace(start, max(end, start + 1e-9), 3)
            return Pieces.through(knots, np.array([*map(self.temperature, knots)]))
        if signal == "field":
            return self._field_pieces(start, end)
        return self._sensor.pieces(signal, start, end)

    def _field_pieces(self, start: float, end: float) -> Pieces:
        current = self._electromagnet.effectives(start, end)
        sign = -1.0 if self.options.inverted_coil else 1.0
        field = self.magnet.field(current.value * sign)
        ahead = 1e-6
        later = self.magnet.field((current.value + current.slope * ahead) * sign)
        return Pieces(current.start, field, (later - field) / ahead)

    def _pulses(
        self, signal: str, start: float, end: float
    ) -> tuple[Pulse, FloatArray] | None:
        """Fast transients of a signal and when they begin, s."""
        if signal == "V_K" and self._spike is not None:
            self._sensor.reach(end)
            return self._spike, self._sensor.spikes(start - self._spike.length, end)
        if signal == "V_C2" and self._edge is not None:
            held = self.circuit.reset_time
            spikes = self._sensor.spikes(start - held - self._edge.length, end)
            return self._edge, spikes + held
        return None


def _check(
    first: int, n: int, interval: float, started: float, full_scale: int, shift: int
) -> None:
    if not (first >= 0 and n >= 1 and interval > 0 and started >= 0):
        raise ParameterError(
            f"Cannot render {n} samples from number {first} every {interval} s "
            f"from {started} s on; numbers and times count from 0."
        )
    if not (0 <= shift < 15 and 1 << shift <= full_scale <= 32767):
        raise ParameterError(
            f"full_scale = {full_scale} must fit int16 and {shift} zero bits."
        )
