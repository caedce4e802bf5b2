"""A scene: all that one run uses, validated, in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import tomli_w

from tactile_lab.deviation import Deviation
from tactile_lab.follower import IDEAL, Pulse
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.state import Start
from tactile_lab.scene.bench_file import BenchSpec, is_file
from tactile_lab.scene.sensor import Sensor
from tactile_lab.scene.tables import CoilUse, Conditions, Detect, Record, Simulated
from tactile_lab.table import dumped
from tactile_lab.trial import Protocol
from tactile_lab.voltage_source import SOURCED


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """What one run uses; nothing of it is opened.

    Attributes:
        name: the file's name without its ending.
        path: the scene or protocol file; None only for scenes made in Python.
        bench: instruments, wiring, geometry.
        sensor: the circuit, its preset, and how it starts.
        protocol: typed parameters and trials.
        protocol_source: the user's Python file it came from, None for one that ships.
        record: signals kept and sample rate.
        detect: how spikes are found on V_K.
        simulated: physics of a simulated bench.
        coil: by which way it plays a force, and what if it cannot follow.
        conditions: under which the run is made.
    """

    name: str
    path: Path | None
    bench: BenchSpec
    sensor: Sensor
    protocol: Protocol
    protocol_source: Path | None
    record: Record
    detect: Detect
    simulated: Simulated
    coil: CoilUse
    conditions: Conditions

    @cached_property
    def circuit(self) -> Circuit:
        """The sensor as it is believed to be on this bench, its followers connected."""
        followers = self.bench.followers
        if followers is None:
            return self.sensor.circuit
        return replace(self.sensor.circuit, I_bias=followers.input_bias)

    @cached_property
    def spike(self) -> Pulse | None:
        """V_K at a spike as the scope sees it, behind a follower; None without R_k."""
        followers = self.bench.followers
        speed = IDEAL if followers is None else followers.speed
        return speed.spike(self.circuit.swing, self.circuit.tau_K)

    def spike_width(self, threshold: float) -> float:
        """Time V_K stays above `threshold` V at a spike, s; 0 if it is never there."""
        return 0.0 if self.spike is None else self.spike.width(threshold)

    def shows_spikes(self, threshold: float, rate: float) -> bool:
        """Whether no spike above `threshold` V fits between two samples of V_K.

        Args:
            threshold: on V_K, V.
            rate: of the samples, S/s.
        """
        return rate * self.spike_width(threshold) >= 1

    @property
    def displaced(self) -> dict[str, Circuit]:
        """By cause `circuit` with what is not known of it at the end of its 95 % band.

        A cause that the bench does not state, or none at all, is not among them.
        """
        followers, kelvin = self.bench.followers, self.sensor.temperature_uncertainty
        bias = 0.0 if followers is None else followers.input_bias_uncertainty
        off = {
            "follower": Deviation(input_bias=bias),
            "temperature": Deviation(temperature=kelvin or 0.0),
        }
        return {
            cause: one.circuit(self.circuit)
            for cause, one in off.items()
            if one != Deviation()
        }

    @property
    def sensor_alone(self) -> Scene:
        """The same with nothing connected to the sensor."""
        return replace(self, bench=replace(self.bench, followers=None))

    @property
    def start(self) -> Start | None:
        """Voltages at time 0, None for the equilibrium."""
        start = self.sensor.start
        return start if isinstance(start, Start) else None

    @property
    def asked(self) -> frozenset[str]:
        """Signals that are recorded, and those its protocol looks at."""
        wished = {name for name in self.protocol.wishes() if self.bench.measures(name)}
        return frozenset((*self.record.signals, *self.protocol.needs, *wished))

    @property
    def sourced(self) -> dict[str, float]:
        """Voltages of the circuit that source meters hold as a run begins, V."""
        named = {*self.sensor.sourced, *self.protocol.sets}
        return {name: getattr(self.circuit, name) for name in SOURCED if name in named}

    @property
    def force_accuracy(self) -> float:
        """Largest error of the force that is accurate enough, a part of its range."""
        return self.coil.accuracy or self.protocol.accuracy

    @property
    def compared(self) -> bool:
        """Whether the model is computed beside a run, and compared with it."""
        if not self.record.compare or self.protocol.moves_probes or self.protocol.sets:
            return False
        return bool(self.asked & {"V_C1", "V_C2", "spikes", "rate", "I_DS"})

    @property
    def files(self) -> tuple[Path, ...]:
        """Files beside the scene itself that it was made from; kept with a run."""
        named = [self.bench.path, self.protocol_source]
        if self.bench.magnet.calibration is not None:
            named.append(self.bench.magnet.calibration.path)
        of_voltages = self.bench.voltage_sources.values()
        for spec in (
            self.bench.coil,
            self.bench.scope,
            self.bench.field_meter,
            self.bench.thermometer,
            *of_voltages,
        ):
            if spec is not None:
                own = (spec.dialect, spec.driver)
                named += [Path(str(name)) for name in own if is_file(name)]
        file = getattr(self.protocol, "file", None)
        if isinstance(file, str) and file:
            named.append(Path(file))
        return tuple(dict.fromkeys(path for path in named if path is not None))

    def to_dict(self) -> dict[str, Any]:
        """All keys, expanded; quantities as exact texts, file names absolute."""
        protocol = {"name": self.protocol.name}
        if self.protocol_source is not None:
            protocol["source"] = str(self.protocol_source)
        return {
            "protocol": {**protocol, **dumped(self.protocol)},
            "record": dumped(self.record),
            "detect": dumped(self.detect),
            "sensor": dumped(self.sensor),
            "coil": dumped(self.coil),
            "simulated": dumped(self.simulated),
            "conditions": dumped(self.conditions),
            "bench": dumped(self.bench),
        }

    def to_toml(self, copies: Mapping[Path, str] | None = None) -> str:
        """The resolved scene: loading it gives this scene again.

        Args:
            copies: for a scene that is kept with a run: names of the copies of its
                files, relative to it. The conditions are then left out, for they were
                those of that one run.
        """
        data = self.to_dict()
        if copies is not None:
            del data["conditions"]
            data = _renamed(data, {str(path): name for path, name in copies.items()})
        return tomli_w.dumps(data)


def _renamed(data: Any, names: Mapping[str, str]) -> Any:
    """`data` with the texts in `names` replaced, at any depth."""
    if isinstance(data, dict):
        return {key: _renamed(value, names) for key, value in data.items()}
    return names.get(data, data) if isinstance(data, str) else data
