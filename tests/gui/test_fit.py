"""Fits of the steps so far beside the model: numbers from trains made to order."""

import numpy as np

from gui.lanes.decimate import Drawn
from gui.lanes.row import interval_text
from gui.review.finding import Finding, finding
from gui.review.fit import Beside, fit

HOLD = (0.0, 2.0)


def step(level: float, rate: float, number: int) -> Finding:
    """A step at `level` N that fires evenly at `rate` Hz from 0.1 s on."""
    times = np.arange(0.1, 2.0, 1 / rate) if rate else np.empty(0)
    label = f"{1e3 * level:.0f} mN"
    return finding(label, level, times, HOLD, 3.0 * number, 3.0 * number + 3.0)


STEPS = [step(0.08, 0, 0), step(0.12, 5, 1), step(0.16, 10, 2), step(0.2, 15, 3)]
TRAIN = np.concatenate([s.start + s.times for s in STEPS])


def seen(late: float = 0.0, off: float = 0.0) -> Beside:
    time = np.linspace(0, 12, 500)
    model = 4 + 0.5 * np.sin(time)
    both = (Drawn.line(time, model + off), Drawn.line(time, model))
    return Beside(TRAIN + late, TRAIN, {"V_C1": both})


def test_cards_tell_onset_slope_and_why_not() -> None:
    cards = {card.name: card for card in fit(STEPS, seen()).cards}
    assert cards["Onset"].value == "100 mN"
    assert "80 to 120 mN" in cards["Onset"].detail
    assert "model 100 mN" in cards["Onset"].detail
    assert cards["Slope of the peak rate"].value == "0.125 Hz/mN"
    assert cards["Adaptation 1/|β|"].value == "—", "an even train does not adapt"
    assert cards["Adaptation 1/|β|"].detail.endswith(".")


def test_first_steps_say_what_is_missing() -> None:
    cards = {card.name: card for card in fit(STEPS[:1], seen()).cards}
    assert cards["Onset"].value == "—" and "no force" in cards["Onset"].detail.lower()
    assert cards["Fall in the hold"].value == "—"
    assert fit([], seen()).cards == ()


def test_bars_measure_the_distance_to_the_model() -> None:
    bars = {bar.signal: bar for bar in fit(STEPS, seen(late=5e-3, off=0.01)).bars}
    assert bars["V_C1"].text == "1.0 %" and abs(bars["V_C1"].share - 0.1) < 0.01
    assert bars["spikes"].text == f"5.0 ms · {TRAIN.size} of {TRAIN.size}"
    assert abs(bars["spikes"].share - 0.25) < 0.01


def test_no_model_no_bars() -> None:
    alone = Beside(TRAIN, np.empty(0), {"V_C1": (Drawn.nothing(), Drawn.nothing())})
    found = fit(STEPS, alone)
    assert found.bars == () and found.model == ()
    assert "model" not in found.cards[0].detail


def test_silence_is_told_beside_the_last_interval() -> None:
    assert interval_text(np.array([1.0]), 2.0) == ""
    assert interval_text(np.array([1.0, 1.1]), 1.2) == "ISI 100.0 ms"
    assert interval_text(np.array([1.0, 1.1]), 3.1) == "ISI 100.0 ms · silent 2.0 s"
