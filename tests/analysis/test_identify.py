from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from tactile_lab.analysis.evidence import Residuals, Scatter
from tactile_lab.analysis.identify import Evidence, identify, identify_together
from tactile_lab.analysis.twin import Measured
from tactile_lab.deviation import DrivenCircuit
from tactile_lab.errors import NotIdentifiableError, ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform

FORCE = Waveform.pulse(0.12, ramp=0.25, hold=4.0, rest=2.0).then(
    Waveform.pulse(0.18, ramp=0.25, hold=6.0, rest=4.0)
)


def run_of(circuit, *, noise=3e-3, jitter=0.0, seed=0, bins=600):
    found = simulate(circuit, FORCE, keep=("V_C1", "spikes"))
    rng = np.random.default_rng(seed)
    time = (np.arange(bins) + 0.5) * FORCE.end / bins
    value = found.sample("V_C1", time) + rng.normal(0, noise, bins)
    spikes = found.spike_times + rng.normal(0, jitter, found.spike_times.size)
    return Measured("V_C1", time, value), spikes


@pytest.mark.parametrize(
    ("names", "truth"),
    [
        (("V_GS", "tau"), {"V_GS": 1.412, "tau": 7.9}),
        (("V_GS", "tau", "V_th"), {"V_GS": 1.39, "tau": 9.2, "V_th": 3.1}),
        (("I_S", "tau"), {"I_S": 1.35e-12, "tau": 8.0}),
    ],
)
def test_it_finds_what_the_run_was_made_with(names, truth):
    trace, spikes = run_of(replace(Circuit(), **truth), jitter=1e-4)
    found = identify(Circuit(), names, FORCE, FORCE.end, V_C1=trace, spike_times=spikes)
    for name, value in truth.items():
        assert found.estimates[name].value == pytest.approx(value, rel=0.01)
        assert getattr(found.circuit, name) == found.estimates[name].value
    assert found.scatter_V_C1 == pytest.approx(3e-3, rel=0.15)


def test_its_intervals_cover_the_truth():
    truth, hits, repeats = {"V_GS": 1.405, "tau": 8.3}, np.zeros(2), 40
    for seed in range(repeats):
        trace, _ = run_of(replace(Circuit(), **truth), seed=seed, bins=200)
        found = identify(Circuit(), tuple(truth), FORCE, FORCE.end, V_C1=trace)
        hits += [
            found.estimates[n].low <= v <= found.estimates[n].high
            for n, v in truth.items()
        ]
    assert np.all(hits / repeats > 0.85)


def test_what_scatters_most_where_it_tells_most_is_told_so():
    """As if all bins scattered alike, tau was told a sixth too narrowly."""
    found = []
    for seed in range(30):
        trace, _ = run_of(Circuit(), seed=seed, bins=200, noise=1e-4)
        moving = np.abs(np.gradient(trace.value, trace.time)) > 0.05
        loud = np.random.default_rng(seed).normal(0, 5e-3, 200) * moving
        trace = replace(trace, value=trace.value + loud)
        fit = identify(Circuit(), ("V_GS", "tau"), FORCE, FORCE.end, V_C1=trace)
        found.append(fit.estimates["tau"])
    scattered = np.std([one.value for one in found])
    told = np.mean([one.error for one in found])
    assert 0.92 * scattered < told < 1.2 * scattered


@pytest.mark.parametrize(("jitter", "told"), [(1e-6, False), (1e-3, True)])
def test_noise_as_it_fires_is_told_beyond_the_intervals(jitter, told):
    _, spikes = run_of(Circuit(), jitter=jitter)
    found = identify(Circuit(), ("V_GS",), FORCE, FORCE.end, spike_times=spikes)
    assert ("of scatter as it fires" in found.noise) is told


def test_it_says_what_the_run_cannot_tell_apart():
    trace, _ = run_of(Circuit())
    found = identify(Circuit(), ("V_GS", "I_S"), FORCE, FORCE.end, V_C1=trace)
    assert any("V_GS and I_S cannot be told apart" in w for w in found.warnings)
    assert found.estimates["V_GS"].high - found.estimates["V_GS"].low > 0.5
    assert any("V_GS is not identifiable: it is 1 V (" in w for w in found.warnings)


def test_a_parameter_without_effect_is_refused():
    trace, _ = run_of(Circuit())
    with pytest.raises(NotIdentifiableError, match="C2 does not act"):
        identify(Circuit(), ("V_GS", "C2"), FORCE, FORCE.end, V_C1=trace)


def test_no_data_is_refused():
    with pytest.raises(NotIdentifiableError, match="0 data points"):
        identify(Circuit(), ("V_GS",), FORCE, FORCE.end)


@pytest.mark.parametrize("names", [(), ("V_GS", "V_GS"), ("t1",), ("voltage",)])
def test_impossible_names_are_refused(names):
    with pytest.raises(ParameterError):
        identify(Circuit(), names, FORCE, FORCE.end)


