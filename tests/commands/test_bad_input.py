"""Bad input, alike for every verb that takes a scene: one message, code 2, no trace."""

import re

import pytest

PULSES = '[protocol]\nname = "pulses"\n'
TABLE = '[protocol]\nname = "waveform"\nfile = "force.csv"\n'
VERBS = ("simulate", "plan", "run")

SCENES = {
    "unknown key": (PULSES + 'hodl = "2 s"\n', r'\[protocol\].*"hodl".*"hold"'),
    "unknown table": (PULSES + '[sensr]\nC1 = "1 F"\n', r'\[sensr\].*"sensor"'),
    "unknown top-level key": ("foo = 1\n" + PULSES, '"foo"'),
    "wrong unit for a force": (
        PULSES + 'levels = ["50 mV"]\n',
        r'\[protocol\] levels.*"50 mV".*mV.*N is needed',
    ),
    "wrong unit": (PULSES + 'hold = "2 V"\n', r'\[protocol\] hold.*"2 V".*"2 s"'),
    "bare number": (PULSES + "hold = 2\n", '"2 s"'),
    "NaN": (PULSES + "hold = nan\n", r"\[protocol\] hold.*finite"),
    "NaN text": (PULSES + 'hold = "nan s"\n', r"\[protocol\] hold"),
    "NaN number": (PULSES + "[sensor]\nm = nan\n", r"\[sensor\] m.*finite"),
    "infinite": (PULSES + 'hold = "1e400 s"\n', r"hold.*finite"),
    "infinite number": (PULSES + "[sensor]\nm = 1e400\n", "finite"),
    "impossible": (PULSES + '[sensor]\nC1 = "0 F"\n', "C1 = 0"),
    "negative capacity": (PULSES + '[sensor]\nC1 = "-1 F"\n', "C1 = -1"),
    "negative duration": (PULSES + 'hold = "-2 s"\n', r"hold.*above 0 s"),
    "negative length": (TABLE + 'duration = "-1 s"\n', r"duration.*above 0 s"),
    "no such protocol": ('[protocol]\nname = "pulsess"\n', '"pulsess".*"pulses"'),
    "no such signal": (PULSES + '[record]\nsignals = ["V_C3"]\n', '"V_C3".*Known'),
    "no signal": (PULSES + "[record]\nsignals = []\n", "at least one"),
    "not a list": (PULSES + '[record]\nsignals = "V_C1"\n', "list"),
    "no protocol": ('[record]\nsignals = ["V_C1"]\n', "protocol"),
    "not TOML": ("hello there", "not TOML"),
    "not text": (bytes(range(256)), "not text"),
    "empty": ("", "empty"),
    "NUL in a file's name": (TABLE.replace("force.csv", "\\u0000"), "NUL"),
    "too many parts": (
        '[protocol]\nname = "monitor"\nduration = "1e30 s"\n',
        "more than 10000 parts",
    ),
    "nested too deeply": ("a=" + "[" * 9000 + "]" * 9000, "deeply"),
    "no such option": (PULSES + '[sensor]\nt1 = "emiter"\n', "emitter_resistor"),
    "saturation": (PULSES + '[sensor]\nsaturation = "yes"\n', "saturation"),
    "reset above fire": (PULSES + '[sensor]\nV_reset = "4 V"\n', "V_reset"),
    "start above fire": (
        PULSES + '[sensor.start]\nV_P = "0 V"\nV_C1 = "0 V"\nV_C2 = "3.213 V"\n',
        "V_C2 = 3.213 V must be below V_fire",
    ),
    "start without V_C2": (
        PULSES + '[sensor.start]\nV_P = "0 V"\nV_C1 = "0 V"\n',
        "V_C2 is missing",
    ),
    "start in other words": (PULSES + '[sensor]\nstart = "rest"\n', "equilibrium"),
    "bench file missing": (PULSES + '[bench]\nfile = "nope.toml"\n', "does not exist"),
    "bench is a folder": (PULSES + '[bench]\nfile = "."\n', "folder"),
    "geometry": (PULSES + '[bench.magnet]\nr = "0 m"\n', r"\[bench.magnet\] r"),
    "hysteresis": (PULSES + '[detect]\nhysteresis = "1 V"\n', "hysteresis"),
    "half auto": (
        PULSES + '[detect]\nthreshold = "auto"\nhysteresis = "1 V"\n',
        "both",
    ),
    "force table missing": (TABLE.replace("force", "nope"), "nope.csv does not exist"),
    "force table a folder": (TABLE.replace("force.csv", "."), "folder"),
}

