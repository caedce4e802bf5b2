"""The documented interface is the one there is: examples load, keys are all named."""

import json
import re
from pathlib import Path

import pytest

from tactile_lab.cli import main
from tactile_lab.complaint import known_keys
from tactile_lab.deviation import Deviation
from tactile_lab.model.state import Start
from tactile_lab.plugins import protocol_class, protocol_names, scene_names
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.scene.load import load, load_bench
from tactile_lab.scene.sensor import Sensor
from tactile_lab.scene.tables import CoilUse, Conditions, Detect, Record, Simulated
from tactile_lab.signals import SIGNALS

DOCS = Path(__file__).parents[2] / "docs"
SCENES = (DOCS / "scenes.md").read_text(encoding="utf-8")
JSON = (DOCS / "json.md").read_text(encoding="utf-8")
PROTOCOLS = (DOCS / "protocols.md").read_text(encoding="utf-8")
BLOCKS = re.findall(
    r"```toml\n# (scene|bench)\n(.*?)```", SCENES + PROTOCOLS, re.DOTALL
)


def test_every_toml_block_says_what_it_is():
    assert len(BLOCKS) == (SCENES + PROTOCOLS).count("```toml") >= 5


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_an_example_loads(number, tmp_path):
    kind, text = BLOCKS[number]
    (tmp_path / "force.csv").write_text("time_s,force_N\n0,0\n1,0.1\n")
    path = tmp_path / "example.toml"
    path.write_text(text, encoding="utf-8")
    if kind == "scene":
        assert load(path).bench.simulated
    else:
        bench = load_bench(path)
        assert not bench.simulated
        assert [c.scale for c in bench.scope.channels] == [1.0, 1.0, 10.0]


@pytest.mark.parametrize(
    "table", [Record, Detect, Simulated, Deviation, CoilUse, Conditions, Sensor]
)
def test_every_key_of_a_table_is_documented(table):
    assert [key for key in known_keys(table, ()) if f"`{key}`" not in SCENES] == []


@pytest.mark.parametrize("name", protocol_names())
def test_every_parameter_of_a_protocol_is_in_its_section_or_the_shared_one(name):
    shared, *sections = re.split(r"^## `", PROTOCOLS, flags=re.MULTILINE)
    (own,) = (s for s in sections if s.startswith(f"{name}`"))
    parameters = protocol_class(name).parameters()
    assert [key for key in parameters if f"`{key}`" not in shared + own] == []


def test_every_scene_that_ships_is_listed():
    assert [name for name in scene_names() if f"`{name}`" not in PROTOCOLS] == []


def test_every_key_of_a_bench_file_is_in_the_example():
    bench = next(text for kind, text in BLOCKS if kind == "bench")
    named = set(re.findall(r"^(?:# )?\[*([a-z_.A-Z0-9]+)", bench, re.MULTILINE))
    parts = {part for name in named for part in name.split(".")}
    for at in (
        (),
        ("coil",),
        ("coil", "limits"),
        ("scope",),
        ("scope", "channels"),
        ("field_meter",),
        ("voltage_source",),
        ("voltage_source", "V_GS"),
        ("voltage_source", "V_GS", "limits"),
        ("magnet",),
        ("followers",),
        ("hand_set",),
    ):
        missing = set(known_keys(BenchSpec, at)) - parts
        elsewhere = {"file", "simulated", "calibration", "dialect"}
        assert missing <= elsewhere, (at, missing)


def test_every_signal_and_start_voltage_is_documented():
    assert [name for name in SIGNALS if f"`{name}`" not in SCENES] == []
    assert all(name in SCENES for name in known_keys(Start, ()))


def test_the_documented_defaults_are_the_defaults():
    circuit = load().circuit
    rows = re.findall(r"`(\w+)` \| [^|]*\| ([0-9.e-]+)[^|]*(?=\|)", SCENES)
    seen = {name: float(value) for name, value in rows if hasattr(circuit, name)}
    assert len(seen) >= 20
    assert {name: getattr(circuit, name) for name in seen} == pytest.approx(seen)


def test_the_python_example_runs(tmp_path, monkeypatch):
    code = re.search(r"```python\n(.*?)```", SCENES, re.DOTALL).group(1)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "docs/scenes.md", "exec"), {})
    assert load(tmp_path / "resolved.toml").protocol.hold == 1.0


@pytest.mark.parametrize("verb", ["simulate", "plan"])
def test_every_json_key_is_documented(verb, capsys):
    with pytest.raises(SystemExit):
        main([verb, "demo", "--json"])
    section = JSON.split(f"## `tactile-lab {verb}")[1].split("\n## ")[0]
    for key, value in json.loads(capsys.readouterr().out).items():
        assert f"`{key}`" in section
        if isinstance(value, dict) and key != "resolution":
            missing = [inner for inner in value if f"`{inner}`" not in section]
            assert missing == []
