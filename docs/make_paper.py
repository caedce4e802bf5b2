"""Write docs/paper.md: the paper's figures, ours beside them, in numbers.

Run by `make reports`, or alone: ``.venv/bin/python docs/make_paper.py``. It runs the
shipped scenes on the simulated bench (a minute or two), keeps each figure under
docs/paper/ and fills the numbers into the text of paper_page.py.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
import textwrap
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
from paper_page import page
from paper_panels import panels

from tactile_lab.analysis.transfer import Transfer, fit_transfer
from tactile_lab.analysis.transfer_file import read_transfer
from tactile_lab.engine.execution import Execution
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.report.canvas import draw, save
from tactile_lab.report.from_run import read
from tactile_lab.report.transfer import transfer_plot
from tactile_lab.report.write import write
from tactile_lab.scene.load import load
from tactile_lab.waveform import Waveform

DOCS = Path(__file__).parent
OFFSETS = (-3e-3, -1e-3, 0.0, 0.5e-3)
SCENES: dict[str, tuple[str, list[str]]] = {
    name: (name, [])
    for name in (
        "demo", "rate_force", "hold_10s", "fig5b", "repeat", "bipolar",
        "threshold_search",
    )
}  # fmt: skip
SATURATED = [
    "sensor.saturation=true",
    'protocol.levels=["85 mN", "95 mN", "100 mN", "110 mN", "125 mN", "150 mN", '
    '"175 mN", "200 mN", "225 mN", "250 mN", "300 mN"]',
]
SCENES["saturated"] = ("rate_force", SATURATED)
PICTURES = (
    "demo-figure", "demo-twin", "rate_force-summary", "saturated-summary",
    "hold_10s-figure", "fig5b-figure", "fig5b-summary", "fig5b-adrian",
    "repeat-summary", "bipolar-summary",
)  # fmt: skip


@dataclass(frozen=True)
class Trimmed:
    """What Fig. 5b's 50 mN give with V_GS off its tuned value.

    Attributes:
        off: of V_GS, V.
        spikes: number within 60 s.
        last: time of the last after the first, s; None where it still fired.
        at_rest: it fires without force.
    """

    off: float
    spikes: int
    last: float | None
    at_rest: bool


def main() -> None:
    """Run all scenes and write the page."""
    captions: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as scratch:
        found = {name: run(name, Path(scratch), captions) for name in SCENES}
    captions |= panels(DOCS / "paper")
    swing, captions["transfer"] = transfer()
    ideal = [ideal_spikes(level) for level in (0.08, 0.12, 0.16, 0.2)]
    text = page(found, captions, swing, ideal, [trimmed(off) for off in OFFSETS])
    (DOCS / "paper.md").write_text(wrapped(text), encoding="utf-8")


def run(name: str, scratch: Path, captions: dict[str, str]) -> dict[str, Any]:
    """Run one scene, keep its figures and their captions, return its results."""
    print(f"{name} ...", file=sys.stderr, flush=True)
    scene, overrides = SCENES[name]
    done = Execution(load(scene, overrides), scratch).run()
    if done.exit_code:
        raise SystemExit(f"{name} ended {done.state}: {done.reason}")
    report = write(done.folder, read(done.folder))
    for plot in report.findings.plots:
        kept = f"{name}-{plot.name}"
        if kept in PICTURES:
            captions[kept] = plot.caption
            picture = done.folder / f"{plot.name}.png"
            shutil.copy(picture, DOCS / "paper" / f"{kept}.png")
    results: dict[str, Any] = json.loads(report.results.read_text(encoding="utf-8"))
    return results


def wrapped(text: str) -> str:
    """The page with its paragraphs filled to 88 columns."""
    blocks = text.split("\n\n")
    plain = [b if b[:1] in "#|!" else _filled(b) for b in blocks]
    return "\n\n".join(plain).rstrip() + "\n"


def _filled(block: str) -> str:
    """A paragraph, or a list item by item."""
    items = block.split("\n- ") if block.startswith("- ") else [block]
    indent = "  " if block.startswith("- ") else ""
    return "\n".join(
        textwrap.fill(" ".join(item.split()), 88, subsequent_indent=indent)
        for item in [items[0], *(f"- {item}" for item in items[1:])]
    )


def ideal_spikes(level: float) -> int:
    """Spikes of the model under an ideal pulse from rest, as in the demo's sequence."""
    levels = (0.08, 0.12, 0.16, 0.2)
    pulses = (Waveform.pulse(one, ramp=0.25, hold=2.0, rest=2.0) for one in levels)
    times = simulate(Circuit(), reduce(Waveform.then, pulses)).solution.spike_times
    start = 4.5 * levels.index(level)
    return int(np.count_nonzero((times >= start) & (times < start + 4.5)))


def trimmed(off: float) -> Trimmed:
    """The model under Fig. 5b's force with V_GS off its tuned value by `off` V."""
    force = Waveform.pulse(0.05, ramp=0.25, hold=60.0, rest=2.0)
    found = simulate(Circuit(V_GS=1.54141 + off), force, keep=("spikes",))
    times = found.solution.spike_times
    silent = times.size and times[-1] < 59.0
    return Trimmed(
        off, int(times.size), float(times[-1] - times[0]) if silent else None,
        any("fires at rest" in text for text in found.warnings),
    )  # fmt: skip


def transfer() -> tuple[Transfer, str]:
    """A fit to Table 1's own curve with noise, kept as a CSV and drawn; its caption."""
    volts, circuit = np.linspace(0, 3.5, 71), Circuit()
    line = circuit.I_S * np.exp(np.minimum(volts, 2.75) / (circuit.m * circuit.V_T))
    noise = np.random.default_rng(1).normal(0, 0.05, volts.size)
    amperes = line * np.exp(noise)
    rows = "\n".join(f"{v:.4g},{i:.6g}" for v, i in zip(volts, amperes, strict=True))
    path = DOCS / "paper" / "transfer.csv"
    path.write_text(
        f"# computed from Table 1, with 5 % noise\nV_GS_V,I_DS_A\n{rows}\n",
        encoding="utf-8",
    )
    curve = read_transfer(path)
    fit = fit_transfer(curve.V_GS, curve.I_DS)
    name = "computed from Table 1, with 5 % noise"
    plot = transfer_plot(curve, fit)
    save(draw(plot, "Transfer curve", name), DOCS / "paper" / "transfer")
    (DOCS / "paper" / "transfer.svg").unlink()
    return fit, plot.caption


if __name__ == "__main__":
    main()
