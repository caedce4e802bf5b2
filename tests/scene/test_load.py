"""Scene files become validated scenes in SI, and resolve to text that loads again."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from tactile_lab.errors import SceneError
from tactile_lab.model.temperature import at_temperature, temperature
from tactile_lab.scene.load import load, load_bench, resolve

PULSES = '[protocol]\nname = "pulses"\n'


@pytest.fixture
def scene_file(tmp_path):
    def write(text: str, name: str = "my.toml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_no_path_is_the_demo_on_the_simulated_bench():
    scene = load()
    assert scene.protocol.name == "pulses"
    assert scene.protocol.levels == (0.08, 0.12, 0.16, 0.2)
    assert (scene.protocol.ramp, scene.protocol.hold, scene.protocol.rest) == (
        0.25,
        2,
        2,
    )
    assert scene.bench.simulated
    assert [c.signal for c in scene.bench.scope.channels] == [
        "V_C1",
        "V_C2",
        "V_K",
        "coil_current",
    ]
    assert 0.2 < scene.bench.magnet.newtons_per_ampere < 0.2012
    assert scene.record.sample_rate == 1e6


def test_a_shipped_scene_is_found_by_its_name():
    assert load("spikes_only").record.signals == ("spikes",)


@pytest.mark.parametrize(
    ("text", "verb"),
    [
        ('title = "A"\n[want.threshold]\nis = "20 mN"\n', "design"),
        ('title = "A"\n[[axis]]\nkey = "sensor.R1"\n', "study"),
        ("[array]\ngrid = [2, 1]\n", "skin"),
    ],
)
def test_a_file_of_another_verb_is_told_as_that(scene_file, text, verb):
    """The window said that a scene has no key "title"."""
    path = scene_file(text)
    with pytest.raises(SceneError, match=f"is no scene.*`tactile-lab {verb} {path}`"):
        load(path)


def test_tables_become_si(scene_file):
    path = scene_file(
        PULSES
        + 'levels = ["50 mN", "0.1 N"]\nhold = "1500 ms"\n'
        + '[sensor]\ng31 = "-0.039 V m/N"\nC1 = "1 nF"\nR3 = "50 MΩ"\nfiring = "put"\n'
        + '[record]\nsignals = ["V_C1", "spikes"]\nsample_rate = "2 MS/s"\n'
        + '[detect]\nthreshold = "700 mV"\nhysteresis = "50 mV"\nrefractory = "1 ms"\n'
        + '[simulated]\nseed = 7\nnoise = { V_K = "200 mV" }\n'
        + "[coil]\nstrict = true\n"
    )
    scene = load(path)
    assert scene.protocol.levels == (0.05, 0.1)
    assert scene.protocol.hold == 1.5
    assert (scene.circuit.g31, scene.circuit.C1, scene.circuit.R3) == (
        -0.039,
        1e-9,
        50e6,
    )
    assert scene.circuit.fire_voltage == 3.56
    assert scene.record.signals == ("V_C1", "spikes")
    assert scene.record.sample_rate == 2e6
    assert (scene.detect.threshold, scene.detect.hysteresis) == (0.7, 0.05)
    assert scene.simulated.noise["V_K"] == 0.2
    assert scene.simulated.noise["V_C1"] == 5e-3, "noise not named keeps its default"
    assert scene.coil.strict
    assert scene.name == "my"


def test_preset_first_then_single_keys(scene_file):
    preset = load(scene_file(PULSES + '[sensor]\npreset = "fig5b"\n'))
    assert preset.circuit.V_GS == 1.54141
    over = load(scene_file(PULSES + '[sensor]\npreset = "fig5b"\nV_GS = "1.5 V"\n'))
    assert over.circuit.V_GS == 1.5


def test_what_is_stated_to_be_uncertain_of_the_circuit_is_known_to_fits():
    found = load("demo", ['sensor.temperature_uncertainty="2 K"']).displaced
    believed = load("demo").circuit
    bias = replace(believed, I_bias=believed.I_bias + 20e-12)
    warm = at_temperature(believed, temperature(believed) + 2)
    assert found == {"follower": bias, "temperature": warm}
    alone = ['sensor.temperature_uncertainty="0 K"', 'bench.followers.bandwidth="0 Hz"']
    assert load("demo", alone).displaced == {"follower": bias}


def test_explicit_thresholds_override_what_firing_sets(scene_file):
    scene = load(
        scene_file(PULSES + '[sensor]\nfiring = "put"\nV_fire = "3 V"\nt_eps = "0 s"\n')
    )
    assert scene.circuit.fire_voltage == 3.0
    assert scene.circuit.reset_voltage == 0.578
    assert scene.circuit.reset_time == 0.0


def test_start(scene_file):
    assert load().start is None
    cold = '[sensor]\nstart = { V_P = "0 V", V_C1 = "0 V", V_C2 = "1 V" }\n'
    start = load(scene_file(PULSES + cold)).start
    assert (start.V_P, start.V_C1, start.V_C2) == (0.0, 0.0, 1.0)


def test_overrides_are_dotted_keys_with_toml_or_bare_values():
    scene = load(
        None,
        [
            "protocol.hold=3 s",
            'protocol.levels=["10 mN"]',
            "simulated.seed=5",
            "coil.strict=true",
            "simulated.noise.V_K=1 mV",
            'record.signals=["V_C1"]',
        ],
    )
    assert scene.protocol.hold == 3.0
    assert scene.protocol.levels == (0.01,)
    assert scene.simulated.seed == 5
    assert scene.coil.strict
    assert scene.simulated.noise["V_K"] == 1e-3
    assert scene.record.signals == ("V_C1",)


@pytest.mark.parametrize(
    "override", ["hold=2 s", "protocol.hold", "=", "protocol.=1", "protocol.hold.x=1"]
)
def test_a_bad_override_is_named(override):
    with pytest.raises(SceneError, match="--set"):
        load(None, [override])


@pytest.mark.parametrize(
    ("scene", "changes", "bench", "told"),
    [
        (None, "protocol.hold=2 s", None, r"'protocol.hold=2 s' changes no key"),
        (None, 5, None, "5 changes no key"),
        (None, {1: 2}, None, "1 = 2: write table.key=value"),
        (None, [7], None, "--set 7: write table.key=value"),
        (None, {"protocol.name": None}, None, r"\[protocol\] name.*a text is needed"),
        (5, (), None, "scene = 5: a name or the path"),
        ({"protocol": {"name": "pulses"}}, (), None, "scene = {'protocol'.*a name"),
        (None, (), 5, "bench = 5: a name or the path"),
    ],
)
def test_what_is_no_scene_bench_or_change_is_refused_in_words(
    scene, changes, bench, told
):
    with pytest.raises(SceneError, match=told):
        load(scene, changes, bench)


def test_a_bad_value_from_the_command_line_is_blamed_on_the_option():
    with pytest.raises(
        SceneError, match=r"^--set protocol.hold=2 V: \[protocol\] hold"
    ):
        load(None, ["protocol.hold=2 V"])


@pytest.mark.parametrize("name", ["demo", "spikes_only", "v_c1_only"])
def test_the_resolved_scene_loads_as_the_same_scene(name, tmp_path):
    scene = load(name)
    text = scene.to_toml()
    again = resolve(tomllib.loads(text), tmp_path / f"{name}.toml")
    assert again.to_toml() == text
    assert again.circuit == scene.circuit
    assert again.protocol == scene.protocol
    assert again.bench.scope.channels == scene.bench.scope.channels


def test_resolved_quantities_are_exact(scene_file):
    scene = load(scene_file(PULSES + 'hold = "0.1234567890123456 s"\n'))
    again = resolve(tomllib.loads(scene.to_toml()), Path("x.toml"))
    assert again.protocol.hold == scene.protocol.hold == 0.1234567890123456


def test_a_protocol_file_of_the_users_own_runs_without_a_scene(tmp_path):
    path = tmp_path / "tap.py"
    path.write_text(
        "from typing import ClassVar\n"
        "from tactile_lab.quantity import Force\n"
        "from tactile_lab.trial import Protocol, Trial\n"
        "from tactile_lab.waveform import Waveform\n\n"
        "class Tap(Protocol):\n"
        '    name: ClassVar[str] = "tap"\n'
        '    title: ClassVar[str] = "Tap"\n'
        "    level: Force = 0.1\n"
        "    def trials(self):\n"
        "        yield Trial(force=Waveform.pulse(self.level, ramp=0.1, hold=0.1), "
        'label="tap")\n'
    )
    scene = load(path, ["protocol.level=20 mN"])
    assert scene.protocol.level == 0.02
    assert scene.protocol_source == path
    again = resolve(tomllib.loads(scene.to_toml()), Path("x.toml"))
    assert again.protocol.level == 0.02
    with pytest.raises(SceneError, match='did you mean "level"'):
        load(path, ["protocol.levle=20 mN"])


def test_a_bench_file_names_instruments_and_hand_set_voltages(tmp_path, scene_file):
    (tmp_path / "lab.toml").write_text(
        '[coil]\ndialect = "kepco-bop"\nport = "/dev/ttyUSB0"\n'
        '[coil.limits]\ncurrent = "1 A"\n'
        '[[scope.channels]]\nsignal = "V_K"\ninput = "B"\nscale = 10.0\n'
        '[magnet]\nr = "8 mm"\nA2 = "225e-6 m^2"\n'
        '[hand_set]\nV_GS = "1.5 V"\n'
    )
    scene = load(scene_file(PULSES + '[bench]\nfile = "lab.toml"\n'))
    assert not scene.bench.simulated
    assert scene.bench.coil.limits.current == 1.0
    assert scene.bench.scope.channels[0].scale == 10.0
    assert scene.circuit.V_GS == 1.5
    assert scene.bench.field_meter is None
    assert (tmp_path / "lab.toml") in scene.files
    own = load(
        scene_file(PULSES + '[bench]\nfile = "lab.toml"\n[sensor]\nV_GS = "1.3 V"\n')
    )
    assert own.circuit.V_GS == 1.3, "the scene's own key wins over the bench's"
    assert load(scene_file(PULSES), bench=str(tmp_path / "lab.toml")).bench.path
    assert load(scene.path, bench="sim").bench.simulated
    assert load_bench(tmp_path / "lab.toml").magnet.r == 8e-3


def test_a_scene_cannot_reach_instruments_without_a_bench_file(scene_file):
    with pytest.raises(SceneError, match="only by a bench file"):
        load(scene_file(PULSES + "[bench]\nsimulated = false\n"))


def test_a_mistake_in_a_bench_file_names_that_file(tmp_path, scene_file):
    (tmp_path / "lab.toml").write_text('[magnet]\nr = "8 mm"\n[coil]\nprot = "x"\n')
    with pytest.raises(SceneError, match=r'lab.toml: \[coil\] .*did you mean "port"'):
        load(scene_file(PULSES + '[bench]\nfile = "lab.toml"\n'))


def test_a_shunt_gives_the_scale(scene_file):
    scene = load()
    current = scene.bench.scope.channels[3]
    assert current.scale == pytest.approx(10.0)


def test_a_calibration_is_found_beside_the_scene(tmp_path, scene_file):
    (tmp_path / "cal.csv").write_text("current_A,field_T\n-1,-0.012\n0,0\n1,0.010\n")
    scene = load(scene_file(PULSES + '[bench.magnet]\ncalibration = "cal.csv"\n'))
    assert scene.bench.magnet.calibration.unit == "T"
    assert tmp_path / "cal.csv" in scene.files


LAB = (
    '[coil]\nport = "COM3"\n[magnet]\nr = "8 mm"\n'
    '[[scope.channels]]\nsignal = "V_K"\ninput = "A"\n'
)


def test_single_keys_of_a_chosen_bench_can_be_changed(
    tmp_path, scene_file, monkeypatch
):
    (tmp_path / "lab.toml").write_text(LAB)
    monkeypatch.chdir(tmp_path)
    scene = load("demo", ["bench.magnet.r=9 mm"], bench="lab.toml")
    assert scene.bench.magnet.r == 9e-3
    assert scene.bench.path == tmp_path / "lab.toml"
    with pytest.raises(SceneError, match=r"^--bench nope\.toml|nope\.toml"):
        load("demo", bench="nope.toml")


def test_a_real_instrument_needs_a_port(tmp_path):
    path = tmp_path / "lab.toml"
    path.write_text(LAB.replace('port = "COM3"\n', ""))
    with pytest.raises(SceneError, match=r"\[coil\] port is missing"):
        load_bench(path)
    path.write_text("simulated = true\n" + LAB.replace('port = "COM3"\n', ""))
    assert load_bench(path).simulated


@pytest.mark.parametrize(
    ("port", "told"),
    [
        ("socket://10.0.0.1", 'such as "socket://10.0.0.7:5025"'),
        ("socket://:5025", "host and number of the port are needed"),
        ("rfc2217://lab:99999", "host and number of the port are needed"),
        ("tcp://lab:5025", "no port is reached by tcp://; Known: socket"),
    ],
)
def test_a_port_that_no_link_can_open_is_refused_beforehand(tmp_path, port, told):
    path = tmp_path / "lab.toml"
    path.write_text(LAB.replace("COM3", port))
    with pytest.raises(SceneError) as refused:
        load_bench(path)
    assert f'lab.toml: [coil] port = "{port}": ' in str(refused.value)
    assert told in str(refused.value)


def test_a_dialect_of_the_users_own_is_found_beside_the_bench_file(tmp_path):
    path = tmp_path / "lab.toml"
    path.write_text(LAB.replace("[coil]\n", '[coil]\ndialect = "mine.toml"\n'))
    assert load_bench(path).coil.dialect == str(tmp_path / "mine.toml")


def test_a_start_table_survives_in_the_resolved_scene(scene_file):
    cold = '[sensor]\nstart = { V_P = "0.1 V", V_C1 = "0 V", V_C2 = "1 V" }\n'
    scene = load(scene_file(PULSES + cold))
    again = resolve(tomllib.loads(scene.to_toml()), Path("x.toml"))
    assert again.start == scene.start


def test_a_key_that_former_versions_wrote_into_every_run_is_passed_over(tmp_path):
    table, kept = "[bench.field_meter]\n", tmp_path / "scene.toml"
    text = load("demo").to_toml()
    assert text.count(table) == 1
    kept.write_text(text.replace(table, f'{table}interval = "0.2 s"\n'))
    assert load(str(kept)).bench.field_meter == load("demo").bench.field_meter


def test_a_refusal_in_python_says_key_and_value_once():
    with pytest.raises(SceneError) as refused:
        load("demo", {"protocol.levels": None})
    assert str(refused.value) == "protocol.levels = None: a list [...] is needed."


def test_another_row_brings_its_own_baud_rate():
    """The built-in bench's 19200 baud are the Kepco's, not any other source's."""
    kept = load("demo", {"bench.coil.dialect": "kepco-bop"})
    assert kept.bench.coil.baud == 19200
    other = load("demo", {"bench.coil.dialect": "keithley-2400"})
    assert other.bench.coil.baud is None
    told = load("demo", {"bench.coil.dialect": "keithley-2400", "bench.coil.baud": 300})
    assert told.bench.coil.baud == 300


