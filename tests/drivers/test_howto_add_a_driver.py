"""The how-to page on adding a driver: its code runs as printed."""

from __future__ import annotations

import glob
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from voltages import Voltages

from drivers.usbtmc.scope import UsbtmcScope
from sim_backend.usbtmc.bus import SimulatedBus
from sim_backend.usbtmc.device import SimulatedDevice
from sim_backend.usbtmc.function import INTERFACE, UsbtmcFunction
from sim_backend.usbtmc.rigol_ds1000z import SimulatedDs1000z
from tactile_lab.cli import main
from tactile_lab.clock import SimulatedClock
from tactile_lab.engine.bench import open_bench
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import LimitError, NotFoundError, SceneError
from tactile_lab.instruments.dialects import scope_dialect
from tactile_lab.planning.needs import needs
from tactile_lab.planning.plan import plan
from tactile_lab.report.from_run import read
from tactile_lab.report.write import write
from tactile_lab.scene.load import load
from tactile_lab.scope import Channel
from tactile_lab.store.run import Run

SLOW = {
    "record.sample_rate": 20e3,
    "protocol.hold": 0.2,
    "protocol.rest": 0.1,
}

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "add-a-driver.md"


def blocks(language: str) -> list[str]:
    text = PAGE.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def example() -> dict[str, Any]:
    names: dict[str, Any] = {}
    for number, code in enumerate(blocks("python"), start=1):
        exec(compile(code, f"{PAGE.name}, block {number}", "exec"), names)
    return names


@pytest.mark.parametrize("name", [n for n in example() if n.startswith("test_")])
def test_the_example(name: str) -> None:
    example()[name]()


