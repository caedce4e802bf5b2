"""What the plant shows depends on commands, never on how it is read."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_world import (
    CHANNELS,
    FULL,
    IDEAL,
    MAGNET,
    QUIET,
    SHARP,
    SHIFT,
    newtons,
    plant,
    render,
    volts,
)

from sim_backend.plant.options import PlantOptions
from sim_backend.plant.plant import Plant
from tactile_lab.errors import ParameterError
from tactile_lab.model import advance
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.scope import Channel
from tactile_lab.waveform import Waveform


@settings(max_examples=15)
@given(
    sizes=st.lists(st.integers(1, 30_000), min_size=1, max_size=40),
    seed=st.integers(0, 5),
    interval=st.sampled_from([1e-6, 1.28e-7 * 20, 1e-5]),
    late=st.booleans(),
)
def test_block_edges_change_no_code(
    sizes: list[int], seed: int, interval: float, late: bool
) -> None:
    """Whatever the blocks, and whether commands are known early or just in time."""
    options = PlantOptions(hum=0.01, coil_lag=0.0, eddy_lag=0.0, offset=3e-3)
    total = min(sum(sizes), 120_000)
    commands = [(0.013 * k, newtons(0.07 * k)) for k in range(1, 4)]
    whole = plant(options, seed)
    for when, target in commands:
        whole.set_current(when, target)
    expected, flags = whole.render(0, total, interval, 0.0, CHANNELS, FULL, SHIFT)
    sliced = plant(options, seed)
    waiting = list(commands)
    if not late:
        while waiting:
            sliced.set_current(*waiting.pop(0))
    first, parts, over = 0, [], np.zeros(4, dtype=bool)
    for size in sizes:
        n = min(size, total - first)
        if n <= 0:
            break
        while waiting and waiting[0][0] < (first + n) * interval:
            sliced.set_current(*waiting.pop(0))
        codes, flag = sliced.render(first, n, interval, 0.0, CHANNELS, FULL, SHIFT)
        parts.append(codes)
        over |= flag
        first += n
    assert np.array_equal(np.concatenate(parts, axis=1), expected)
    assert tuple(over) == flags


@pytest.mark.parametrize(
    "options",
    [
        PlantOptions(),
        PlantOptions(hysteresis=0.05, attraction=0.01, offset=3e-3, hum=5e-3),
        PlantOptions(inverted_coil=True, drift=50e-6, eddy_lag=0.0),
        PlantOptions(coil_lag=0.0, follower=False, open_inputs=("B",)),
    ],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_block_edges_change_no_code_whatever_is_simulated(
    options: PlantOptions, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0, 0.06, 6))
    levels = newtons(0.3) * rng.uniform(-0.3, 1.0, 6)
    whole, sliced = plant(options), plant(options)
    for when, target in zip(times, levels, strict=True):
        whole.set_current(float(when), float(target))
    expected = render(whole, 0.08)
    first, parts, j = 0, [], 0
    while first < 8000:
        n = min(int(rng.integers(1, 700)), 8000 - first)
        # a command is heard of in the block before it takes effect, or in that one
        while j < 6 and times[j] < (first + n) * 1e-5 + rng.uniform(0, 0.01):
            sliced.set_current(float(times[j]), float(levels[j]))
            j += 1
        parts.append(sliced.render(first, n, 1e-5, 0.0, CHANNELS, FULL, SHIFT)[0])
        first += n
    assert np.array_equal(np.concatenate(parts, axis=1), expected)


def test_a_late_command_does_not_change_what_was_shown() -> None:
    made = plant(IDEAL)
    shown = render(made, 0.02)
    made.set_current(0.005, 1.0)
    again = render(made, 0.03)
    assert np.array_equal(again[:, :2000], shown)
    assert not again[3, :2000].any()
    assert np.all(again[3, 2000:] == round(0.1 / 0.2 * 127) * 256)


def test_only_what_a_channel_depends_on_is_solved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stages: list[dict[str, int]] = []
    real = advance.advance

    def counted(*args: object, **options: object) -> object:
        solved = real(*args, **options)  # type: ignore[arg-type]
        stages.append(solved.stages)
        return solved

    monkeypatch.setattr(advance, "advance", counted)
    render(plant(IDEAL), 0.01, channels=(CHANNELS[3],))
    assert not stages
    made = plant(IDEAL)
    made.set_current(0.001, newtons(0.2))
    render(made, 0.01, channels=(CHANNELS[0],))
    assert stages and not any(s.get("V_C2") or s.get("spikes") for s in stages)
    stages.clear()
    made.render(1000, 1000, 1e-5, 0.0, CHANNELS, FULL, SHIFT)
    assert any(s.get("V_C2") or s.get("spikes") for s in stages)


def test_a_stage_first_needed_later_starts_from_equilibrium() -> None:
    made = plant(IDEAL)
    render(made, 0.2, channels=(CHANNELS[0],))
    codes = made.render(20_000, 1000, 1e-5, 0.0, CHANNELS, FULL, SHIFT)[0]
    assert np.array_equal(codes[1], render(plant(IDEAL), 0.21)[1, 20_000:])


def test_a_backlog_of_commands_is_worked_off(monkeypatch: pytest.MonkeyPatch) -> None:
    codes = []
    for backlog in (16, 4096):
        monkeypatch.setattr("sim_backend.plant.plant.BACKLOG", backlog)
        made = plant(IDEAL)
        for k in range(50):
            made.set_current(k * 0.01, newtons(0.1 * (k % 3)))
        codes.append(made.render(0, 200, 1e-3, 0.5, CHANNELS, FULL, SHIFT)[0])
    assert np.array_equal(codes[0][0], codes[1][0])
    assert np.array_equal(codes[0][3], codes[1][3])


def test_a_circuit_that_no_scope_looks_at_is_never_solved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sim_backend.plant.plant.BACKLOG", 16)
    made = Plant(Circuit(), MAGNET, SHARP, sampled=False)
    made.output(0.0, True)
    for k in range(50):
        made.set_current(k * 0.01, newtons(0.1 * (k % 3)))
    assert made.force(0.5) == pytest.approx(0.1)
    assert made.accuracy() == ""


def test_what_was_forgotten_is_not_made_up() -> None:
    made = plant(IDEAL)
    for k in range(4):
        made.render(k * 10_000, 10_000, 1e-4, 0.0, CHANNELS, FULL, SHIFT)
    with pytest.raises(ParameterError, match="forgotten"):
        made.render(0, 10, 1e-4, 0.0, CHANNELS, FULL, SHIFT)


@pytest.mark.parametrize("options", [IDEAL, PlantOptions(follower=False, noise=QUIET)])
def test_rendered_voltages_are_the_models(options: PlantOptions) -> None:
    """Within 0.1 mV and spikes within a sample, after several commands, in blocks."""
    made = plant(options)
    commands = [(0.01, 0.1), (0.031, 0.2), (0.052, 0.27), (0.35, 0.0)]
    for when, force in commands:
        made.set_current(when, newtons(force))
    fine = (
        Channel(signal="V_C1", input="A", range=2.5, offset=-2.5),
        Channel(signal="V_C2", input="B", range=2.0, offset=-1.7),
        Channel(signal="V_K", input="C", range=5.0),
    )
    interval, n = 2e-6, 250_000
    codes = np.concatenate(
        [
            made.render(k * 10_000, 10_000, interval, 0.0, fine, FULL, 0)[0]
            for k in range(n // 10_000)
        ],
        axis=1,
    )
    knots = np.arange(0, 0.5, 5e-5)
    points = [(t, made.force(t)) for t in knots]
    if options is IDEAL:
        points = [(0.0, 0.0)]
        for when, force in commands:
            points += [(when, points[-1][1]), (when, force)]
    model = simulate(
        made.circuit,
        Waveform.through(points),
        until=0.5,
        keep=("V_C1", "V_C2", "spikes"),
    )
    time = np.arange(n) * interval
    assert model.spike_times is not None and model.spike_times.size > 10
    after = time - model.spike_times[:, None]
    near = np.any(np.abs(after) < 2 * interval, axis=0)
    for row, signal in enumerate(("V_C1", "V_C2")):
        seen = volts(codes[row], fine[row])
        wrong = np.abs(seen - model.sample(signal, time))[~near]
        assert wrong.max() < 0.1e-3, signal
    found = np.flatnonzero(np.diff((codes[2] > 1000).astype(int)) == 1) + 1
    assert found.size == model.spike_times.size
    assert np.abs(found * interval - model.spike_times).max() < interval


def test_an_hour_nobody_looked_at_is_passed_in_few_solves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solved = []
    real = advance.advance

    def counted(*args: object, **options: object) -> object:
        solved.append(args)
        return real(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(advance, "advance", counted)
    made = plant(IDEAL)
    before = render(made, 0.01)
    made.set_current(3600.05, newtons(0.2))
    codes = made.render(0, 1000, 1e-5, 3600.0, CHANNELS, FULL, SHIFT)[0]
    assert len(solved) < 100
    assert np.array_equal(codes, before)
