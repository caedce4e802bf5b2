"""The plant's scope inputs: noise, hum, followers, coupling, wiring."""

import numpy as np
import pytest
from plant_world import (
    CHANNELS,
    FULL,
    IDEAL,
    QUIET,
    SHIFT,
    newtons,
    plant,
    render,
    volts,
)

from sim_backend.plant.options import PlantOptions
from tactile_lab.errors import ParameterError
from tactile_lab.scope import Channel


def test_a_follower_compresses_the_spike() -> None:
    channels = (CHANNELS[2],)
    peaks = []
    for options in (IDEAL, PlantOptions(bias=0, noise=QUIET, coil_lag=0, eddy_lag=0)):
        made = plant(options)
        made.set_current(0.01, newtons(0.2))
        render(made, 0.06, channels=channels, interval=1e-3)
        window = made.render(6_000_000, 4_000_000, 1e-8, 0.0, channels, FULL, SHIFT)[0]
        peaks.append(volts(window[0], channels[0]).max() / 3.213)
    assert peaks[0] > 0.97
    assert 0.76 < peaks[1] < 0.90


def test_noise_has_the_asked_deviation_and_no_pattern() -> None:
    options = PlantOptions(noise={"V_K": 0.1}, coil_lag=0.0, eddy_lag=0.0)
    codes = render(plant(options), 0.4, channels=(CHANNELS[2],), interval=1e-6, shift=0)
    noise = codes[0] / FULL * 5.0
    assert noise.std() == pytest.approx(0.1, rel=0.01)
    assert abs(noise.mean()) < 1e-3
    assert np.mean(np.abs(noise) > 0.3) == pytest.approx(0.0027, rel=0.2)
    spectrum = np.abs(np.fft.rfft(noise)) ** 2
    assert spectrum.max() < 20 * spectrum.mean()


def test_seed_input_and_start_select_the_noise() -> None:
    first = render(plant(seed=1), 0.01)
    assert np.array_equal(first, render(plant(seed=1), 0.01))
    assert not np.array_equal(first[2], render(plant(seed=2), 0.01)[2])
    later = render(plant(seed=1), 0.01, started=0.1)
    assert not np.array_equal(first[2], later[2])
    twice = (CHANNELS[2], Channel(signal="V_K", input="D", range=5.0))
    both = render(plant(), 0.01, channels=twice)
    assert not np.array_equal(both[0], both[1])


def test_over_range_is_flagged_and_clipped_per_channel() -> None:
    narrow = (
        Channel(signal="V_C1", input="A", range=2.0),
        Channel(signal="V_C2", input="B", range=2.0),
    )
    codes, over = plant(IDEAL).render(0, 100, 1e-5, 0.0, narrow, FULL, SHIFT)
    assert over == (True, False)
    assert np.all(codes[0] == FULL)


def test_the_shunt_and_an_analogue_teslameter_scale_by_their_channel() -> None:
    channels = (
        Channel(signal="coil_current", input="A", range=1.0, scale=2.0),
        Channel(signal="field", input="B", range=1.0, scale=0.02),
        Channel(signal="none", input="C", range=1.0),
    )
    made = plant(IDEAL)
    made.set_current(0.0, 0.5)
    codes = render(made, 0.01, channels=channels)
    assert codes[0, -1] / FULL == pytest.approx(0.25, abs=0.005)
    assert codes[1, -1] / FULL == pytest.approx(0.011 * 0.5 / 0.02, abs=0.005)
    assert not codes[2].any()


def test_hum_is_a_sine_of_the_mains() -> None:
    options = PlantOptions(noise=QUIET, hum=0.5, mains=60.0)
    channel = Channel(signal="none", input="A", range=1.0)
    codes = render(plant(options), 0.05, channels=(channel,), shift=0)
    time = np.arange(5000) * 1e-5
    expected = 0.5 * np.sin(2 * np.pi * 60 * time)
    assert codes[0] / FULL == pytest.approx(expected, abs=1e-4)


def test_wiring_faults() -> None:
    swapped = PlantOptions(
        follower=False, bias=0, noise=QUIET, wired={"A": "V_C2", "B": "V_C1"}
    )
    codes = render(plant(swapped), 1e-3)
    assert volts(codes[0], CHANNELS[0])[0] == pytest.approx(1.448, abs=0.01)
    divided = PlantOptions(follower=False, bias=0, noise=QUIET, attenuation={"B": 10})
    codes = render(plant(divided), 1e-3)
    seen = Channel(signal="V_C2", input="B", range=2.0)
    assert volts(codes[1], CHANNELS[1])[0] == pytest.approx(0.1448, abs=0.01)
    codes = render(plant(divided), 1e-3, channels=(seen,))
    assert volts(codes[0], seen)[0] == pytest.approx(0.1448, abs=0.01)
    loose = PlantOptions(noise=QUIET, open_inputs=("B",), pickup=0.1)
    codes = render(plant(loose), 0.02, channels=(seen,))
    assert abs(volts(codes[0], seen)).max() == pytest.approx(0.1, abs=0.02)
    inverted = plant(PlantOptions(inverted_coil=True))
    inverted.set_current(0.0, 0.5)
    assert inverted.coil_current(0.1) == pytest.approx(0.5)
    assert inverted.field(0.1) == pytest.approx(-0.0055)
    assert inverted.force(0.1) < 0


