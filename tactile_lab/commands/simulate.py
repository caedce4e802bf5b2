"""``tactile-lab simulate``: the model alone; the force is taken as given."""

from __future__ import annotations

import sys
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactile_lab.commands.options import exports_option, json_option, scene_options
from tactile_lab.commands.terminal import fail, print_json, refusing, say, warn, working
from tactile_lab.neuro.formats import CIRCUITS, circuit_format_of

if TYPE_CHECKING:
    from tactile_lab.model.simulate import Result
    from tactile_lab.scene.scene import Scene
    from tactile_lab.waveform import Waveform

MOST_SAMPLES = 10_000_000


@click.command()
@scene_options
@click.option(
    "--samples",
    type=click.IntRange(2, MOST_SAMPLES),
    help="Also sample the recorded signals at so many points, both ends included.",
)
@click.option(
    "--tolerance",
    type=float,
    default=1e-9,
    show_default=True,
    metavar="SECONDS",
    help="Error of spike times aimed at, s (and of V_C1, V).",
)
@exports_option(
    "Write the circuit under this force for another simulator; the ending says which: "
    + ", ".join(CIRCUITS)
)
@json_option
def command(
    scene: str | None,
    overrides: tuple[str, ...],
    bench: str | None,
    samples: int | None,
    tolerance: float,
    exports: tuple[Path, ...],
    as_json: bool,
) -> None:
    """Simulate the sensor of SCENE (the demo unless given) under its force.

    Opens no bench and writes only what is exported: no coil, calibration, follower or
    limit applies.
    """
    with refusing():
        from tactile_lab.planning.preview import model, modelled
        from tactile_lab.planning.timeline import timeline
        from tactile_lab.scene.load import load

        for file in exports:
            circuit_format_of(file)
        loaded = load(scene, overrides, bench).sensor_alone
        drive = timeline(loaded, through_coil=False)
        with working("solving the model"):
            result = model(
                loaded, drive.force, drive.duration, modelled(loaded), tolerance
            )
        report = answer(loaded, result, samples)
        for file in exports:
            _export(loaded, drive.force, drive.duration, file)
    if as_json:
        for text in report["warnings"]:
            warn(text)
        print_json(report)
    else:
        _print(loaded, result, report)


def _export(scene: Scene, force: Waveform, duration: float, file: Path) -> None:
    from tactile_lab.neuro.circuits import write
    from tactile_lab.neuro.solved import Solved

    solved = Solved.of(
        scene.circuit, force, duration, start=scene.start, title=scene.name
    )
    try:
        for one in write(solved, file):
            say(f"written     {one}", sys.stderr)
    except OSError as error:
        fail(f"{file} cannot be written: {error.strerror}.", 2)


def answer(scene: Scene, result: Result, samples: int | None) -> dict[str, Any]:
    """The documented object (docs/json.md)."""
    from tactile_lab.signals import BENCH_ONLY

    wanted = scene.record.signals
    bench_only = [name for name in wanted if name in BENCH_ONLY]
    warnings = list(result.warnings)
    for name in bench_only:
        warnings.append(f"{name} exists only on a bench; simulate leaves it out.")
    for key in _of_the_bench(scene):
        warnings.append(f"{key} is the simulated bench's; simulate leaves it out.")
    spikes = result.spike_times if "spikes" in wanted else None
    return {
        "spike_times_s": None if spikes is None else spikes.tolist(),
        "samples": None if samples is None else _sampled(scene, result, samples),
        "error_estimate": {
            "spike_time_s": result.error.spike_time,
            "V_C1_V": result.error.V_C1,
        },
        "run_time_s": result.run_time,
        "left_out": [*result.left_out, *bench_only],
        "warnings": warnings,
    }


def _of_the_bench(scene: Scene) -> list[str]:
    """Keys of [simulated] that are not as usual; a seed alone changes nothing."""
    from tactile_lab.scene.tables import Simulated

    asked, usual = scene.simulated, Simulated()
    names = [one.name for one in fields(Simulated) if one.name != "seed"]
    moved = (name for name in names if getattr(asked, name) != getattr(usual, name))
    return [f"simulated.{name}" for name in moved]


def _sampled(scene: Scene, result: Result, samples: int) -> dict[str, list[float]]:
    import numpy as np

    from tactile_lab.planning.preview import modelled

    times = np.linspace(0.0, result.duration, samples)
    found = {"time_s": times.tolist()}
    for name in modelled(scene):
        if name != "spikes":
            found[name] = result.sample(name, times).tolist()
    return found


def _print(scene: Scene, result: Result, report: dict[str, Any]) -> None:
    from tactile_lab.quantity import show

    say(f"{scene.name}: {show(result.duration, 's')} of the model")
    spikes = report["spike_times_s"]
    if spikes is not None:
        when = f", first {spikes[0]:.9f} s, last {spikes[-1]:.9f} s" if spikes else ""
        say(f"spikes      {len(spikes)}{when}")
    error = report["error_estimate"]
    known = [
        f"{show(value, unit, 2)} {what}"
        for value, unit, what in (
            (error["spike_time_s"], "s", "in spike times"),
            (error["V_C1_V"], "V", "in V_C1"),
        )
        if value is not None
    ]
    if known:
        say(f"error       at most about {', '.join(known)}")
    say(f"run time    {show(report['run_time_s'], 's', 3)}")
    if report["left_out"]:
        say(f"left out    {', '.join(report['left_out'])}")
    for text in report["warnings"]:
        warn(text)