ON_THE_BENCH = {
    "force beyond the coil": (
        PULSES + 'levels = ["500 mN"]\n',
        r"500 mN.*reachable is −401.2 mN to 401.2 mN",
    ),
    "strict": (PULSES + 'ramp = "1 ms"\n[coil]\nstrict = true\n', "coil.strict"),
    "too hot": (PULSES + 'hold = "100 s"\n', "heat budget"),
    "dialect": (PULSES + '[bench.coil]\ndialect = "kepko"\n', '"kepko"'),
    "range": (
        PULSES + '[[bench.scope.channels]]\nsignal = "V_K"\ninput = "A"\n'
        'range = "3 V"\n[record]\nsignals = ["spikes"]\n',
        "3 V",
    ),
    "not wired": (
        PULSES + '[[bench.scope.channels]]\nsignal = "V_K"\ninput = "A"\n',
        "V_C1",
    ),
}

TABLES = {
    "unsorted": ("time_s,force_N\n1,0\n0,0\n", "line 3"),
    "NaN": ("time_s,force_N\n0,0\n1,nan\n", "line 3"),
    "other header": ("a,b\n0,0\n", "time_s,force_N"),
    "empty": ("", "empty"),
    "not numbers": ("time_s,force_N\n0,x\n", "line 2"),
    "not text": (b"time_s,force_N\n\xff\xfe", "not text"),
}


@pytest.fixture(params=VERBS)
def refused(request, tactile_lab, tmp_path):
    def check(path, told, *options):
        before = sorted(tmp_path.rglob("*"))
        answer = tactile_lab(request.param, path, "--json", *options)
        assert answer.code == 2, answer
        assert answer.out == ""
        assert "Traceback" not in answer.err
        assert len(answer.err.strip().splitlines()) == 1, answer.err
        assert re.search(told, answer.err), answer.err
        assert sorted(tmp_path.rglob("*")) == before, "something was written"

    return check


@pytest.mark.parametrize("case", SCENES)
def test_a_bad_scene(refused, scene_file, case):
    text, told = SCENES[case]
    scene_file("time_s,force_N\n0,0\n1,0.1\n", "force.csv")
    refused(scene_file(text), told)


@pytest.mark.parametrize("refused", ["plan", "run"], indirect=True)
@pytest.mark.parametrize("case", ON_THE_BENCH)
def test_what_the_bench_cannot_do(refused, scene_file, case):
    text, told = ON_THE_BENCH[case]
    refused(scene_file(text), told)


@pytest.mark.parametrize("case", TABLES)
def test_a_bad_force_table(refused, scene_file, case):
    text, told = TABLES[case]
    scene_file(text, "force.csv")
    refused(scene_file(TABLE), f"force.csv.*{told}")


def test_a_missing_scene_and_a_folder(refused, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(tmp_path / "none.toml", "does not exist")
    refused(tmp_path, "folder")


def test_a_scene_that_may_not_be_read(refused, scene_file, monkeypatch):
    path = scene_file(PULSES)
    opened = type(path).open

    def denied(self, *args, **options):
        if self == path:
            raise PermissionError(13, "Permission denied")
        return opened(self, *args, **options)

    monkeypatch.setattr(type(path), "open", denied)
    refused(path, "cannot be read: Permission denied")


def test_a_bad_override(refused, scene_file):
    refused(scene_file(PULSES), "--set protocol.hold=2 V", "--set", "protocol.hold=2 V")
    refused(scene_file(PULSES), "--set hold=2 s", "--set", "hold=2 s")


def test_a_protocol_file_that_does_not_run(refused, scene_file):
    refused(scene_file("def :\n", "mine.py"), "mine.py.*SyntaxError")
    refused(scene_file("x = 1\n", "mine.py"), "mine.py.*subclass")
