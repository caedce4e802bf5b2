"""``devices`` and ``doctor`` as a user meets them."""

import json

import pytest

from sim_backend.serve import ServedBench


@pytest.fixture(scope="module")
def coil():
    bench = ServedBench(coil="tcp:0")
    bench.start()
    yield bench.addresses["coil"]
    bench.close()


def test_devices_tells_what_answers(tactile_lab, coil):
    done = tactile_lab("devices", "--port", coil, "--json")
    assert done.code == 0
    (found,) = json.loads(done.out)["devices"]
    assert found["fits"] == ["kepco-bop"] and found["identity"].startswith("KEPCO")


def test_devices_sends_nothing_where_it_must_not_ask(tactile_lab, coil):
    done = tactile_lab("devices", "--no-ask", "--port", coil, "--json")
    (found,) = done.json["devices"]
    assert found["identity"] is None and not found["fits"]


def test_devices_tries_out_and_writes_the_transcript(tactile_lab, coil, tmp_path):
    path = tmp_path / "talk.txt"
    done = tactile_lab(
        "devices", "--port", coil, "--dialect", "kepco-bop", "--transcript", str(path)
    )
    assert done.code == 0, done.err
    assert "KEPCO" in done.out and "off" in done.out
    assert '> "*IDN?\\n"' in path.read_text()


def test_what_is_read_back_is_numbers_where_it_is_numbers(tactile_lab, coil):
    """All were texts: "compliance_V": "1"."""
    words = ("devices", "--port", coil, "--dialect", "kepco-bop", "--json")
    found = tactile_lab(*words).json
    assert all(
        isinstance(found[name], float) for name in ("compliance_V", "setpoint_A")
    )
    assert found["update_interval_s"] > 0
    assert isinstance(found["baud"], int)
    assert found["output"] is False
    assert "OUTP 1" in found["not_tried"] and isinstance(found["not_tried"], list)
    assert isinstance(found["identity"], str)


@pytest.mark.parametrize(
    ("arguments", "code", "why"),
    [
        (["--dialect", "kepco-bop"], 2, "exactly one --port"),
        (["--port", "COIL", "--dialect", "kepco-bop", "--no-ask"], 2, "--no-ask"),
        (["--transcript", "x.txt"], 2, "need --dialect"),
        (["--port", "COIL", "--dialect", "kepko"], 2, "kepco-bop"),
        (["--port", "COIL", "--dialect", "keithley-2400"], 3, "Name the right row"),
        (["--port", "/dev/nowhere", "--dialect", "kepco-bop"], 3, "plugged in"),
    ],
)
def test_devices_refuses_in_one_message(tactile_lab, coil, arguments, code, why):
    done = tactile_lab("devices", *(coil if a == "COIL" else a for a in arguments))
    assert done.code == code
    assert why in done.err and "Traceback" not in done.err
    assert done.out == ""


def test_doctor_as_json(tactile_lab, tmp_path):
    done = tactile_lab("doctor", "--out", str(tmp_path), "--json")
    told = json.loads(done.out)
    assert done.code == (1 if told["problems"] else 0)
    assert {"topic", "state", "text", "remedy"} == set(told["findings"][0])


def test_doctor_says_what_to_do_about_a_slow_disk(tactile_lab, tmp_path):
    done = tactile_lab("doctor", "--out", str(tmp_path), "--rate", "1e15")
    assert done.code == 1
    assert "remedy: store runs on a faster disk" in done.out


def test_a_run_writes_its_transcripts(tactile_lab, tmp_path):
    done = tactile_lab(
        *("run", "--out", str(tmp_path / "runs"), "--no-report", "--json"),
        *("--set", 'protocol.levels=["80 mN"]', "--set", "protocol.hold=0.2 s"),
        *("--set", "record.sample_rate=0.1 MS/s"),
        *("--transcript", str(tmp_path / "talk")),
    )
    assert done.code == 0, done.err
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
    tactile_lab, tmp_path, change, why
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
        assert done.code == 2, done.err
        assert why in done.err and "Traceback" not in done.err
