"""Panels of the paper that no run of the bench shows, computed with the model.

Fig. 1c, inset, is a mean over three transistors with its standard error, Fig. 1d the
mean of the responses to periodic stimuli; the three here are drawn from tolerances.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.plot import Guide, Panel, Plot, Series
from tactile_lab.report.canvas import draw, save
from tactile_lab.waveform import Waveform

SPECIMENS = 3
"""As many as in the paper's inset."""
TOLERANCES = "R 1 %, C 5 %, V_GS 2 mV, V_th 5 mV, each two standard deviations"
LEVEL, RAMP, HOLD, REST, STIMULI = 0.05, 0.1, 1.0, 1.0, 8
"""Of Fig. 1d here: N, s, s, s, number; the paper gives none of them."""


def specimens() -> list[Circuit]:
    """Circuits that differ as parts do."""
    chance = np.random.default_rng(1)
    made = []
    for _ in range(SPECIMENS):
        table = Circuit()
        parts = {
            name: getattr(table, name) * (1 + chance.normal(0, part / 2))
            for part, names in ((0.01, "R1 R2 R3 R_L"), (0.05, "C1 C2"))
            for name in names.split()
        }
        moved = {
            name: getattr(table, name) + chance.normal(0, volts / 2)
            for name, volts in (("V_GS", 2e-3), ("V_th", 5e-3))
        }
        made.append(replace(table, **parts, **moved))
    return made


def panels(folder: Path) -> dict[str, str]:
    """Draw both into `folder`; their captions by name."""
    captions = {}
    for plot, title in (
        (output_curves(), "Drain current of three specimens"),
        (periodic(), "Drain current under periodic stimuli"),
    ):
        save(draw(plot, title, "computed with the model"), folder / plot.name)
        (folder / f"{plot.name}.svg").unlink()
        captions[plot.name] = plot.caption
    return captions


def output_curves() -> Plot:
    """I_DS against V_DS, mean and standard error (Fig. 1c, inset)."""
    volts, series = np.linspace(0, 1, 201), []
    for over, colour in ((0.0, "I_DS"), (0.1, "force"), (0.2, "V_C1")):
        currents = np.array(
            [
                c.I_S * np.exp((c.V_GS + over) / (c.m * c.V_T))
                * -np.expm1(-volts / c.V_T)
                for c in specimens()
            ]
        )  # fmt: skip
        name = f"V_GS = {Circuit().V_GS + over:.1f} V"
        series.append(_mean(volts, currents, colour, name))
    end = currents[:, -1]
    relative = end.std(ddof=1) / np.sqrt(end.size) / end.mean()
    return Plot(
        name="output",
        caption="I_DS against V_DS by Eq. (8), mean of three specimens and, shaded, "
        f"its standard error, {100 * relative:.1f} % ({TOLERANCES}). It saturates "
        "within a tenth of a volt.",
        x_label="V_DS",
        x_unit="V",
        panels=(Panel(label="I_DS", unit="A", series=tuple(series), limits=(0, None)),),
    )


def periodic() -> Plot:
    """I_DS under equal stimuli, mean and standard error (Fig. 1d)."""
    one = Waveform.pulse(LEVEL, ramp=RAMP, hold=HOLD, rest=REST)
    force = one
    for _ in range(STIMULI - 1):
        force = force.then(one)
    time, period = np.linspace(0, force.end, 3201), one.end
    currents = np.array(
        [simulate(c, force, keep=("I_DS",)).sample("I_DS", time) for c in specimens()]
    )
    within = np.linspace(0, period, 201)
    aligned = [
        np.array([np.interp(within + k * period, time, c) for c in currents])
        for k in range(STIMULI)
    ]
    mean = currents.mean(axis=0)
    error = np.max(currents.std(axis=0, ddof=1) / np.sqrt(SPECIMENS) / mean)
    return Plot(
        name="periodic",
        caption=f"(a) I_DS under {STIMULI} stimuli of {LEVEL * 1e3:g} mN, mean of "
        "three specimens and, shaded, its standard error, at most "
        f"{100 * error:.1f} % ({TOLERANCES}); bands: holds. (b) The same, its time "
        "from the beginning of each stimulus: first, "
        "second and last, and the mean of all, its standard error that of the "
        "specimens' means: the fall from stimulus to stimulus is no scatter. What V_P "
        "loses during a stimulus it lacks in the next. The paper's stimuli are not "
        "given.",
        x_label="Time",
        x_unit="s",
        beside=True,
        letters=True,
        panels=(
            Panel(
                label="I_DS", unit="A", limits=(0, None),
                series=(_mean(time, currents, "I_DS", ""),),
                guides=tuple(
                    Guide(at=k * period + RAMP, to=k * period + RAMP + HOLD,
                          colour="band")
                    for k in range(STIMULI)
                ),
            ),
            Panel(
                label="I_DS", unit="A", limits=(0, None),
                series=(
                    _mean(within, aligned[0], "force", "first"),
                    _mean(within, aligned[1], "V_C2", "second"),
                    _mean(within, aligned[-1], "V_C1", "last"),
                    _mean(within, np.mean(aligned, axis=0), "ink", "mean"),
                ),
            ),
        ),
    )  # fmt: skip


def _mean(x: FloatArray, rows: FloatArray, colour: str, name: str) -> Series:
    """The mean of rows, and its standard error shaded."""
    mean = rows.mean(axis=0)
    error = rows.std(axis=0, ddof=1) / np.sqrt(len(rows))
    return Series(x=x, y=mean, low=mean - error, high=mean + error, colour=colour,
                  name=name)  # fmt: skip
