"""The world that all simulated instruments of one bench share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from sim_backend.plant.plant import Plant
from sim_backend.plant.scope_input import BUFFERED
from sim_backend.plant.scope_source import Acquisition, Codes
from tactile_lab.clock import Clock
from tactile_lab.scene.tables import Simulated
from tactile_lab.scope import Channel


class WiredInputs:
    """The plant at the scope's inputs, as the bench file wires them."""

    def __init__(self, plant: Plant, wiring: tuple[Channel, ...]) -> None:
        self._plant = plant
        self._wiring = {channel.input: channel for channel in wiring}
        self._probes = "circuit"

    def place_probes(self, where: str) -> None:
        """Put the probes of the circuit's voltages on "ground", "supply", "circuit"."""
        self._probes = where

    def _touches(self, name: str) -> str:
        """What the probe of input `name` touches."""
        if name not in self._wiring:
            return "none"
        signal = self._wiring[name].signal
        if signal not in BUFFERED or self._probes == "circuit":
            return signal
        return self._probes

    def render(
        self, acquisition: Acquisition, first: int, samples: int
    ) -> tuple[Codes, tuple[bool, ...]]:
        """Codes and over-range flags, as the scope is set and the plant is wired."""
        channels = [
            replace(
                self._wiring.get(one.name, Channel(signal="", input="", range=1.0)),
                signal=self._touches(one.name),
                input=one.name,
                range=one.range,
                offset=one.offset,
                coupling="AC" if one.coupling == "AC" else "DC",
            )
            for one in acquisition.inputs
        ]
        return self._plant.render(
            first,
            samples,
            acquisition.interval,
            acquisition.started,
            channels,
            acquisition.full_scale,
            acquisition.shift,
        )


@dataclass(frozen=True, kw_only=True)
class World:
    """What a simulated far end finds around it.

    Attributes:
        clock: the bench's time, computed or this computer's.
        plant: coil, magnet, sensor and what is measured of them.
        inputs: what lies at the scope's inputs; None where no scope is needed.
        simulated: the scene's ``[simulated]`` table.
        faults: what goes wrong and when, by kind of instrument ("coil", "scope",
            "field_meter", "thermometer", "voltage_source"), as its far end takes it;
            for tests.
        make: what scope there is and how it is connected, as its far end takes it.
    """

    clock: Clock
    plant: Plant
    inputs: WiredInputs | None
    simulated: Simulated
    faults: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    make: Any = None
