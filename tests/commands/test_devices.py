"""``devices`` and ``doctor`` as a user meets them."""

import json
import subprocess
import sys

import pytest

from sim_backend.serve import ServedBench


def tactile_lab(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "tactile_lab", *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


@pytest.fixture(scope="module")
def coil():
    bench = ServedBench(coil="tcp:0")
    bench.start()
    yield bench.addresses["coil"]
    bench.close()


def test_devices_tells_what_answers(coil):
    done = tactile_lab("devices", "--port", coil, "--json")
    assert done.returncode == 0
    (found,) = json.loads(done.stdout)["devices"]
    assert found["fits"] == ["kepco-bop"] and found["identity"].startswith("KEPCO")


def test_devices_tries_out_and_writes_the_transcript(coil, tmp_path):
    path = tmp_path / "talk.txt"
    done = tactile_lab(
        "devices", "--port", coil, "--dialect", "kepco-bop", "--transcript", str(path)
    )
    assert done.returncode == 0, done.stderr
    assert "KEPCO" in done.stdout and "off" in done.stdout
    assert '> "*IDN?\\n"' in path.read_text()


@pytest.mark.parametrize(
    ("arguments", "code", "why"),
    [
        (["--dialect", "kepco-bop"], 2, "exactly one --port"),
        (["--transcript", "x.txt"], 2, "need --dialect"),
        (["--port", "COIL", "--dialect", "kepko"], 2, "kepco-bop"),
        (["--port", "COIL", "--dialect", "keithley-2400"], 3, "Name the right row"),
        (["--port", "/dev/nowhere", "--dialect", "kepco-bop"], 3, "plugged in"),
    ],
)
def test_devices_refuses_in_one_message(coil, arguments, code, why):
    done = tactile_lab("devices", *(coil if a == "COIL" else a for a in arguments))
    assert done.returncode == code
    assert why in done.stderr and "Traceback" not in done.stderr
    assert done.stdout == ""


def test_doctor_as_json(tmp_path):
    done = tactile_lab("doctor", "--out", str(tmp_path), "--json")
    told = json.loads(done.stdout)
    assert done.returncode == (1 if told["problems"] else 0)
    assert {"topic", "state", "text", "remedy"} == set(told["findings"][0])


def test_doctor_says_what_to_do_about_a_slow_disk(tmp_path):
    done = tactile_lab("doctor", "--out", str(tmp_path), "--rate", "1e15")
    assert done.returncode == 1
    assert "remedy: store runs on a faster disk" in done.stdout


def test_a_run_writes_its_transcripts(tmp_path):
    done = tactile_lab(
        *("run", "--out", str(tmp_path / "runs"), "--no-report", "--json"),
        *("--set", 'protocol.levels=["80 mN"]', "--set", "protocol.hold=0.2 s"),
        *("--set", "record.sample_rate=0.1 MS/s"),
        *("--transcript", str(tmp_path / "talk")),
    )
    assert done.returncode == 0, done.stderr
    lines = (tmp_path / "talk" / "coil.txt").read_text().splitlines()
    assert any('> "OUTP 1;' in line for line in lines)
    assert lines[-1].endswith('0,\\"No error\\"\\r\\n"')


BENCH = """
simulated = {simulated}
[coil]
dialect = "{dialect}"
port = "{port}"
[coil.limits]
current = "{current}"
[field_meter]
port = "/dev/ttyUSB1"
[magnet]
r = "6 mm"
"""


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"port": "/dev/ttyUSB1"}, "both have port"),
        ({"current": "6 A"}, "beyond the 5 A of Kepco"),
        ({"dialect": "kepko-bop"}, 'did you mean "kepco-bop"'),
        ({"port": "sim://x"}, "real instruments need one"),
    ],
)
def test_a_bench_that_cannot_be_is_refused_before_anything_is_opened(
    tmp_path, change, why
):
    fine = {
        "simulated": "false",
        "dialect": "kepco-bop",
        "port": "COM3",
        "current": "2 A",
    }
    (tmp_path / "bench.toml").write_text(BENCH.format(**(fine | change)))
    (tmp_path / "scene.toml").write_text(
        '[protocol]\nname = "pulses"\n[record]\nsignals = ["force", "field"]\n'
    )
    for verb in ("plan", "run"):
        done = tactile_lab(
            verb, str(tmp_path / "scene.toml"), "--bench", str(tmp_path / "bench.toml")
        )
        assert done.returncode == 2, done.stderr
        assert why in done.stderr and "Traceback" not in done.stderr
