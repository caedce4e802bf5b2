"""Protocols, scenes and dialects are found by name, never by import."""

import os
import subprocess
import sys

import pytest

from tactile_lab.errors import SceneError, nearest
from tactile_lab.instruments.registry import coil_capability
from tactile_lab.planning.timeline import timeline
from tactile_lab.plugins import (
    protocol_class,
    protocol_from_file,
    protocol_names,
    scene_names,
)
from tactile_lab.scene.bench_file import CoilSpec
from tactile_lab.scene.load import load

GOOD = """
from typing import ClassVar
from tactile_lab.trial import Protocol

class Mine(Protocol):
    name: ClassVar[str] = "mine"
    title: ClassVar[str] = "Mine"
"""


@pytest.mark.parametrize("name", protocol_names())
def test_every_protocol_is_found_by_its_name(name):
    assert protocol_class(name).name == name


@pytest.mark.parametrize("name", scene_names())
def test_every_shipped_scene_loads_and_stays_on_the_simulated_bench(name):
    assert load(name).bench.simulated


def test_names_are_listed_without_importing():
    code = (
        "import sys; from tactile_lab.plugins import protocol_names; protocol_names()\n"
        "assert 'protocols.pulses' not in sys.modules and 'numpy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_file_is_a_protocol_if_it_holds_one_of_its_name(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(GOOD)
    assert protocol_from_file(path).title == "Mine"
    path.write_text(GOOD.replace('"mine"', '"other"'))
    with pytest.raises(SceneError, match="mine"):
        protocol_from_file(path)


def test_a_field_may_be_a_list_as_well_as_a_tuple(tmp_path):
    path = tmp_path / "mine.py"
    fields = "    levels: list[float] = [0.1]\n    holds: tuple[float, ...] = (1.0,)\n"
    path.write_text(GOOD + fields)
    scene = load(str(path), {"protocol.levels": [0.2, 0.3], "protocol.holds": [2.0]})
    assert scene.protocol.model_dump() == {"levels": [0.2, 0.3], "holds": (2.0,)}


def test_a_file_runs_as_it_is_now_and_leaves_nothing_beside_it(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    path = tmp_path / "mine.py"
    for title in ("Mine", "Main"):  # as long, and of the same instant
        path.write_text(GOOD.replace('"Mine"', f'"{title}"'))
        os.utime(path, (1e9, 1e9))
        assert protocol_from_file(path).title == title
    assert list(tmp_path.iterdir()) == [path]


def test_a_users_file_never_shadows_ours(tmp_path):
    path = tmp_path / "pulses.py"
    path.write_text(GOOD.replace('"mine"', '"pulses"'))
    assert protocol_from_file(path).title == "Mine"
    assert protocol_class("pulses").title == "Pulses"


@pytest.mark.parametrize(
    "text", ["import nothing_of_that_name", "1 +", "raise SystemError"]
)
def test_a_file_that_fails_is_refused_in_words(tmp_path, text):
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(SceneError, match="does not run"):
        protocol_from_file(path)


def test_nearest():
    assert nearest("hodl", ["hold", "ramp"]) == 'did you mean "hold"?'
    assert nearest("v_c1", ["V_C1"]) == 'did you mean "V_C1"?'
    assert nearest("xyz", ["hold"]) == ""


def test_a_faster_line_updates_faster():
    slow = coil_capability(CoilSpec(baud=9600)).update_interval
    fast = coil_capability(CoilSpec(baud=19200)).update_interval
    assert 0.02 < fast < slow < 0.2


def test_a_protocol_that_raises_is_told_with_file_and_line(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(GOOD + "    def trials(self):\n        yield 1 / 0\n")
    with pytest.raises(SceneError, match=r"mine\.py, line 9: ZeroDivisionError"):
        timeline(load(file), through_coil=True)
    file.write_text(GOOD + "\n\nnonsense\n")
    with pytest.raises(SceneError, match=r"does not run: NameError: .* \(line 10\)"):
        load(file)
