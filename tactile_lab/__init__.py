"""Instrument control for spiking, adapting piezoelectric tactile sensors.

A scene says all that one run uses: bench, sensor, protocol, signals to record. `load`
reads one and checks it, `plan` says what it takes, `run` carries it out and returns a
`Run`, from which every sample comes back; `simulate` solves the model alone. None of
them opens an instrument, except `run` with a bench file of yours.

    >>> import tactile_lab
    >>> changes = {"protocol.levels": [0.12, "160 mN"], "protocol.rest": 0.5}
    >>> plan = tactile_lab.plan("demo", changes)
    >>> plan.estimate.trials, round(plan.estimate.duration, 1)
    (2, 6.3)
    >>> run = tactile_lab.run(plan.scene)
    >>> run
    <Run of demo: complete, simulated, 6.306 s, 2 trials, 32 spikes; V_C1, ...>
    >>> run.trials["level"], run.trials["spikes"]
    (array([0.12, 0.16]), array([13, 19], dtype=uint32))
    >>> run.spikes["time"][:3].round(2)
    array([0.62, 0.73, 0.85])
    >>> run.force.at([1.5, 4.5]).round(3)
    array([0.12, 0.16])
    >>> table = run.to_pandas(rate=1e3)
    >>> list(table)
    ['V_C1', 'V_C2', 'V_K', 'coil_current', 'force']
    >>> tactile_lab.latest().path == run.path
    True

Numbers are in SI; a quantity with a unit is a text, "120 mN". A run lies under ./runs
with its report; it is opened again by `Run.load(folder)`, `latest()`, or one of
`runs()`. `write_report` draws the report again. In a notebook a plan, a run and a
report show themselves.

    >>> force = tactile_lab.Waveform.pulse(0.15, ramp=0.01, hold=10.0, rest=2.0)
    >>> found = tactile_lab.simulate(tactile_lab.Circuit(V_GS=1.41), force)
    >>> len(found.spike_times)
    46

A study varies a scene: `study` computes what is missing of it on every core and gives
one labelled data set (docs/studies.md). `design` chooses parts for a wanted behaviour,
`identify` fits the sensor's parameters to one or several runs.

A protocol of your own is a subclass of `Protocol` that yields one `Trial` after
another, in a file that `load` takes. Whatever is refused or fails is a
`TactileLabError`, and also the builtin it resembles.

Everything else is found by its room, such as ``tactile_lab.analysis.adaptation``; see
docs/architecture.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tactile_lab.errors import TactileLabError
    from tactile_lab.model.circuit import Circuit
    from tactile_lab.planning.plan import Plan
    from tactile_lab.report.write import Report
    from tactile_lab.scene.load import load
    from tactile_lab.scene.scene import Scene
    from tactile_lab.scripting import (
        design,
        identify,
        latest,
        plan,
        run,
        runs,
        simulate,
        study,
        write_report,
    )
    from tactile_lab.store.run import Run
    from tactile_lab.trial import Protocol, Trial
    from tactile_lab.waveform import Waveform

    __version__: str

__all__ = [
    "Circuit",
    "Plan",
    "Protocol",
    "Report",
    "Run",
    "Scene",
    "TactileLabError",
    "Trial",
    "Waveform",
    "design",
    "identify",
    "latest",
    "load",
    "plan",
    "run",
    "runs",
    "simulate",
    "study",
    "write_report",
]

_HOMES = {
    "Circuit": "model.circuit",
    "Plan": "planning.plan",
    "Protocol": "trial",
    "Report": "report.write",
    "Run": "store.run",
    "Scene": "scene.scene",
    "TactileLabError": "errors",
    "Trial": "trial",
    "Waveform": "waveform",
    "design": "scripting",
    "identify": "scripting",
    "latest": "scripting",
    "load": "scene.load",
    "plan": "scripting",
    "run": "scripting",
    "runs": "scripting",
    "simulate": "scripting",
    "study": "scripting",
    "write_report": "scripting",
}
"""Where each name is defined: a module is imported when its name is asked for."""


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("tactile-lab")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})