def test_an_uncertain_force_widens_the_intervals():
    trace, _ = run_of(Circuit())

    def found(force, band=0.0):
        def moved(circuit, parts):
            return DrivenCircuit(circuit, force.scaled(1 + band * parts["force"]))

        return identify(
            Circuit(), ("V_GS", "tau"), force, FORCE.end, V_C1=trace,
            **({"causes": ["force"], "moved": moved} if band else {}),
        ).estimates  # fmt: skip

    noise, known = found(FORCE), found(FORCE, 0.05)
    # a force that is wrong by that much really moves the estimate
    moved = found(FORCE.scaled(1.04), 0.05)
    assert known["V_GS"].half > 1.5 * noise["V_GS"].half
    for name, truth in (("V_GS", 1.4), ("tau", 8.69)):
        assert moved[name].low < truth < moved[name].high


@pytest.mark.parametrize("off", [-0.012, 0.012])
def test_an_offset_of_the_channel_hides_nothing_that_the_shape_of_V_C1_tells(off):
    truth = {"V_GS": 1.402, "tau": 8.5, "I_bias": 60e-12}
    trace, spikes = run_of(replace(Circuit(), **truth), jitter=1e-6)
    seen = replace(trace, value=trace.value + off, resolution=16e-3)
    fitted = identify(
        Circuit(), tuple(truth), FORCE, FORCE.end, V_C1=seen, spike_times=spikes
    )
    found = fitted.estimates
    for name, value in truth.items():
        assert found[name].low < value < found[name].high
    # taken for what each bin may be off by, it would leave 150 pA open
    assert found["I_bias"].half < 15e-12
    assert not fitted.warnings, "alike errors that are small are no trouble"


@pytest.mark.parametrize("edge", [0.0, 0.25, 0.5, 0.75])
def test_what_a_converters_steps_leave_of_a_mean_is_not_taken_for_the_sensor(edge):
    """Noise of a third of a code leaves means off by 0.7 mV, alike at one voltage."""
    force = Waveform.pulse(0.14, ramp=0.25, hold=1.0, rest=8.0)
    truth, code, bins, samples = Circuit(V_GS=1.403), 16e-3, 800, 2000
    made = simulate(truth, force, keep=("V_C1",))
    time = (np.arange(bins) + 0.5) * force.end / bins
    rng = np.random.default_rng(7)
    seen = made.sample("V_C1", time)[:, np.newaxis] / code + edge
    seen = np.rint(seen + rng.normal(0, 0.32, (bins, samples))) - edge
    trace = Measured("V_C1", time, code * seen.mean(axis=1), resolution=code)
    found = identify(Circuit(), ("V_GS", "tau"), force, force.end, V_C1=trace)
    for name, value in {"V_GS": truth.V_GS, "tau": truth.tau}.items():
        assert found.estimates[name].low < value < found.estimates[name].high
    assert found.scatter_V_C1 < 0.02 * code, "what noise of the bins alone makes"


def test_codes_that_no_noise_smooths_are_no_independent_readings():
    truth, hits = {"V_GS": 1.402, "tau": 8.5}, []
    step = 39e-3
    trace, spikes = run_of(replace(Circuit(), **truth), noise=0.0)
    for begin in np.linspace(0, step, 8, endpoint=False):
        codes = np.round((trace.value - begin) / step) * step + begin
        found = identify(
            Circuit(), tuple(truth), FORCE, FORCE.end,
            V_C1=replace(trace, value=codes, resolution=step), spike_times=spikes,
        ).estimates  # fmt: skip
        hits += [found[n].low < value < found[n].high for n, value in truth.items()]
    assert np.mean(hits) > 0.9


def test_what_is_not_known_of_times_blurs_the_edges_alone():
    trace, _ = run_of(Circuit())

    def found(clock, force=FORCE):
        def moved(circuit, parts):
            late = force.shifted(parts["clock"] * clock)
            return DrivenCircuit(circuit, late.since(0.0))

        return identify(
            Circuit(), ("V_GS", "tau"), force, FORCE.end, V_C1=trace,
            causes=["clock"], moved=moved,
        ).estimates  # fmt: skip

    sure, late = found(0.0), found(5e-3)
    moved = found(5e-3, FORCE.shifted(5e-3))
    for name in sure:
        assert late[name].half < 1.5 * sure[name].half
        # what so late a force really moves the fit by lies within
        assert abs(moved[name].value - late[name].value) < late[name].half


def test_spikes_of_a_saturating_t1_are_no_evidence():
    _, spikes = run_of(Circuit())
    with pytest.raises(NotIdentifiableError, match="T1 saturates"):
        identify(
            Circuit(saturation=True), ("V_GS",), FORCE, FORCE.end, spike_times=spikes
        )


