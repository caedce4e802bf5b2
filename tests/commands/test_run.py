"""``tactile-lab run`` as a person or a script meets it: another process."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest

from tactile_lab.store.run import Run

RUN = [sys.executable, "-m", "tactile_lab", "run", "--no-report"]
SHORT = [
    "--set", 'protocol.levels=["200 mN"]',
    "--set", "protocol.hold=0.8 s",
    "--set", "protocol.rest=0.3 s",
]  # fmt: skip
LONG = [
    "--realtime",
    "--set", 'protocol.levels=["100 mN"]',
    "--set", "protocol.hold=60 s",
]  # fmt: skip


def only_run(folder):
    (run,) = (folder / "runs").iterdir()
    return run


def test_json_is_one_object_with_every_documented_key(tmp_path):
    done = subprocess.run(
        [*RUN, *SHORT, "--json"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["status"] == "complete"
    assert found["spikes"] > 5
    assert found["loss"] == {"samples": 0, "spikes": 0}
    assert found["coil_verified_off"] is True
    assert (tmp_path / found["run"] / "run.json").is_file()
    assert set(found) == {
        "run", "status", "spikes", "loss", "duration_s", "run_time_s", "reason",
        "coil", "coil_verified_off", "report", "differences",
    }  # fmt: skip
    assert "\r" not in done.stderr, "a pipe gets plain lines, no bar"


def test_a_run_is_repeated_from_its_own_folder(tmp_path):
    for again in ([], ["--again", "runs/first"]):
        options = [*again, "--json"] if again else [*SHORT, "--json"]
        done = subprocess.run(
            [*RUN, *options], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        if not again:
            only_run(tmp_path).rename(tmp_path / "runs" / "first")
    found = json.loads(done.stdout)
    assert found["differences"]["results"] == []
    assert "demo" in found["run"]


def test_a_report_is_left_with_the_run(tmp_path):
    done = subprocess.run(
        [*RUN[:-1], *SHORT], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    run = only_run(tmp_path)
    for name in ("figure.png", "figure.svg", "report.html", "results.json"):
        assert (run / name).stat().st_size > 1000
    page = (run / "report.html").read_text()
    assert "http" not in re.sub(
        r'xmlns(:\w+)?="[^"]*"|http://www\.w3\.org\S*|'
        r"http://(purl|creativecommons)\S*|"
        r"https://matplotlib\S*",
        "",
        page,
    )
    assert "200 mN" in done.stdout
    assert "loss: 0 of" in done.stdout


@pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_the_run_safely_and_keeps_the_data(tmp_path, name):
    number = getattr(signal, name)
    with subprocess.Popen(
        [*RUN, *LONG, "--json"], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        wait_for_samples(tmp_path, process)
        process.send_signal(number)
        out, err = process.communicate(timeout=30)
    assert process.returncode == 128 + number, err
    assert "Traceback" not in err
    found = json.loads(out)
    assert found["status"] == "aborted"
    assert found["coil_verified_off"] is True
    assert name in found["reason"]
    with Run.load(only_run(tmp_path)) as run:
        assert run.info["status"] == "aborted"
        assert len(run.signal("V_K")) > 0


@pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
def test_impatience_does_not_leave_the_coil_live(tmp_path):
    with subprocess.Popen(
        [*RUN, *LONG, "--json"], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        wait_for_samples(tmp_path, process)
        for _ in range(4):
            process.send_signal(signal.SIGINT)
            time.sleep(0.02)
        out, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert json.loads(out)["coil_verified_off"] is True


def wait_for_samples(folder, process):
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None:
        for file in folder.glob("runs/*/data.h5"):
            if file.stat().st_size > 300_000:
                return
        time.sleep(0.1)
    pytest.fail(f"no samples came: {process.stderr.read()}")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "protocol.hold=2 V"], ["protocol", "hold", "2 V"]),
        (["--set", 'protocol.levels=["900 mN"]'], ["900 mN", "reachable"]),
        (["--set", "record.sample_rat=1 MS/s"], ["sample_rat", "sample_rate"]),
        (["--note", "nonsense"], ["nonsense"]),
        (["--out", "/proc/nowhere"], ["/proc/nowhere"]),
        (["missing.toml"], ["missing.toml"]),
    ],
)
def test_refusals_are_one_message_and_write_nothing(tmp_path, arguments, words):
    done = subprocess.run(
        [*RUN, *arguments], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []
