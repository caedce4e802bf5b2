import numpy as np
import pytest

from tactile_lab.analysis.converter import step_bias
from tactile_lab.analysis.response import gain
from tactile_lab.errors import NotIdentifiableError

TIME = np.arange(0, 12, 0.01)


def test_it_finds_gain_and_phase_on_a_drift():
    wave = 2 * np.pi * 0.5 * TIME
    cause = 0.05 * np.sin(wave + 0.3)
    rng = np.random.default_rng(0)
    answer = 4.3 + 0.01 * TIME + 0.12 * np.sin(wave + 0.3 - 0.7)
    found = gain(TIME, cause, answer + rng.normal(0, 0.005, TIME.size), 0.5)
    assert found.gain.low < 2.4 < found.gain.high
    assert found.phase.low < -0.7 < found.phase.high
    assert 0 < found.gain.error < 0.01
    assert found.phase.half < 0.01


def test_its_intervals_hold_under_harmonics_noise_and_converter_steps():
    held = np.zeros(2)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        time, code = np.arange(0, 20, 0.02), 0.04
        wave = 2 * np.pi * 0.1 * time
        answer = 0.12 * np.sin(wave - 0.7) + 0.02 * np.sin(2 * wave) + rng.uniform()
        samples = answer[:, None] + rng.normal(0, 5e-3, (time.size, 50))
        seen = (code * np.rint(samples / code)).mean(axis=1)
        bias = step_bias(seen, code, 50)
        found = gain(time, 0.05 * np.sin(wave), seen, 0.1, bias)
        held += (
            found.gain.low < 2.4 < found.gain.high,
            found.phase.low < -0.7 < found.phase.high,
        )
    assert np.all(held >= 36), "8 bits without enough noise shift gain and phase"
    assert found.gain.half < 0.12


@pytest.mark.parametrize("phase", [0.0, 0.8])
def test_its_intervals_hold_where_a_cycle_and_a_half_are_left(phase):
    """Drift and leak leave a cosine less certain than a sine: 15 and 16 of 20 held."""
    rng, time, held, n = np.random.default_rng(0), np.arange(0, 15, 0.05), 0, 100
    wave = 2 * np.pi * 0.1 * time + phase
    for _ in range(n):
        answer = 0.12 * np.sin(wave - 0.7) + rng.normal(0, 5e-3, time.size)
        found = gain(time, 0.05 * np.sin(wave), answer, 0.1, leak=8.7)
        held += np.array(
            [
                found.gain.low < 2.4 < found.gain.high,
                found.phase.low < -0.7 < found.phase.high,
            ]
        )
    assert np.all(held >= 0.9 * n), held / n


def test_steps_that_noise_smooths_in_part_stand_in_the_interval():
    """A sine less than a code high, with noise of 0.3 codes: a sweep with a bias."""
    rng, time, code, right, n = (
        np.random.default_rng(6),
        np.arange(0, 150, 0.1),
        1.0,
        0,
        60,
    )
    wave = 2 * np.pi * 0.02 * time
    for middle in rng.uniform(0, 1, n):
        samples = (middle + 0.9 * np.sin(wave))[:, None] + rng.normal(
            0, 0.3, (time.size, 100)
        )
        seen = (code * np.rint(samples / code)).mean(axis=1)
        bias = step_bias(seen, code, 100)
        found = gain(time, np.sin(wave), seen, 0.02, bias, code)
        right += found.gain.low <= 0.9 <= found.gain.high
    assert right >= 0.95 * n


def test_steps_of_the_source_are_no_scatter():
    """A source that is set 22 times a second gives a sine in stairs."""
    steps = np.floor(TIME * 22) / 22
    cause = 0.05 * np.sin(2 * np.pi * 0.5 * steps)
    rng = np.random.default_rng(1)
    answer = 2.4 * cause + rng.normal(0, 1e-3, TIME.size)
    found = gain(TIME, cause, answer, 0.5)
    assert found.gain.low < 2.4 < found.gain.high
    assert found.gain.half < 0.003


def test_a_force_that_comes_late_onto_its_sine_turns_no_phase():
    """What a coil does in its first 70 ms was taken for a transient of the film."""
    step, f, tau = 0.01, 0.05, 8.69
    time = np.arange(0, 40, step)
    angle = np.arctan(1 / (2 * np.pi * f * tau))
    begins = np.pi / 2 - angle  # there the settled film is at its most
    cause = 0.05 * np.sin(2 * np.pi * f * time + begins)
    film = 0.05 * np.cos(angle) * np.sin(2 * np.pi * f * time + begins + angle)
    late = time < 0.07
    cause[late] *= time[late] / 0.07
    film[late] *= time[late] / 0.07
    found = gain(time, cause, film, f, leak=tau)
    assert found.phase.value == pytest.approx(angle, abs=2e-4)
    assert found.gain.value == pytest.approx(np.cos(angle), rel=2e-4)


