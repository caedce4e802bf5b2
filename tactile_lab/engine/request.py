"""What to run, in the words of the command line."""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from tactile_lab.model.circuit import Circuit
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene


@dataclass(frozen=True)
class Request:
    """What the form asks for: the same words as on the command line.

    Attributes:
        path: scene file, protocol file, name of a shipped scene; None for the demo.
        overrides: ``table.key=value`` texts.
        bench: bench file or "sim".
    """

    path: str | None = None
    overrides: tuple[str, ...] = ()
    bench: str | None = None

    def load(self) -> Scene:
        """The scene.

        Raises:
            SceneError: it cannot be used.
        """
        path = None if self.path is None else Path(self.path)
        return load(path, self.overrides, self.bench)

    def command(self) -> str:
        """The command that runs the same thing."""
        words = ["tactile-lab", "run"]
        if self.path is not None:
            words.append(shlex.quote(self.path))
        words += [f"--set {shlex.quote(text)}" for text in self.overrides]
        if self.bench is not None:
            words.append(f"--bench {shlex.quote(self.bench)}")
        return " ".join(words)


def bench_request(
    bench: str, spec: BenchSpec, overrides: tuple[str, ...] = ()
) -> Request:
    """A request that needs every instrument of a bench, and next to no force of it."""
    channels = () if spec.scope is None else spec.scope.channels
    signals = [channel.signal for channel in channels]
    signals += ["force"] if spec.coil is not None else []
    signals += ["field"] if spec.field_meter is not None else []
    signals += ["temperature"] if spec.thermometer is not None else []
    sources = spec.voltage_sources
    believed = Circuit().at(cast("dict[str, float]", spec.hand_set))
    allowed = [
        f"sensor.{name}={one.limits.nearest(getattr(believed, name))!r} V"
        for name, one in sources.items()
    ]
    return Request(
        "demo",
        (
            'protocol.levels=["1 mN"]',
            f"record.signals={json.dumps(signals)}",
            f"sensor.sourced={json.dumps(list(sources))}",
            *allowed,
            *overrides,
        ),
        bench,
    )
