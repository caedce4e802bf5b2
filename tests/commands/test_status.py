"""A run tells other programs how it goes, and takes their stop."""

import json
import re
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from tactile_lab.acquisition import events
from tactile_lab.commands.status_server import MOST_PROGRAMS, UNREAD, StatusServer
from tactile_lab.errors import SceneError

HOW_TO = Path(__file__).parents[2] / "docs/how-to/work-with-other-programs.md"


@pytest.fixture
def stopped():
    return []


@pytest.fixture
def server(stopped):
    served = StatusServer("tcp://127.0.0.1:0", stopped.append)
    yield served
    served.close()


def connected(server):
    host, port = server.address.removeprefix("tcp://").split(":")
    return socket.create_connection((host, int(port)), timeout=60)


def stopped_by(number, folder, *given, level="60 mN", rate="20 kS/s", asked=()):
    """A run that the how-to's client `number` stops: its result, what the client said.

    The client is given the status address, the source of LSL's streams where `asked`
    for, and what is `given`.
    """
    clients = re.findall(r"```python\n(.*?)```", HOW_TO.read_text(), flags=re.S)
    (folder / "client.py").write_text(clients[number])
    verb = [sys.executable, "-m", "tactile_lab", "run", "demo", "--realtime", "--json"]
    verb += ["--status", "tcp://127.0.0.1:0", "--out", str(folder / "runs"), *asked]
    verb += ["--set", "protocol.hold=40 s", "--set", f'protocol.levels=["{level}"]']
    verb += ["--set", f"record.sample_rate={rate}", "--no-report"]
    with subprocess.Popen(
        verb, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        told = (line.split() for line in run.stderr)
        where = [
            words[-1] for words, _ in zip(told, ["status", *asked[1:]], strict=False)
        ]
        watched = subprocess.run(
            [sys.executable, folder / "client.py", *where, *given],
            capture_output=True,
            text=True,
            check=True,
        )
        out, _ = run.communicate()
    assert run.returncode == 130
    result = json.loads(out)
    assert result["status"] == "aborted"
    assert result["reason"] == "stopped by another program"
    assert result["coil_verified_off"]
    return result, watched.stdout


def test_the_client_of_the_how_to_watches_a_run_and_stops_it(tmp_path):
    result, said = stopped_by(0, tmp_path, "0.5")
    assert f"aborted in {result['run']}" in said


def test_the_subscriber_of_the_how_to_stops_pressing_after_the_tenth_spike(tmp_path):
    result, said = stopped_by(
        1, tmp_path, level="200 mN", rate="1 MS/s", asked=("--live", "lsl")
    )
    *heard, last = said.splitlines()
    numbers = [int(line.split()[1]) for line in heard]
    assert numbers == list(range(numbers[0], max(11, numbers[0] + 1))), "misses none"
    assert last == f"stopped after {result['spikes']} spikes"
    # spikes come every few tens of ms; the coil is ramped to zero meanwhile
    assert 10 <= result["spikes"] < 100


def test_who_comes_late_hears_the_newest_state_first(server):
    for text in ("opening instruments", "running"):
        server(events.StateChanged(events.RunState.RUNNING, text))
    server(events.Progress(1.0, 10.0))
    with connected(server) as link, link.makefile() as lines:
        assert json.loads(next(lines))["text"] == "running"
        assert json.loads(next(lines)) == {
            "event": "progress",
            "elapsed_s": 1.0,
            "expected_s": 10.0,
        }


def test_who_comes_late_hears_nothing_of_the_run_before(server):
    """Of a sequence: the result of a run that ended came after the next one's state."""
    server.begin(SimpleNamespace(documented={"event": "begun", "run": "a"}))
    server(events.Progress(1.0, 10.0))
    server.end({"run": "a"})
    server.begin(SimpleNamespace(documented={"event": "begun", "run": "b"}))
    server(events.StateChanged(events.RunState.RUNNING, ""))
    with connected(server) as link:
        lines = link.makefile()
        told = [json.loads(next(lines)) for _ in range(2)]
    assert [line["event"] for line in told] == ["begun", "state"]
    assert told[0]["run"] == "b"


def test_an_address_of_ipv6_is_told_as_one():
    try:
        served = StatusServer("tcp://[::1]:0", print)
    except SceneError:
        pytest.skip("this computer has no IPv6")
    try:
        assert served.address.startswith("tcp://[::1]:")
    finally:
        served.close()


@pytest.mark.parametrize(
    "said", [b"stop\n", b"[]\n", b'{"do": "start"}\n', b"\xff\n", b"[" * 4000 + b"\n"]
)
def test_what_is_no_request_is_refused_and_does_nothing(server, stopped, said):
    with connected(server) as link, link.makefile() as lines:
        link.sendall(said)
        assert json.loads(next(lines))["event"] == "refused"
        link.sendall(b'{"do": "stop"}\n')
        assert json.loads(next(lines))["event"] == "stopping"
    assert stopped == ["stopped by another program"]


def test_an_endless_line_ends_that_client_alone(server):
    with connected(server) as endless, connected(server) as other:
        endless.sendall(b"x" * 10_000)
        assert endless.recv(1000) == b""
        other.sendall(b"?\n")
        assert b"refused" in other.recv(1000)


def test_a_client_that_does_not_read_is_let_go_of_and_delays_nobody(server):
    text = "x" * 10_000
    with connected(server) as deaf, connected(server) as other:
        deaf.sendall(b"?\n")
        assert b"refused" in deaf.recv(1000)  # it is served now
        other.sendall(b"?\n")
        heard = other.makefile("rb")
        assert b"refused" in heard.readline()
        for _ in range(40 * UNREAD // len(text)):
            server(events.Message("info", text))
            assert len(heard.readline()) > len(text)
        with pytest.raises(OSError):
            while deaf.recv(1 << 20):
                pass
            raise ConnectionResetError  # closed is gone, too


@pytest.mark.parametrize(
    "address", ["5025", "udp://127.0.0.1:1", "tcp://:5", "tcp://127.0.0.1", "tcp://a:x"]
)
def test_an_address_that_is_none_is_refused(address):
    with pytest.raises(SceneError, match=r"write tcp://HOST:PORT"):
        StatusServer(address, str)


def test_a_port_that_is_taken_is_refused_before_anything_is_opened(
    tactile_lab, server, tmp_path
):
    answer = tactile_lab("run", "--status", server.address, "--out", tmp_path / "runs")
    assert answer.code == 2
    assert "cannot be listened at" in answer.err
    assert not (tmp_path / "runs").exists()


def test_so_many_programs_may_watch_and_a_place_becomes_free(server):
    links = [connected(server) for _ in range(MOST_PROGRAMS)]
    for link in links:
        link.sendall(b"are you there\n")
        assert link.recv(4096)
    with connected(server) as late, late.makefile() as lines:
        told = [json.loads(line) for line in lines]
    assert [one["event"] for one in told] == ["refused"]
    assert f"{MOST_PROGRAMS} programs" in told[0]["text"]
    links[0].close()
    while True:  # its place is free once the server has noticed
        with connected(server) as link, link.makefile() as lines:
            link.sendall(b'{"do": "start"}\n')
            if "programs" not in json.loads(next(lines))["text"]:
                break
    for link in links:
        link.close()


def test_one_that_never_stops_talking_is_let_go_of(server, capfd):
    flood = b'{"do": "nothing"}\n' * 100_000
    with connected(server) as link:
        with pytest.raises(OSError, match=r"reset|pipe"):
            while True:
                link.sendall(flood)
    server(events.StateChanged(events.RunState.RUNNING, "on"))
    with connected(server) as other, other.makefile() as lines:
        assert json.loads(next(lines))["text"] == "on"
    server.close()
    assert capfd.readouterr().err == ""