def test_a_cause_that_scatters_is_on_its_sine_from_its_begin():
    """Of many points a few lie three times as far off as usual, anywhere."""
    time, f = np.arange(0, 200, 0.01), 0.01
    sine = np.sin(2 * np.pi * f * time)
    cause = sine + np.random.default_rng(1).normal(0, 1e-3, time.size)
    found = gain(time, cause, 2 * sine, f)
    assert found.gain.value == pytest.approx(2.0, rel=1e-3)


def test_a_pattern_of_codes_is_no_scatter_of_the_phase():
    time, code = np.arange(0, 40, 0.01), 16e-3
    wave = 2 * np.pi * 0.05 * time
    answer = 0.11 * np.sin(wave - 0.7)
    rng = np.random.default_rng(3)
    seen = answer + 0.6e-3 * np.sin(2 * np.pi * answer / code)
    seen += rng.normal(0, 0.6e-3, time.size)
    halves = [
        gain(time, 0.05 * np.sin(wave), seen, 0.05, 0.6e-3, known).phase.half
        for known in (None, code)
    ]
    found = gain(time, 0.05 * np.sin(wave), seen, 0.05, 0.6e-3, code)
    assert halves[1] < halves[0] / 1.5
    assert found.phase.low < -0.7 < found.phase.high


def test_too_little_is_refused():
    for n in (0, 5, 50, 260):  # of 0.5 Hz: 1.3 cycles
        cut = TIME[:n]
        with pytest.raises(NotIdentifiableError, match=r"too few: 1\.4 cycles and 12"):
            gain(cut, np.sin(np.pi * cut), np.sin(np.pi * cut - 0.7), 0.5)
    with pytest.raises(NotIdentifiableError, match="no cause"):
        gain(TIME, np.zeros_like(TIME), np.sin(TIME), 0.5)


@pytest.mark.parametrize("mains", [49.93, 50.0, 60.0])
def test_a_hum_far_from_the_sine_is_no_scatter(mains):
    """It counted as white noise: the intervals were 17 times too wide."""
    time, f, n = np.arange(0, 7.5, 0.0091), 0.4, 30
    wave = 2 * np.pi * f * time
    off, half = np.empty((2, n)), np.empty((2, n))
    for seed in range(n):
        rng = np.random.default_rng(seed)
        hum = 14e-3 * np.sin(2 * np.pi * mains * time + rng.uniform(0, 2 * np.pi))
        answer = 0.12 * np.sin(wave - 0.7) + hum + rng.normal(0, 0.8e-3, time.size)
        found = gain(time, 0.05 * np.sin(wave), answer, f)
        off[:, seed] = found.gain.value - 2.4, found.phase.value + 0.7
        half[:, seed] = found.gain.half, found.phase.half
    assert np.all(half < 3 * off.std(axis=1, keepdims=True))
    assert np.all((np.abs(off) < half).mean(axis=1) >= 0.9)


def test_slow_noise_stays_in_the_interval():
    """What is slower than the bins are is no hum."""
    time, f, n = np.arange(0, 7.5, 0.0091), 0.4, 30
    wave, off, half = 2 * np.pi * f * time, np.empty(n), np.empty(n)
    for seed in range(n):
        noise = np.random.default_rng(seed).normal(0, 1e-3, time.size + 200)
        slow = np.convolve(noise, np.exp(-np.arange(200) / 3), "valid")[: time.size]
        found = gain(time, 0.05 * np.sin(wave), 0.12 * np.sin(wave) + slow, f)
        off[seed], half[seed] = found.gain.value - 2.4, found.gain.half
    assert np.mean(half) > 1.5 * np.std(off)


def test_codes_turn_the_phase_of_an_answer_in_stairs():
    """A source that is set 22 times a second makes stairs of 1 Hz, whose way up has
    other levels than its way down: three codes high, its phase held in 45 of 60."""
    time, f, code, n = np.arange(0, 2, 0.0139), 1.0, 0.04, 60
    rng, held, half = np.random.default_rng(4), np.zeros(2), []
    for middle, begin in rng.uniform(0, 1, (n, 2)):
        steps = (np.floor(time * 22 + begin) - begin) / 22
        cause = 0.05 * np.sin(2 * np.pi * f * steps)
        answer = code * middle + 2.4 * cause
        samples = answer[:, None] + rng.normal(0, 5e-3, (time.size, 139))
        codes = code * np.rint(samples / code)
        seen, extent = codes.mean(axis=1), np.ptp(codes, axis=1)
        bias = step_bias(seen, code, 139, extent)
        found = gain(time, cause, seen, f, bias, code)
        held += (
            found.gain.low < 2.4 < found.gain.high,
            found.phase.low < 0 < found.phase.high,
        )
        half.append(found.phase.half)
    assert np.all(held >= 0.93 * n), held
    assert np.median(half) < 0.04
