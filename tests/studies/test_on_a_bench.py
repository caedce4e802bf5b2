"""A study on real instruments: a source at its own port, stopped, lost, resumed."""

import os
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from served_source import Source

from tactile_lab.acquisition.ending import Executed
from tactile_lab.cli import cli
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import LimitError
from tactile_lab.store.folder import read_info
from tactile_lab.studies.addresses import addresses
from tactile_lab.studies.carry_out import _missing, carry_out
from tactile_lab.studies.shelf import Shelf
from tactile_lab.studies.study import Study, load_study

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")
FORCES = ["40 mN", "60 mN", "80 mN"]


def asked(bench: Path, **more) -> Study:
    return load_study(
        {
            "scene": "demo",
            "on": "bench",
            "bench": str(bench),
            "set": {
                "record.signals": ["force"],
                "protocol.ramp": "20 ms",
                "protocol.hold": "50 ms",
                "protocol.rest": "50 ms",
            },
            "keep": {"pushed": "scene.protocol.levels[0]"},
            "axis": [{"key": "protocol.levels", "values": [[one] for one in FORCES]}],
            **more,
        }
    )


def ordered(study: Study) -> list[int]:
    return _missing(study, addresses(study), Shelf(Path("nowhere"))).tolist()


def test_one_that_is_stopped_goes_on_in_its_order_and_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    source = Source(tmp_path)
    study, played = asked(source.bench, seed=3), []

    def play(execution: Execution) -> Executed:
        (level,) = execution.scene.protocol.levels
        played.append(level)
        if len(played) == 2:
            execution.stop("STOP")
        done = execution.run()
        if len(played) == 4:
            raise LimitError("this one cannot be used")
        return done

    with pytest.raises(KeyboardInterrupt):
        carry_out(study, tmp_path / "out", play=play)
    found = carry_out(study, tmp_path / "out", play=play)
    source.served.close()
    assert not source.output
    order = [float(FORCES[n].split()[0]) / 1000 for n in ordered(study)]
    assert played == pytest.approx([*order[:2], *order[1:]])
    assert played != sorted(played)
    failed = ordered(study)[2]
    assert np.flatnonzero(found.reasons != "").tolist() == [failed]
    assert "cannot be used" in found.reasons[failed]
    runs = sorted((tmp_path / "out" / "study" / "runs").glob("2*"))
    states = [read_info(run)["status"] for run in runs]
    assert states.count("aborted") == 1 and states.count("complete") == 3


def test_one_whose_source_is_gone_stops_with_the_code_of_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    source = Source(tmp_path)
    source.served.close()
    file = tmp_path / "lost.toml"
    file.write_text(
        f'scene = "demo"\non = "bench"\nbench = "{source.bench}"\n'
        'set = {"record.signals" = ["force"]}\nkeep = ["spike_count"]\n'
        '[[axis]]\nkey = "protocol.hold"\nvalues = ["1 s", "2 s"]\n'
    )
    arguments = ["study", str(file), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 4, done.output
    assert (
        "cannot be opened" in done.stderr and "what was finished is kept" in done.stderr
    )
    assert len(list((tmp_path / "out" / "lost" / "runs").glob("2*"))) == 1


def test_blocks_hold_every_point_once(tmp_path: Path) -> None:
    bench = tmp_path / "bench.toml"
    bench.write_text(
        'name = "a"\nsimulated = false\n[coil]\ndialect = "kepco-bop"\n'
        'port = "socket://127.0.0.1:9"\n[magnet]\nr = "6 mm"\n'
    )
    one, other, plain = (
        ordered(asked(bench, repeat=3, order=order, seed=7))
        for order in ("blocked", "random", "as written")
    )
    blocks = np.array(one).reshape(3, 3) // 3
    assert all(sorted(block) == [0, 1, 2] for block in blocks.tolist())
    assert sorted(other) == plain == list(range(9)) and other != one != plain
