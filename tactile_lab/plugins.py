"""Reaching upward by name only: protocols, dialects, benches.

Everything above `tactile_lab` is found here by string or file path, so that nothing
in this package imports it. Names are looked up on disk; a module is imported only
when it is asked for.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactile_lab.errors import SceneError, nearest

if TYPE_CHECKING:
    from types import ModuleType

    from tactile_lab.bench import Bench, Channel, CoilCapability, ScopeCapability
    from tactile_lab.planning.needs import Needs
    from tactile_lab.scene.bench_file import CoilSpec, ScopeSpec
    from tactile_lab.scene.scene import Scene
    from tactile_lab.trial import Protocol


def protocol_names() -> tuple[str, ...]:
    """Names of the protocols that ship, sorted; imports none of them."""
    return tuple(sorted(_names("protocols", ".py")))


def scene_names() -> tuple[str, ...]:
    """Names of the scenes that ship, sorted."""
    return tuple(sorted(_names("protocols", ".toml", "scenes")))


def scene_path(name: str) -> Path:
    """Where the shipped scene `name` lies."""
    return Path(str(resources.files("protocols") / "scenes" / f"{name}.toml"))


def protocol_class(name: str) -> type[Protocol]:
    """The protocol called `name`.

    Raises:
        SceneError: there is none of that name (the nearest is named), or its file is
            not a protocol.
    """
    known = protocol_names()
    if name not in known:
        hint = nearest(name, known)
        raise SceneError(
            f'protocol "{name}" does not exist; {hint + " " if hint else ""}'
            f"Known: {', '.join(known)}. A protocol of your own is named by "
            'source = "path/to/file.py".'
        )
    return _only_protocol(importlib.import_module(f"protocols.{name}"), name)


def protocol_from_file(path: Path) -> type[Protocol]:
    """The protocol in a Python file of the user's own.

    Raises:
        SceneError: the file is missing, does not run, or holds no protocol of its name.
    """
    path = path.resolve()
    if not path.is_file():
        raise SceneError(f"Protocol file {path} does not exist or is not a file.")
    mark = hashlib.sha256(str(path).encode()).hexdigest()[:8]
    spec = importlib.util.spec_from_file_location(f"_protocol_{path.stem}_{mark}", path)
    if spec is None or spec.loader is None:
        raise SceneError(
            f"Protocol file {path} is not Python; its name must end in .py."
        )
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # annotations of the class are resolved there
    try:
        spec.loader.exec_module(module)
    except Exception as reason:
        del sys.modules[spec.name]
        raise SceneError(
            f"Protocol file {path} does not run: {type(reason).__name__}: {reason}"
        ) from reason
    return _only_protocol(module, path.stem)


def open_bench(scene: Scene, needed: Needs, *, realtime: bool = False) -> Bench:
    """The bench `scene` names, with the instruments it needs; opens no instrument.

    Args:
        scene: its `bench` says whether physics is real or computed.
        needed: which instruments are needed, as the scene's plan has it.
        realtime: let a simulated bench keep pace with the wall clock.
    """
    room = "sim_backend.bench" if scene.bench.simulated else "drivers.bench"
    opening: Any = importlib.import_module(room)
    bench: Bench = opening.open_bench(scene, needed, realtime=realtime)
    return bench


def serve_bench(**options: Any) -> Any:
    """The simulated serial instruments, made for other programs; not yet served.

    Args:
        options: as `sim_backend.serve.ServedBench` takes them.

    Raises:
        SceneError: an address or dialect that cannot be served.
    """
    return importlib.import_module("sim_backend.serve").ServedBench(**options)


def attached(**options: Any) -> list[dict[str, Any]]:
    """What is attached to this computer; options as `drivers.attached.attached`."""
    found: list[dict[str, Any]] = importlib.import_module("drivers.attached").attached(
        **options
    )
    return found


def try_out_device(port: str, dialect: str, **options: Any) -> dict[str, str]:
    """Settings of a serial instrument, opened and closed as a run would.

    Raises:
        SceneError: no such dialect.
        InstrumentError, UnsafeError: as `drivers.attached.try_out`.
    """
    module: Any = importlib.import_module("drivers.attached")
    settings: dict[str, str] = module.try_out(port, dialect, **options)
    return settings


def diagnose(folder: Path, needed_rate: float) -> list[dict[str, Any]]:
    """Findings about this computer, as `drivers.diagnosis.diagnose` has them."""
    module: Any = importlib.import_module("drivers.diagnosis")
    findings: list[dict[str, Any]] = module.diagnose(folder, needed_rate)
    return findings


def coil_capability(coil: CoilSpec) -> CoilCapability:
    """What such a source can do, as far as is known before it is opened.

    Raises:
        SceneError: there is no such dialect, or a limit is beyond the source's rating.
    """
    from tactile_lab.bench import CoilCapability
    from tactile_lab.instruments.dialects import coil_dialect

    row = coil_dialect(coil.dialect)
    row.check_limits(coil.limits)
    return CoilCapability(
        title=row.title,
        bipolar=row.polarity == "both",
        update_interval=row.promised_interval(coil.baud),
    )


def scope_capability(scope: ScopeSpec) -> ScopeCapability:
    """What such a scope can do, as far as is known before it is opened.

    Raises:
        SceneError: there is no such row of a USBTMC scope.
    """
    from tactile_lab.bench import ScopeCapability

    if scope.driver == "usbtmc":
        from tactile_lab.instruments.dialects import scope_dialect

        row = scope_dialect(scope.dialect or "rigol-ds1000z")
        return ScopeCapability(
            gapless=False,
            inputs=row.inputs,
            ranges=row.ranges,
            bits=row.bits,
            fastest=row.fastest,
        )
    pico: Any = importlib.import_module("drivers.picoscope.scope")
    return ScopeCapability(
        gapless=True,
        inputs=tuple(pico.INPUTS),
        ranges=tuple(pico.RANGES),
        bits=8,
        fastest=tuple(pico.GUARANTEED),
    )


def check_scope(scope: ScopeSpec, channels: Sequence[Channel], rate: float) -> float:
    """Check that the scope can be set so; the rate it is sure to keep, S/s.

    Args:
        scope: driver and model.
        channels: to enable, at least one.
        rate: asked for, S/s.

    Raises:
        LimitError: an input, range, coupling or rate the scope does not have.
    """
    from tactile_lab.errors import LimitError

    capability = scope_capability(scope)
    wiring: Any = importlib.import_module("drivers.scope_wiring")
    wiring.check_channels(channels, capability)
    fastest = capability.fastest[min(len(channels), len(capability.fastest)) - 1]
    if scope.driver == "ps3000a":  # it may stream faster than its maker guarantees
        setup: Any = importlib.import_module("drivers.picoscope.setup")
        setup.streaming_interval(1 / rate)
    elif rate > fastest:
        raise LimitError(
            f"{rate:g} S/s on {len(channels)} channels is beyond the scope's "
            f"{fastest:g} S/s. Lower record.sample_rate."
        )
    return float(fastest)


def _names(package: str, ending: str, *inside: str) -> list[str]:
    folder = resources.files(package).joinpath(*inside)
    return [
        entry.name.removesuffix(ending)
        for entry in folder.iterdir()
        if entry.name.endswith(ending) and not entry.name.startswith("_")
    ]


def _only_protocol(module: ModuleType, name: str) -> type[Protocol]:
    from tactile_lab.trial import Protocol

    found = [
        kind
        for kind in vars(module).values()
        if isinstance(kind, type)
        and issubclass(kind, Protocol)
        and kind.__module__ == module.__name__
        and getattr(kind, "name", None) == name
    ]
    if len(found) != 1:
        raise SceneError(
            f"{module.__file__} must hold one subclass of tactile_lab.trial.Protocol "
            f'with name = "{name}" (the name of its file); it holds {len(found)}.'
        )
    return found[0]