def test_the_example_has_tests() -> None:
    assert len([n for n in example() if n.startswith("test_")]) == 3


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder outside the checkout, with the page's files in it."""
    for language in ("python", "toml"):
        for text in blocks(language):
            name, _, _ = text.removeprefix("# ").partition("\n")
            if text.startswith("# ") and name.endswith((".py", ".toml")):
                (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_scope_in_a_users_folder_runs_from_plan_to_verify(desk: Path) -> None:
    """The page's own commands, with the page's own files."""
    (commands,) = blocks("sh")
    for line in commands.splitlines():
        program, *arguments = shlex.split(line)
        arguments = [found for one in arguments for found in glob.glob(one) or [one]]
        assert program == "tactile-lab"
        with pytest.raises(SystemExit) as end:
            main(arguments)
        assert end.value.code == 0, line
    (folder,) = (desk / "runs").iterdir()
    with Run.load(folder) as run:
        assert run.info["instruments"]["scope"]["identity"] == "Acme S2 simulated"
        voltage = run.signal("V_C1")
        assert len(voltage) > 1000 and np.ptp(voltage[:]) > 0.1
    assert (folder / "inputs" / "my_scope.py").exists()


def test_its_mistakes_are_refused_in_words(desk: Path) -> None:
    bench = desk / "desk.toml"
    text = bench.read_text(encoding="utf-8")
    for old, new, told in (
        ("my_scope.py", "your_scope.py", "your_scope.py does not exist"),
        ("my_scope.py", "ps300a", 'did you mean "ps3000a"'),
        ("my_scope.py", "usbtmd", 'did you mean "usbtmc"'),
        ("{ address =", "{ adress =", 'no key "adress".*did you mean "address"'),
        ('input = "1"', 'input = "3"', "the scope has 1, 2"),
        ('range = "5 V"', 'range = "2 V"', "none of the scope's: 1, 5 V"),
    ):
        assert old in text
        bench.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises((SceneError, LimitError), match=told):
            plan(load("v_c1_only", ("record.sample_rate=50 kS/s",), str(bench)))
    bench.write_text(text, encoding="utf-8")
    with pytest.raises(LimitError, match="beyond the scope's 1e"):
        plan(load("v_c1_only", ("record.sample_rate=2 MS/s",), str(bench)))


def test_a_file_without_a_driver_of_its_kind_is_refused(desk: Path) -> None:
    (desk / "my_scope.py").write_text("x = 1\n")
    with pytest.raises(SceneError, match=r"must hold one ScopeDriver.*holds 0"):
        plan(load("v_c1_only", (), "desk.toml"))
    (desk / "my_scope.py").write_text("import nothing_of_that_name\n")
    with pytest.raises(SceneError, match=r"Driver file .*my_scope\.py does not run"):
        plan(load("v_c1_only", (), "desk.toml"))


def test_on_a_real_bench_it_is_made_by_itself(desk: Path) -> None:
    bench = desk / "desk.toml"
    text = bench.read_text(encoding="utf-8").replace("simulated = true", "# real")
    text = text.replace("[coil]", '[coil]\nport = "/dev/ttyUSB7"')
    bench.write_text(text, encoding="utf-8")
    scene = load("v_c1_only", ("record.sample_rate=50 kS/s",), str(bench))
    with pytest.raises(NotFoundError, match="Install Acme's library"):
        open_bench(scene, needs(scene))


def test_a_meter_in_a_users_folder_needs_no_port(desk: Path) -> None:
    parts = [text for text in blocks("python") if "UsbTeslameter" in text]
    code = [text for text in parts if "def test_" not in text]
    (desk / "gm1.py").write_text("\n".join(code), encoding="utf-8")
    (desk / "meter.toml").write_text(
        'name = "desk 5"\n[coil]\nport = "/dev/ttyUSB7"\n'
        '[field_meter]\ndriver = "gm1.py"\n[magnet]\nr = "6 mm"\n',
        encoding="utf-8",
    )
    field = 'record.signals=["force", "field"]'
    scene = load("demo", (field,), "meter.toml")
    bench = open_bench(scene, needs(scene))
    assert type(bench.field_meter).__name__ == "UsbTeslameter"
    assert bench.scope is None and not bench.simulated
    scene = load("demo", (field, "bench.simulated=true"), "meter.toml")
    with pytest.raises(SceneError, match=r"gm1\.py.* has no simulated far end"):
        open_bench(scene, needs(scene))


def test_an_installed_distribution_brings_a_driver(desk: Path) -> None:
    """An entry point of another distribution, in a process of its own."""
    metadata = desk / "acme_lab-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: acme-lab\n")
    (metadata / "entry_points.txt").write_text(
        "[tactile_lab.drivers]\nscope.acme-s2 = my_scope:DRIVER\n"
    )
    bench = desk / "desk.toml"
    text = bench.read_text(encoding="utf-8").replace("my_scope.py", "acme-s2")
    bench.write_text(text, encoding="utf-8")
    code = (
        "from tactile_lab.scene.load import load\n"
        "from tactile_lab.instruments.registry import scope_capability\n"
        "print(scope_capability(load('v_c1_only', (), 'desk.toml').bench.scope).bits)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(desk)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.strip() == "12", done.stderr


def test_the_row(tmp_path: Path) -> None:
    (row,) = (text for text in blocks("toml") if 'id = "acme-200"' in text)
    file = tmp_path / "acme-200.toml"
    file.write_text(row, encoding="utf-8")
    clock = SimulatedClock()
    far_end = SimulatedDs1000z(Voltages({"2": lambda t: np.full(t.shape, 0.48)}), clock)
    far_end.identity = "ACME,A204,1,1"
    device = SimulatedDevice(
        vendor=0x1AB1, product=0x04CE, function=UsbtmcFunction(far_end),
        interface=INTERFACE,
    )  # fmt: skip
    scope = UsbtmcScope(
        scope_dialect(str(file)), clock=clock, backend=SimulatedBus([device])
    )
    with clock.taking_part("scope"), scope:
        stream = scope.start([Channel(signal="V_K", input="2", range=4.0)], 1e-6)
        block = None
        while block is None:
            clock.sleep_until(clock.now() + 0.02)
            block = scope.poll()
    gain, offset = stream.volts_per_code(0)
    assert block.samples == 12_000
    assert np.max(np.abs(gain * block.codes + offset - 0.48)) < 1e-9


def test_files_the_page_names_exist() -> None:
    text = PAGE.read_text(encoding="utf-8")
    root = PAGE.parents[2]
    for path in re.findall(
        r"`((?:drivers|sim_backend|tests|tactile_lab)/[\w/.-]+)`", text
    ):
        assert (root / path).exists(), path


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("def poll(", "def pull(", r"AcmeScope has no poll\(\)"),
        (
            "lambda table: CAN",
            "CAN",
            r"capability = .*function \(line \d+\)",
        ),
        ("lambda table: CAN", "lambda table: 1 / 0", r"line \d+: ZeroDivisionError"),
        ("lambda table, world: Ac", "lambda table: Ac", "TypeError.*takes 1 pos"),
    ],
)
def test_a_driver_that_is_not_finished_is_refused_in_words(
    desk: Path, old: str, new: str, told: str
) -> None:
    file = desk / "my_scope.py"
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SceneError, match=rf"my_scope\.py.*{told}"):
        Execution(load("v_c1_only", SLOW, "desk.toml"), desk / "runs").run()
    assert not (desk / "runs").exists()


def test_a_scope_that_is_lost_at_once_leaves_a_run_and_its_report(desk: Path) -> None:
    file = desk / "my_scope.py"
    text = file.read_text(encoding="utf-8")
    lost = text.replace("codes = self._library.read()", "raise OSError('gone')  ", 1)
    file.write_text(lost, encoding="utf-8")
    done = Execution(load("v_c1_only", SLOW, "desk.toml"), desk / "runs").run()
    assert done.off.verified and "gone" in done.reason
    report = write(done.folder, read(done.folder))
    assert report.png.exists() and "No trial" in " ".join(report.findings.missing)