def pushed(truth, factor, seed, believed=None):
    """A run whose force is `factor` times what is believed."""
    circuit, force = replace(Circuit(), **truth), FORCE.scaled(factor)
    found = simulate(circuit, force, keep=("V_C1", "spikes"))
    time = (np.arange(200) + 0.5) * FORCE.end / 200
    rng = np.random.default_rng(seed)
    trace = Measured(
        "V_C1", time, found.sample("V_C1", time) + rng.normal(0, 3e-3, 200)
    )
    spikes = found.spike_times + rng.normal(0, 1e-4, found.spike_times.size)
    return Evidence(believed or circuit, FORCE, FORCE.end, trace, spikes)


def test_several_runs_share_what_is_fitted_and_keep_what_is_not():
    believed = [replace(Circuit(), V_GS=V_GS) for V_GS in (1.39, 1.41)]
    runs = [
        pushed({"V_GS": one.V_GS, "tau": 7.9}, 1.0, seed, one)
        for seed, one in enumerate(believed)
    ]
    found = identify_together(runs, ("tau",)).estimates["tau"]
    alone = [identify_together([run], ("tau",)).estimates["tau"] for run in runs]
    assert found.low < 7.9 < found.high
    assert found.error < min(one.error for one in alone)


def test_the_force_of_each_run_has_a_factor_of_its_own_where_asked():
    factors = (1.0, 1.1)
    runs = [pushed({"tau": 8.0}, k, n, Circuit()) for n, k in enumerate(factors)]
    found = identify_together(runs, ("tau",), force_scales=True).estimates
    assert list(found) == ["tau", "force_1", "force_2"]
    for name, truth in zip(found, (8.0, *factors), strict=True):
        assert found[name].value == pytest.approx(truth, rel=5e-3)
        assert found[name].low < truth < found[name].high


def test_what_one_bench_does_not_know_is_not_averaged_away():
    def moved(circuit, parts):
        gate = circuit.V_GS + 2e-3 * parts["gate"]
        return DrivenCircuit(replace(circuit, V_GS=gate), FORCE)

    runs = [
        replace(pushed({}, 1.0, seed, Circuit()), causes=["gate"], moved=moved)
        for seed in range(3)
    ]
    several = (runs[:1], runs)
    one, many = (identify_together(r, ("V_GS",)).estimates["V_GS"] for r in several)
    assert one.half == pytest.approx(2e-3, rel=0.02)
    assert many.half == pytest.approx(2e-3, rel=0.02)


@pytest.mark.parametrize("own", [0.0, 3e-4])
def test_a_late_spike_makes_one_interval_longer_and_the_next_shorter(own):
    """As independent scatter, lateness alone was told more than twice too widely."""
    rng, repeats = np.random.default_rng(3), 400
    late = np.column_stack([-np.linspace(3, 30, 40), np.linspace(3, 30, 40)])
    follows = np.arange(40) > 0
    gain, told = np.ones((1, 40)), []
    moved = np.empty(repeats)
    for k in range(repeats):
        off = rng.uniform(-0.5e-6, 0.5e-6, 41)
        misses = late[:, 0] * off[:-1] + late[:, 1] * off[1:]
        misses += rng.normal(0, own, 40) if own else 0.0
        found = Scatter.of(misses, late, follows)
        told.append(found.covariance(gain)[0, 0])
        moved[k] = np.sum(misses)
        if k == 0 and not own:
            assert found.timing == pytest.approx(1e-12 / 12, rel=0.6)
            alone = replace(found, timing=0.0, own=np.mean(misses**2))
            assert alone.covariance(gain)[0, 0] > 4 * told[0]
    assert np.median(told) == pytest.approx(np.var(moved), rel=0.25)


def test_steps_of_the_force_between_two_spikes_move_no_estimate():
    """A rule that went across them was off by 0.1 mV where a spike tells 0.01 mV."""
    steps = np.column_stack([np.arange(0, 0.4, 0.0457), np.linspace(0.0, 0.16, 9)])
    stairs = Waveform.stairs(steps, 2.5)
    true = Circuit()
    made = simulate(true, stairs, keep=("spikes",))
    seen = Residuals(true, ("V_GS",), stairs, 2.5, None, made.spike_times)
    assert made.spike_times[0] < steps[-1, 0], "it fires while the force still rises"
    assert np.abs(seen.under(DrivenCircuit(true, stairs))).max() < 1e-6


def blas_threads():
    return {
        lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"
    }


def test_a_fit_takes_one_thread_of_the_linear_algebra_and_gives_the_others_back():
    """Two took 18 times as long as one with 600 ramps whose answers were late."""
    seen = []

    def moved(circuit, parts):
        seen.append(blas_threads())
        return DrivenCircuit(circuit, FORCE)

    trace, _ = run_of(Circuit(), bins=50)
    with threadpool_limits(2, "blas"):
        identify(Circuit(), ("V_GS",), FORCE, FORCE.end, V_C1=trace, moved=moved)
        assert blas_threads() == {2}
    assert seen and set.union(*seen) == {1}
