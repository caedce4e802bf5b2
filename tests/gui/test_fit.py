"""Fits of the steps so far beside the model: numbers from trains made to order."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QRect, Qt
from PySide6.QtWidgets import QLabel

from gui.lanes.readings import interval_text
from gui.plots.numbers import unbroken
from gui.review.fit_view import FitCards, TwinBars
from gui.review.live_plots import train_plot
from gui.session.fit import FitInput, fit
from gui.session.steps import facts_of
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.trace import Trace

HOLD = (0.0, 2.0)


def step(level: float, rate: float, number: int) -> MeasuredTrial:
    """A step at `level` N that fires evenly at `rate` Hz from 0.1 s on."""
    times = np.arange(0.1, 2.0, 1 / rate) if rate else np.empty(0)
    label = f"{1e3 * level:.0f} mN"
    return MeasuredTrial(
        label=label,
        level=level,
        start=3.0 * number,
        duration=3.0,
        spike_times=times,
        hold=HOLD,
    )


STEPS = [step(0.08, 0, 0), step(0.12, 5, 1), step(0.16, 10, 2), step(0.2, 15, 3)]
TRAIN = np.concatenate([s.start + s.spike_times for s in STEPS])


def seen(late: float = 0.0, off: float = 0.0) -> FitInput:
    time = np.linspace(0, 12, 500)
    model = 4 + 0.5 * np.sin(time)
    both = (Trace.line(time, model + off), Trace.line(time, model))
    return FitInput(TRAIN + late, TRAIN, {"V_C1": both})


def test_cards_tell_onset_slope_and_why_not() -> None:
    cards = {card.name: card for card in fit(STEPS, seen()).cards}
    assert cards["Onset"].value == "100 mN"
    assert "80 to 120 mN" in cards["Onset"].detail
    assert cards["Onset"].model == "model 100 mN"
    assert cards["Slope of the peak rate"].value == "0.125 Hz/mN"
    assert cards["Adaptation 1/|β|"].value == "—", "an even train does not adapt"
    assert cards["Adaptation 1/|β|"].detail.endswith(".")


def test_the_onset_of_pulls_is_told_with_the_true_minus() -> None:
    pulls = [replace(one, level=-(one.level or 0.0)) for one in STEPS]
    card = next(card for card in fit(pulls, seen()).cards if card.name == "Onset")
    assert (card.value, card.detail) == ("−100 mN", "−80 to −120 mN")


def test_the_ends_of_an_interval_are_told_apart_and_where_it_is_in_words() -> None:
    """10.8 s stood above "11 to 11 s", and 10 % above "at in 8 ms"."""
    phases = np.arange(1.0, 250.0)
    time = np.linspace(0.0, 60.0, 600_001)
    rate = 11.4 * np.exp(-time / 11.0) + 2.8
    whole = np.concatenate([[0.0], np.cumsum(rate[:-1] * np.diff(time))])
    train = np.interp(phases[phases < whole[-1]], whole, time)
    held = replace(STEPS[3], spike_times=train, hold=(0.0, 60.0), label="in 8 ms")
    cards = {card.name: card for card in fit([held], seen()).cards}
    low, high = re.findall(r"[\d.]+(?= to )|(?<= to )[\d.]+", (
        cards["Adaptation 1/|β|"].detail
    ))  # fmt: skip
    assert low != high and cards["Adaptation 1/|β|"].detail.endswith(" s in 8 ms")
    assert cards["Fall in the hold"].detail == "in 8 ms"
    cards = {
        card.name: card for card in fit([replace(held, label="50 mN")], seen()).cards
    }
    assert cards["Fall in the hold"].detail == "at 50 mN"


def test_first_steps_say_what_is_missing() -> None:
    cards = {card.name: card for card in fit(STEPS[:1], seen()).cards}
    assert cards["Onset"].value == "—"
    for name in ("Onset", "Adaptation 1/|β|"):  # it may stand beside one that fired
        assert cards[name].detail == "No step that ended has fired."
    assert cards["Fall in the hold"].value == "—"
    assert fit([], seen()).cards == ()


def test_bars_measure_the_distance_to_the_model() -> None:
    bars = {bar.signal: bar for bar in fit(STEPS, seen(late=5e-3, off=0.01)).bars}
    assert bars["V_C1"].text == "1.0 %" and abs(bars["V_C1"].share - 0.1) < 0.01
    assert bars["spikes"].text == f"5.0 ms · {TRAIN.size} of {TRAIN.size}"
    assert abs(bars["spikes"].share - 0.25) < 0.01


def test_no_model_no_bars() -> None:
    alone = FitInput(TRAIN, np.empty(0), {"V_C1": (Trace.nothing(), Trace.nothing())})
    found = fit(STEPS, alone)
    assert found.bars == () and found.model == ()
    assert found.cards[0].model == ""


def test_silence_is_told_beside_the_last_interval() -> None:
    assert interval_text(np.array([1.0]), 2.0) == ""
    assert interval_text(np.array([1.0, 1.1]), 1.2) == "ISI 100.0 ms"
    assert interval_text(np.array([1.0, 1.1]), 3.1) == "ISI 100.0 ms · silent 2.0 s"


def test_a_number_is_never_parted_from_its_unit() -> None:
    assert unbroken("model 100 mN") == "model 100\u00a0mN"
    assert unbroken("± 0.014") == "±\u00a00.014"
    assert unbroken("4 intervals in the hold") == "4 intervals in the hold"
    parts = re.split(r"[ \n]", unbroken("0.127 Hz/mN at 80 mN, 22 % of 7.4 s"))
    assert [part.replace("\u2060", "").replace("\u00a0", " ") for part in parts] == [
        "0.127 Hz/mN", "at", "80 mN,", "22 %", "of", "7.4 s",
    ]  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 4])
def test_small_lines_of_cards_fit_two_lines_in_the_narrowest_panel(lab, count) -> None:
    cards = FitCards()
    lab.window.theme.dress(cards)
    cards.setFixedWidth(336 - 28)
    cards.show_cards(fit(STEPS[:count], seen()).cards)
    cards.show()
    lab.app.processEvents()
    small = [one for one in cards.findChildren(QLabel) if one.wordWrap()]
    assert len(small) == 4
    for one in small:
        room = QRect(0, 0, one.width(), 1000)
        wrap = Qt.TextFlag.TextWordWrap
        needed = one.fontMetrics().boundingRect(room, wrap, one.text())
        assert needed.height() <= 2 * one.fontMetrics().lineSpacing(), one.text()
        assert needed.width() <= one.width(), one.text()
    cards.close()


def test_bars_are_named_as_the_lanes_are(lab) -> None:
    bars = TwinBars(lab.window.theme)
    bars.show_bars(fit(STEPS, seen()).bars)
    texts = [one.text() for one in bars.findChildren(QLabel)]
    assert "V<sub>C1</sub>" in texts and "Spikes" in texts
    assert "V_C1" in bars.accessibleName()
    bars.close()


def test_a_stored_run_that_ended_early_says_why():
    info = {"reason": "OSError: <usb> gone", "coil": "Output off, 0 A read back."}
    source = SimpleNamespace(
        path=Path("runs/one"), simulated=False, info=info, sampled=True
    )
    assert "<br>OSError: &lt;usb&gt; gone<br>Output off" in facts_of(source)
    assert "None" not in facts_of(SimpleNamespace(**{**vars(source), "info": {}}))


def adapting(number: int) -> MeasuredTrial:
    """12 s of 20 exp(-t/3) + 5 Hz, from 0.5 s on."""
    time = np.linspace(0, 12, 200_000)
    passed = 60 * (1 - np.exp(-time / 3)) + 5 * time
    times = 0.5 + np.interp(np.arange(0.5, passed[-1]), passed, time)
    return replace(step(0.2, 0, number), spike_times=times, hold=(0.5, 12.5))


def test_the_fitted_rate_is_drawn_in_the_lane_and_over_the_steps() -> None:
    trial = adapting(2)
    found = fit([trial], seen())
    (law,) = (one.law for one in found.rates)
    since = law.time - trial.start - 0.5
    assert np.allclose(law.mean, 20 * np.exp(-since / 3) + 5, rtol=0.01)
    plot = train_plot([STEPS[1], trial], found.rates)
    dots = [s for s in plot.panels[0].series if s.mark == "dots"]
    assert [s.name for s in dots] == ["200 mN", "120 mN"], "the newest first"
    (dashed,) = (s for s in plot.panels[0].series if s.mark == "dashed")
    assert np.allclose(dashed.x, since)
    assert np.allclose(np.interp(dots[0].x, dashed.x, dashed.y), dots[0].y, rtol=0.05)
    assert train_plot([STEPS[0]]) is None, "none has fired"


def test_a_step_that_was_cut_short_says_nothing_of_the_onset() -> None:
    """STOP before it fired: "160 mN silent though 120 mN fired: not at rest"."""
    cut = replace(STEPS[2], spike_times=np.empty(0), complete=False)
    told = fit([*STEPS[:2], cut], seen()).cards
    assert told == fit(STEPS[:2], seen()).cards, "as it was told before STOP"
    assert told[0].detail == "80 to 120 mN"
    alone = fit([cut], seen())
    assert {(card.value, card.detail) for card in alone.cards} == {
        ("—", "No step was completed: nothing is concluded.")
    }
    fired = replace(STEPS[3], complete=False)
    assert fit([fired], seen()).cards == alone.cards, "nor does the report conclude"
    assert fit([fired], seen()).model, "it is drawn all the same"