def test_a_refractory_time_that_no_spike_outlives_is_refused():
    with pytest.raises(SceneError, match="at most 10 s"):
        load("demo", {"detect.refractory": "1e18 s"})


def test_a_continuous_current_that_no_current_exceeds_is_refused():
    with pytest.raises(SceneError, match=r"continuous: 5 A is more than current, 2 A"):
        load("demo", {"bench.coil.limits.continuous": "5 A"})
    narrow = load("demo", {"bench.coil.limits.current": "0.5 A"}).bench.coil.limits
    assert narrow.continuous == 0.6, "a source may be narrower than the coil"


@pytest.mark.parametrize("r", ["1e-200 mm", "1e200 m"])
def test_a_distance_that_gives_no_force_is_blamed_on_itself(r):
    with pytest.raises(SceneError, match=r"r = 1e[-+]20\d m with A1, A2 and B1 gives"):
        load("demo", {"bench.magnet.r": r})


@pytest.mark.parametrize("key", ["coil_lag", "eddy_lag", "lag_uncertainty"])
def test_a_lag_of_the_field_that_no_core_has_is_refused(key):
    with pytest.raises(SceneError, match="at most 10 s"):
        load("demo", {f"bench.magnet.{key}": "1e30 s"})
    kept = load("demo", {f"bench.magnet.{key}": "0.5 s"}).bench.magnet
    assert getattr(kept, key) == 0.5
