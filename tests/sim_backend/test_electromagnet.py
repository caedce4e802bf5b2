"""Coil current and field follow the set-point through two lags and the core's loop."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sim_backend.plant.electromagnet import Electromagnet
from sim_backend.plant.step_response import ACCURACY
from sim_backend.plant.winding import Winding
from tactile_lab.errors import ParameterError

COIL, EDDY = 1.1e-3, 3e-3


def exact(commands: list[tuple[float, float]], times: np.ndarray) -> np.ndarray:
    """Current and effective current at `times` by a general solver."""

    def slope(t: float, y: np.ndarray) -> list[float]:
        target = next((a for when, a in reversed(commands) if when <= t), 0.0)
        return [(target - y[0]) / COIL, (y[0] - y[1]) / EDDY]

    state, start, found = [0.0, 0.0], 0.0, []
    ends = [when for when, _ in commands[1:]] + [float(times[-1]) + 1e-9]
    for end in ends:
        inside = times[(times >= start) & (times < end)]
        answer = solve_ivp(
            slope, (start, end), state, t_eval=[*inside, end], rtol=1e-10, atol=1e-12
        )
        found.append(answer.y[:, : inside.size])
        state, start = list(answer.y[:, -1]), end
    return np.concatenate(found, axis=1)


@pytest.mark.parametrize(("spacing", "part"), [(0.1, 1), (21e-3, 1.05), (5e-3, 2)])
def test_pieces_stay_within_a_ten_thousandth_of_the_step(
    spacing: float, part: float
) -> None:
    commands = [(k * spacing, 0.1 * (k + 1)) for k in range(4)]
    magnet = Electromagnet(coil_lag=COIL, eddy_lag=EDDY)
    for when, target in commands:
        magnet.command(when, target)
    times = np.linspace(0, 4 * spacing, 1201)[:-1]
    current, field = exact(commands, times)
    flowing = np.array([magnet.current(t) for t in times])
    assert np.max(np.abs(flowing - current)) < 0.1 * ACCURACY * part
    lagged = np.array([magnet.effective(t) for t in times])
    assert np.max(np.abs(lagged - field)) < 0.1 * ACCURACY * part


def test_a_few_knots_per_lag_are_enough() -> None:
    magnet = Electromagnet(coil_lag=COIL, eddy_lag=EDDY)
    magnet.command(0.0, 1.0)
    assert magnet.effectives(0.0, 1.0).start.size < 100


def test_pieces_come_no_later_than_the_field() -> None:
    """By the area that they leave: chords alone came 0.9 us late.

    Over with 5e-5 of the step left they came 0.3 us early.
    """
    magnet = Electromagnet(coil_lag=COIL, eddy_lag=EDDY)
    magnet.command(0.0, 1.0)
    for found, lag in (
        (magnet.effectives(0.0, 1.0), COIL + EDDY),
        (magnet.currents(0.0, 1.0), COIL),
    ):
        late = np.trapezoid(1 - found.value, found.start) - lag
        assert abs(late) < 1e-7


def test_current_and_field_are_continuous_when_commands_come() -> None:
    magnet = Electromagnet()
    magnet.command(0.010, 1.0)
    magnet.command(0.0113, -1.0)
    for when in (0.010, 0.0113):
        assert magnet.current(when) == pytest.approx(
            magnet.current(when - 1e-9), abs=1e-5
        )
        assert magnet.effective(when) == pytest.approx(
            magnet.effective(when - 1e-9), abs=1e-5
        )


def test_without_lags_the_field_jumps() -> None:
    magnet = Electromagnet(coil_lag=0.0, eddy_lag=0.0)
    magnet.command(1.0, 0.5)
    assert magnet.effective(1.0 - 1e-9) == 0.0
    assert magnet.effective(1.0) == 0.5
    assert magnet.current(1.0) == 0.5


def test_equal_lags_are_no_special_case() -> None:
    magnet = Electromagnet(coil_lag=2e-3, eddy_lag=2e-3)
    magnet.command(0.0, 1.0)
    x = 1.5
    assert magnet.effective(x * 2e-3) == pytest.approx(
        1 - (1 + x) * np.exp(-x), abs=2e-4
    )


def test_a_command_back_in_time_takes_effect_with_the_last_one() -> None:
    magnet = Electromagnet(coil_lag=0.0, eddy_lag=0.0)
    magnet.command(2.0, 0.5)
    magnet.command(1.0, 0.7)
    assert magnet.current(1.5) == 0.0
    assert magnet.current(2.0) == 0.7


def test_repeating_a_set_point_changes_nothing() -> None:
    magnet = Electromagnet()
    assert magnet.command(1.0, 0.5)
    assert not magnet.command(1.001, 0.5)
    assert magnet.commands == 2


def sweep(magnet: Electromagnet, levels: list[float]) -> list[float]:
    """Effective current after settling on each level in turn."""
    settled = []
    for level in levels:
        when = magnet.last_command + 1.0
        magnet.command(when, level)
        settled.append(magnet.effective(when + 1.0))
    return settled


def test_hysteresis_opens_a_loop_of_its_width_and_leaves_remanence() -> None:
    width = 0.05
    magnet = Electromagnet(hysteresis=width)
    up = np.linspace(-1, 1, 21)
    sweep(magnet, [1.0, -1.0])
    rising = sweep(magnet, list(up))
    falling = sweep(magnet, list(up[::-1]))[::-1]
    assert rising[10] == pytest.approx(-width, rel=0.02)
    assert falling[10] == pytest.approx(width, rel=0.02)
    # both branches leave their turning points along the virgin curve, then run parallel
    middle = slice(4, 17)
    gap = np.array(falling[middle]) - rising[middle]
    assert gap == pytest.approx(np.full(13, 2 * width), rel=0.02)


def test_decaying_alternation_demagnetises_the_core() -> None:
    magnet = Electromagnet(hysteresis=0.05)
    sweep(magnet, [1.0, 0.0])
    assert magnet.effective(magnet.last_command + 0.5) > 0.04
    cycles = [sign * 0.88**k for k in range(45) for sign in (1.0, -1.0)]
    remaining = sweep(magnet, [*cycles, 0.0])[-1]
    assert abs(remaining) < 0.003


@pytest.mark.parametrize("lags", [(COIL, EDDY), (0.0, EDDY), (COIL, 0.0), (0.0, 0.0)])
def test_hysteresis_through_the_lags_equals_small_steps(
    lags: tuple[float, float],
) -> None:
    magnet = Electromagnet(coil_lag=lags[0], eddy_lag=lags[1], hysteresis=0.05)
    commands = [(0.01, 0.3), (0.0115, -0.2), (0.05, 0.1)]
    for when, target in commands:
        magnet.command(when, target)
    step = 4e-6
    radius = 2 * 0.05 * (np.arange(8) + 0.5) / 8
    plays, current, field, worst = np.zeros(8), 0.0, 0.0, 0.0
    for k in range(20_000):
        t = k * step
        worst = max(worst, abs(field - magnet.effective(t))) if k % 20 == 0 else worst
        target = next(
            (a for when, a in reversed(commands) if when <= t + step / 2), 0.0
        )
        share = -np.expm1(-step / lags[0]) if lags[0] else 1.0
        current += (target - current) * share
        plays = np.clip(plays, current - radius, current + radius)
        share = -np.expm1(-step / lags[1]) if lags[1] else 1.0
        field += (plays.mean() - field) * share
    # explicit steps lag by half a step; jumps are compared a step late
    assert worst < (0.5 if lags == (0.0, 0.0) else 2e-3)
    assert magnet.effective(0.08) == pytest.approx(plays.mean(), abs=1e-4)


def test_the_winding_heats_and_its_resistance_tells() -> None:
    magnet = Electromagnet()
    magnet.command(0.0, 1.0)
    assert magnet.temperature(1.0) == pytest.approx(1.28, rel=0.1)
    assert magnet.resistance(40.0) > magnet.resistance(1.0) > 4.9
    assert magnet.voltage(1.0) == pytest.approx(magnet.resistance(1.0), rel=1e-6)
    long = magnet.temperature(3000.0)
    assert 60 < long < 110
    magnet.command(3000.0, 0.0)
    assert magnet.temperature(20_000.0) < 1.0


def test_voltage_of_a_step_drives_the_inductance() -> None:
    magnet = Electromagnet()
    magnet.command(1.0, 1.0)
    assert magnet.voltage(1.0) == pytest.approx(4.9, rel=1e-3)
    assert magnet.current(1.0) == 0.0


def test_forgotten_commands_do_not_change_what_follows() -> None:
    magnet = Electromagnet()
    for k in range(10):
        magnet.command(k * 0.01, 0.1 * k)
    before = magnet.effective(0.095)
    magnet.forget(5)
    assert magnet.commands == 5
    assert magnet.effective(0.095) == before


def test_a_winding_without_contact_to_the_core_heats_adiabatically() -> None:
    lonely = Winding(contact=1e-6)
    magnet = Electromagnet(winding=lonely)
    magnet.command(0.0, 2.0)
    # 10 s at 2 A: 60 K, as the I^2 t budget of 42 A^2 s says
    assert magnet.temperature(10.0) == pytest.approx(60, rel=0.1)
    assert magnet.resistance(10.0) / 4.9 == pytest.approx(1.24, abs=0.03)


@pytest.mark.parametrize("wrong", [{"resistance": 0.0}, {"loss": float("nan")}])
def test_an_impossible_winding_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ParameterError):
        Winding(**wrong)