def test_a_drifting_scope_clock_moves_late_samples() -> None:
    options = PlantOptions(
        follower=False, bias=0, noise=QUIET, coil_lag=0, eddy_lag=0, drift=1e-3
    )
    made = plant(options)
    made.set_current(1.0, 1.0)
    codes = render(made, 1.2, channels=(CHANNELS[3],), interval=1e-4)
    assert np.flatnonzero(codes[0])[0] == pytest.approx(10_000 / 1.001, abs=1.5)


@pytest.mark.parametrize(
    "wrong",
    [
        {"noise": {"V_K": -1.0}},
        {"slew": 0.0},
        {"coil_lag": -1e-3},
        {"bias": float("nan")},
        {"attenuation": {"A": 0.0}},
        {"drift": 0.5},
    ],
)
def test_impossible_options_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ParameterError):
        PlantOptions(**wrong)  # type: ignore[arg-type]


def test_ac_coupling_holds_the_slow_part_back() -> None:
    coupled = (
        Channel(signal="V_C1", input="A", range=2.0, coupling="AC"),
        Channel(signal="coil_current", input="B", range=0.5, scale=10, coupling="AC"),
        Channel(signal="V_K", input="C", range=5.0, coupling="AC"),
    )
    made = plant(IDEAL)
    made.set_current(0.1, 1.0)
    codes = render(made, 1.0, channels=coupled, interval=1e-4, shift=0)
    assert not codes[0, :1000].any()
    current = codes[1] / FULL * 0.5 * 10
    time = np.arange(10_000) * 1e-4
    expected = np.where(time < 0.1, 0.0, np.exp(-2 * np.pi * np.maximum(time - 0.1, 0)))
    assert current == pytest.approx(expected, abs=0.01)
    sliced = plant(IDEAL)
    sliced.set_current(0.1, 1.0)
    parts, first = [], 0
    for n in (7, 993, 1, 1, 2998, 6000):
        parts.append(sliced.render(first, n, 1e-4, 0.0, coupled, FULL, 0)[0])
        first += n
    assert np.array_equal(np.concatenate(parts, axis=1), codes)


def test_a_long_ac_coupled_stream_forgets_and_goes_on() -> None:
    coupled = (Channel(signal="coil_current", input="A", range=0.5, coupling="AC"),)
    made, whole = plant(IDEAL), plant(IDEAL)
    parts = []
    for k in range(40):
        made.set_current(k * 0.1, 0.3 * (k % 2))
        parts.append(made.render(k * 100, 100, 1e-3, 0.0, coupled, FULL, 0)[0])
        whole.set_current(k * 0.1, 0.3 * (k % 2))
    expected = whole.render(0, 4000, 1e-3, 0.0, coupled, FULL, 0)[0]
    assert np.array_equal(np.concatenate(parts, axis=1), expected)


def test_the_reset_edge_passes_the_follower() -> None:
    channel = (Channel(signal="V_C2", input="B", range=2.0, offset=-1.7),)
    made = plant(PlantOptions(bias=0, noise=QUIET, coil_lag=0, eddy_lag=0))
    made.set_current(0.01, newtons(0.2))
    codes = np.concatenate(
        [
            made.render(k << 20, 1 << 20, 1e-8, 0.0, channel, FULL, 0)[0]
            for k in range(10)
        ],
        axis=1,
    )[0]
    potential = volts(codes, channel[0])
    top = int(np.flatnonzero(potential > 3.2)[-1])
    falling = np.diff(potential[top : top + 20]) / 1e-8
    assert falling[2:] == pytest.approx(np.full(17, -13e6), rel=0.01)
    assert potential[top + 100] == pytest.approx(0.0, abs=1e-3)


def test_a_drain_current_channel_has_the_users_gain() -> None:
    channel = (Channel(signal="I_DS", input="A", range=1.0, scale=50e-9),)
    codes = render(plant(IDEAL), 1e-3, channels=channel, shift=0)
    assert codes[0, 0] / FULL * 50e-9 == pytest.approx(24.69e-9, rel=1e-3)
