"""Two lags in a row, against the differential equations stepped finely."""

from itertools import pairwise

import numpy as np
import pytest

from tactile_lab.lag import FINE, Lag
from tactile_lab.waveform import Waveform


def stepped(lag, wave, end, step=2e-6):
    """The field by small steps; good to about `step` over the lag."""
    y = z = float(wave.value[0])
    times = np.arange(0.0, end, step)
    field = np.empty(times.size)
    for i, u in enumerate(wave.at(times + step / 2)):
        field[i] = z
        y = u if lag.coil == 0 else y + (u - y) * -np.expm1(-step / lag.coil)
        z = y if lag.eddy == 0 else z + (y - z) * -np.expm1(-step / lag.eddy)
    return times, field


STAIRS = Waveform.through(
    [(0, 0), (0.01, 0), (0.01, 0.5), (0.03, 0.5), (0.05, 1.0), (0.052, -0.2), (0.2, 0)]
)
AT = np.linspace(0.0, 0.2, 20001)


@pytest.mark.parametrize(
    "lag", [Lag(1.1e-3, 3e-3), Lag(3e-3, 1.1e-3), Lag(0, 3e-3), Lag(1.1e-3, 0)]
)
def test_ramps_and_steps_are_followed_as_the_equations_say(lag):
    found, _ = lag.follow(STAIRS)
    times, field = stepped(lag, STAIRS, 0.2)
    assert np.abs(found.at(times) - field).max() < 2e-3


@pytest.mark.parametrize(("lag", "later"), [(Lag(1e-3, 3e-3), 1e-3), (Lag(), 2e-3)])
def test_what_is_followed_later_is_what_a_longer_lag_follows(lag, later):
    longer = Lag(lag.coil, lag.eddy + later)
    found = lag.late(lag.follow(STAIRS)[0], later)
    assert np.abs(found.at(AT) - longer.follow(STAIRS)[0].at(AT)).max() < 4 * FINE
    turn, f = np.exp(2j * np.pi * 40 * AT), 40.0
    sine = Waveform(AT, turn.imag)
    settled = AT > 0.05
    one, other = (
        np.vdot(turn[settled], each.follow(sine)[0].at(AT[settled]))
        for each in (lag, longer)
    )
    assert lag.turned(f, later) == pytest.approx(other / one, abs=2e-3)


def test_lags_that_are_alike_are_told_by_their_sum():
    one, _ = Lag(2e-3, 2e-3).follow(STAIRS)
    times, field = stepped(Lag(2e-3, 2e-3), STAIRS, 0.2)
    assert np.abs(one.at(times) - field).max() < 3e-3


def test_slices_follow_as_the_whole_does():
    lag = Lag(1.1e-3, 3e-3)
    whole, after = lag.follow(STAIRS)
    state, ends = None, (0.0, 0.011, 0.04, 0.0515, 0.2)
    for start, end in pairwise(ends):
        inner = (STAIRS.time > start) & (STAIRS.time < end)
        time = np.concatenate([[start], STAIRS.time[inner], [end]])
        value = np.concatenate(
            [STAIRS.at([start]), STAIRS.value[inner], [STAIRS.at(end)]]
        )
        part, state = lag.follow(Waveform(time, value), state)
        at = np.linspace(start, end, 301)[:-1]
        assert np.abs(part.at(at) - whole.at(at)).max() < 2 * FINE
    assert state == pytest.approx(after, abs=1e-12)


@pytest.mark.parametrize("points", [1, 2, 7])
def test_a_long_wave_is_followed_in_pieces_as_at_once(points, monkeypatch):
    lag, steps = Lag(1.1e-3, 3e-3), np.arange(1, 40)
    stairs = Waveform.stairs(np.column_stack([steps * 0.01, np.sin(steps)]), 0.45)
    whole, after = lag.follow(stairs)
    monkeypatch.setattr("tactile_lab.lag.AT_ONCE", points)
    found, left = lag.follow(stairs)
    assert found == whole
    assert left == after
    pieces = list(lag.in_pieces(stairs))
    assert len(pieces) >= stairs.time.size // points - 1
    assert all(one.end == after.start for one, after in pairwise(pieces))
    assert sum(piece.time.size - 1 for piece in pieces) == whole.time.size - 1


def test_after_a_while_at_rest_there_is_exactly_nothing():
    push = Waveform.through([(0, 0), (0, 1), (0.5, 1), (0.5, 0), (1, 0)])
    found, after = Lag(1.1e-3, 3e-3).follow(push)
    assert after == (0.0, 0.0)
    assert found.value[-1] == 0.0
    assert found.time.size < 700  # solved and stored: 320 points a jump


def test_without_lag_the_wave_is_left_alone():
    assert Lag().follow(STAIRS)[0] is STAIRS


def test_a_lead_has_points_where_it_bends_and_nowhere_else():
    """100 s down and up at 100 Hz were 404,801 points, and their plan took 22 s."""
    lag, fine = Lag(1.1e-3, 3e-3), 5e-4
    time = np.linspace(0, 100, 65)
    slow = Waveform(time, 0.1 * (1 - np.cos(np.pi * time / 100)))
    lead = lag.led(slow, fine)
    assert lead.time.size < 20 * time.size
    given, _ = lag.follow(lead)
    at = np.linspace(1, 99, 5000)
    assert given.at(at) == pytest.approx(slow.at(at), abs=1e-6)


@pytest.mark.parametrize("step", [1.0, 0.1, 0.02])
@pytest.mark.parametrize(
    "lag", [Lag(1.1e-3, 3e-3), Lag(3e-3, 1.1e-3), Lag(0, 3e-3), Lag(1.1e-3, 0)]
)
def test_a_step_comes_no_later_than_its_lags(lag, step):
    """By the area: chords alone let one of 2 % of the peak come 15 us late."""
    wave = Waveform.through([(0, 1 - step), (0.1, 1 - step), (0.1, 1.0), (0.5, 1.0)])
    found, _ = lag.follow(wave)
    since = found.time >= 0.1
    missing = np.trapezoid(1 - found.value[since], found.time[since]) / step
    assert abs(missing - lag.coil - lag.eddy) < lag.drawn / 10
