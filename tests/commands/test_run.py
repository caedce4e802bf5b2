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

RUN = [sys.executable, "-m", "tactile_lab", "run"]
SHORT = [
    "--set", 'protocol.levels=["200 mN"]',
    "--set", "protocol.hold=0.8 s",
    "--set", "protocol.rest=0.3 s",
]  # fmt: skip
LONG = [
    "--no-report",
    "--json",
    "--set", 'protocol.levels=["100 mN"]',
    "--set", "protocol.hold=3000 s",
    "--set", 'record.signals=["V_K"]',
    "--set", "record.sample_rate=0.2 MS/s",
]  # fmt: skip
"""Minutes of work on the simulated clock, whatever else the computer does."""

PATIENCE = 100
"""Longest wait for what a busy machine does late, s."""


def only_run(folder):
    (run,) = (folder / "runs").iterdir()
    return run


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """One run of the whole program in a pipe: where, and what it printed."""
    folder = tmp_path_factory.mktemp("finished")
    done = subprocess.run(
        [*RUN, *SHORT, "--json"], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return folder, done


def test_json_is_one_object_with_every_documented_key(finished):
    folder, done = finished
    found = json.loads(done.stdout)
    assert found["status"] == "complete"
    assert found["spikes"] > 5
    assert found["loss"] == {"samples": 0, "spikes": 0}
    assert found["coil_verified_off"] is True
    assert (folder / found["run"] / "run.json").is_file()
    assert set(found) == {
        "run", "status", "spikes", "loss", "duration_s", "run_time_s", "reason",
        "coil", "coil_verified_off", "report", "differences",
    }  # fmt: skip
    assert "\r" not in done.stderr, "a pipe gets plain lines, no bar"


def test_a_report_is_left_with_the_run(finished):
    run = only_run(finished[0])
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


def test_a_run_is_repeated_from_its_own_folder(finished, tactile_lab, tmp_path):
    options = ["--again", only_run(finished[0]), "--out", tmp_path]
    warmer = "conditions.temperature=23.5 °C"
    answer = tactile_lab("run", *options, "--set", warmer, "--no-report")
    assert answer.code == 0, answer.err
    assert "results: the same" in answer.out
    assert "temperature.K was not there, is 296.65" in answer.out
    assert "loss: 0 of" in tactile_lab("show", *tmp_path.iterdir()).out
    assert "demo" in next(tmp_path.iterdir()).name


@pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
def test_a_signal_ends_the_run_safely_and_keeps_the_data(tmp_path):
    # the other signals, on a source of its own: test_run_on_served_source
    with subprocess.Popen(
        [*RUN, *LONG], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        wait_for_samples(tmp_path, process)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 143, err
    assert "Traceback" not in err
    found = json.loads(out)
    assert found["status"] == "aborted"
    assert found["coil_verified_off"] is True
    assert "SIGTERM" in found["reason"]
    with Run.load(only_run(tmp_path)) as run:
        assert run.info["status"] == "aborted"
        assert len(run.signal("V_K")) > 0


@pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
def test_impatience_does_not_leave_the_coil_live(tmp_path):
    with subprocess.Popen(
        [*RUN, *LONG], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        wait_for_samples(tmp_path, process)
        for _ in range(4):
            process.send_signal(signal.SIGINT)
            time.sleep(0.02)
        _, err = process.communicate(timeout=PATIENCE)
    # one that comes when all is over ends what is left, as a signal does
    assert process.returncode in (130, -signal.SIGINT), err
    info = json.loads((only_run(tmp_path) / "run.json").read_text())
    assert info["status"] == "aborted"
    assert info["coil_verified_off"] is True


def wait_for_samples(folder, process):
    deadline = time.monotonic() + PATIENCE
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
def test_refusals_are_one_message_and_write_nothing(
    tactile_lab, tmp_path, monkeypatch, arguments, words
):
    monkeypatch.chdir(tmp_path)
    answer = tactile_lab("run", *arguments)
    assert answer.code == 2, answer.err
    assert "Traceback" not in answer.err
    for word in words:
        assert word in answer.err
    assert answer.out == ""
    assert list(tmp_path.iterdir()) == []


def test_transcripts_that_cannot_be_put_there_leave_no_run(tactile_lab, tmp_path):
    (tmp_path / "file").touch()
    where = ("--out", tmp_path / "runs", "--transcript", tmp_path / "file" / "talk")
    refused = tactile_lab("run", "v_c1_only", *where)
    assert refused.code == 2
    assert "Transcripts cannot be put into" in refused.err
    assert not (tmp_path / "runs").exists()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a file of Linux")
@pytest.mark.parametrize("how", [["--json"], []])
def test_what_cannot_be_printed_is_an_error_and_the_run_is_kept(how, tmp_path):
    """A script that kept the object on a full disk was told that all was well."""
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*RUN, *SHORT, "--no-report", *how],
            cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert "No space left on device" in done.stderr
    assert "The run is kept in" in done.stderr
    with Run.load(only_run(tmp_path)) as run:
        assert run.status == "complete"
