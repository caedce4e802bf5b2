"""What `fuzz.py` damages: files of every kind, and whole run folders.

A case is what was damaged, the calls to make, and whether what is left of a run is
another than what was recorded.
"""

from __future__ import annotations

import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tactile_lab.plugins import scene_path

KINDS = {
    "scene": 0.25,
    "bench": 0.2,
    "waveform": 0.15,
    "calibration": 0.15,
    "run": 0.15,
    "killed run": 0.1,
}
"""Kinds of cases, and the part of a campaign that each is."""

SCENES = (
    "demo", "fig5b", "hold_10s", "bipolar", "rate_force", "repeat", "sine_sweep",
    "staircase", "threshold_search", "calibrate_field", "force_check", "waveform",
    "monitor", "spikes_only", "v_c1_only", "wiring_check",
)  # fmt: skip

ODD = (
    "0", "-1", "1", "true", "nan", "inf", "-inf", "1e400", "1e-400", "[]", "{}", '""',
    '"auto"', '"0 s"', '"-1 s"', '"1e18 s"', '"1e-300 s"', '"nan N"', '"1e300 N"',
    '"1e-300 N"', '"50 mV"', '"1 A"', '"1e9 A"', '"0 S/s"', '"1e-300 S/s"',
    '"1e30 S/s"', '"1 S/s"', '"0 m"', '"1e30 m"', '"1e-30 s"', '"1e30 s"', '"0 F"',
    '"1e-30 F"', '"1e30 F"', '"$x_$"', '"\\u0000"', '"../../.."', '"/dev/null"',
    "9223372036854775807", "[[1]]", '["1 N", "nan N"]', "[1, 2, 3]", "1979-05-27",
    '"50 mN" "x"', "'", '"\U0001f600"', '["' + 'x", "' * 300 + '"]',
)  # fmt: skip

NUMBERS = (
    "0", "-1", "nan", "inf", "1e400", "-1e300", "1e-300", "", "x", "1,2,3", "1e9",
    "0.5", " ", "\u22121", "1_000", "0x10", '"1"', "\0", "1e5000000",
)  # fmt: skip

WHOLE, CUT_SHORT, MENDED = "FUZZ_WHOLE", "FUZZ_CUT_SHORT", "FUZZ_MENDED"
"""Environment variables that name the runs to be damaged."""

SHORT = (
    *("--set", 'protocol.levels=["120 mN", "180 mN"]'),
    *("--set", "protocol.ramp=0.2 s"),
    *("--set", "protocol.hold=0.4 s"),
    *("--set", "protocol.rest=0.2 s"),
    *("--set", "record.sample_rate=20 kS/s"),
    *("--set", 'record.signals=["V_C1", "V_K", "coil_current", "field", "spikes"]'),
)


@dataclass(frozen=True)
class Case:
    """One damaged input.

    Attributes:
        what: was damaged.
        calls: of the command line, one after the other.
        changed: whether what `verify` has called sound is not what was recorded.
    """

    what: str
    calls: tuple[tuple[str, ...], ...]
    changed: Callable[[], bool] = bool


def make(kind: str, chance: random.Random, place: Path) -> Case:
    """A case of a kind in the empty folder `place`."""
    made: dict[str, Callable[[random.Random, Path], Case]] = {
        "scene": _scene,
        "bench": _bench,
        "waveform": _waveform,
        "calibration": _calibration,
        "run": _run,
        "killed run": _killed,
    }
    return made[kind](chance, place)


def _scene(chance: random.Random, place: Path) -> Case:
    name = chance.choice(SCENES)
    whole = scene_path(name).read_text(encoding="utf-8")
    text, what = damaged_text(chance.choice((whole, _spelt_out(name))), chance)
    shutil.copy(scene_path("waveform").with_name("waveform.csv"), place)
    (place / "scene.toml").write_bytes(text)
    return Case(f"{name}: {what}", (("plan", str(place / "scene.toml"), "--json"),))


@cache
def _spelt_out(name: str) -> str:
    """A scene with every key that it could have left out."""
    from tactile_lab.scene.load import load

    return load(name).to_toml()


def _bench(chance: random.Random, place: Path) -> Case:
    whole = resources.files("tactile_lab.scene").joinpath("simulated_bench.toml")
    text, what = damaged_text(whole.read_text(encoding="utf-8"), chance)
    (place / "bench.toml").write_bytes(text)
    asked = ("--bench", str(place / "bench.toml"), "--json")
    return Case(what, (("plan", chance.choice(SCENES), *asked),))


def _waveform(chance: random.Random, place: Path) -> Case:
    whole = scene_path("waveform").with_name("waveform.csv")
    text, what = damaged_table(whole.read_text(encoding="utf-8"), chance)
    (place / "waveform.csv").write_bytes(text)
    shutil.copy(scene_path("waveform"), place / "scene.toml")
    return Case(what, (("plan", str(place / "scene.toml"), "--json"),))


CALIBRATION = """# tactile-lab field calibration
# coil: KEPCO,BIT 4886 20-05,E123456,3.05-1.83
# valid until: 2999-01-01
# uncertainty T (95 %): 1e-05
current_A,field_T
-1.0,-0.011
-0.5,-0.0055
0.0,0.0
0.5,0.0055
1.0,0.011
"""


def _calibration(chance: random.Random, place: Path) -> Case:
    text, what = damaged_table(CALIBRATION, chance)
    (place / "field.csv").write_bytes(text)
    named = f"bench.magnet.calibration={json.dumps(str(place / 'field.csv'))}"
    return Case(what, (("plan", "demo", "--set", named, "--json"),))


def damaged_text(text: str, chance: random.Random) -> tuple[bytes, str]:
    """A TOML file with up to three values, lines or bytes changed."""
    told = []
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        lines = text.splitlines()
        at = chance.randrange(len(lines)) if lines else 0
        how = chance.choice(
            ("number", "number", "number", "value", "value", "drop", "twice", "bytes")
        )
        numbers = list(re.finditer(r"(?<![\w#.])-?\d+(\.\d+)?(e-?\d+)?", text))
        if how == "value":
            keys = [i for i, line in enumerate(lines) if "=" in line] or [0]
            at = chance.choice(keys)
            key = lines[at].split("=")[0] if lines else "x "
            lines[at : at + 1] = [f"{key}= {chance.choice(ODD)}"]
            text = "\n".join(lines)
        elif how == "number" and numbers:
            one = chance.choice(numbers)
            factor = chance.choice((0.0, -1.0, 1e-30, 1e-9, 1e-3, 0.5, 3.0, 1e3, 1e9))
            other = chance.choice((f"{float(one[0]) * factor:g}", "1e30", "nan", "7"))
            at = text[: one.start()].count("\n") + 1
            text = text[: one.start()] + other + text[one.end() :]
        elif how == "drop":
            text = "\n".join(lines[:at] + lines[at + 1 :])
        elif how == "twice":
            text = "\n".join(lines[:at] + lines[at : at + 1] + lines[at:])
        else:
            at = chance.randrange(len(text) + 1)
            text = text[:at] + chr(chance.randrange(1, 256)) + text[at + 1 :]
        told.append(f"{how} at {at}: {text.splitlines()[at - 1 : at + 1]}"[:160])
    return text.encode("utf-8", "replace"), "; ".join(told)


def damaged_table(text: str, chance: random.Random) -> tuple[bytes, str]:
    """A CSV file with cells, rows or bytes changed."""
    lines = text.splitlines()
    told = []
    for _ in range(chance.choice((1, 1, 2, 3))):
        at = chance.randrange(len(lines)) if lines else 0
        how = chance.choice(("cell", "cell", "cell", "drop", "swap", "cut", "byte"))
        if how == "cell" and lines:
            cells = lines[at].split(",")
            cells[chance.randrange(len(cells))] = chance.choice(NUMBERS)
            lines[at] = ",".join(cells)
        elif how == "drop":
            del lines[at : at + chance.choice((1, 5))]
        elif how == "swap":
            chance.shuffle(lines)
        elif how == "cut":
            lines = lines[:at]
        elif lines:
            lines[at] += chr(chance.randrange(1, 256))
        told.append(f"{how} at {at}")
    return "\n".join(lines).encode("utf-8", "replace"), "; ".join(told)


def prepare() -> None:
    """Record the runs to be damaged; processes started from now on share them."""
    for name, make in ((WHOLE, _whole), (CUT_SHORT, _cut_short), (MENDED, _mended)):
        os.environ[name] = str(make())


@cache
def _whole() -> Path:
    """A run recorded once."""
    if WHOLE in os.environ:
        return Path(os.environ[WHOLE])
    out = Path(tempfile.mkdtemp())
    made = [sys.executable, "-m", "tactile_lab", "run", "demo", "--out", str(out)]
    subprocess.run([*made, *SHORT], check=True, capture_output=True)
    return next(out.iterdir())


@cache
def _cut_short() -> Path:
    """The same, killed while it was recorded."""
    if CUT_SHORT in os.environ:
        return Path(os.environ[CUT_SHORT])
    out = Path(tempfile.mkdtemp())
    made = [sys.executable, "-m", "tactile_lab", "run", "demo", "--realtime"]
    run = subprocess.Popen(
        [*made, "--no-report", "--out", str(out), *SHORT],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    while not list(out.glob("*/data.h5")):
        time.sleep(0.05)
    time.sleep(1.5)
    if run.poll() is not None:
        raise RuntimeError("the run to be killed ended by itself")
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    return next(out.iterdir())


def _run(chance: random.Random, place: Path) -> Case:
    folder = place / "run"
    shutil.copytree(_whole(), folder)
    what = damaged_folder(folder, chance)
    calls: list[tuple[str, ...]] = [("verify", str(folder)), ("show", str(folder))]
    if chance.random() < 0.2:
        calls.append(("report", str(folder)))
    if chance.random() < 0.2:
        kind = chance.choice(("csv", "mat"))
        calls.append(("export", str(folder), "--to", kind))
    recorded = _content(str(_whole()))
    return Case(what, tuple(calls), lambda: content(folder) != recorded)


def _killed(chance: random.Random, place: Path) -> Case:
    folder = place / "run"
    shutil.copytree(_cut_short(), folder)
    what = damaged_folder(folder, chance)
    calls = [("recover", str(folder)), ("verify", str(folder)), ("show", str(folder))]
    recorded = _recovered()

    def changed() -> bool:
        """Whether a sample is none that was recorded; fewer are said to be fewer."""
        return not part_of(content(folder), recorded)

    return Case(what, tuple(calls), changed)


@cache
def _recovered() -> dict[str, Any]:
    """What the killed run holds where nothing else happened to it."""
    return content(_mended())


@cache
def _mended() -> Path:
    """The killed run, recovered."""
    if MENDED in os.environ:
        return Path(os.environ[MENDED])
    folder = Path(tempfile.mkdtemp()) / "run"
    shutil.copytree(_cut_short(), folder)
    subprocess.run(
        [sys.executable, "-m", "tactile_lab", "recover", str(folder)],
        check=True, capture_output=True,
    )  # fmt: skip
    return folder


def damaged_folder(folder: Path, chance: random.Random) -> str:
    """Damage one file of a run folder, and say how."""
    kept = (one for one in folder.rglob("*") if one.suffix != ".png")
    files = sorted(one for one in kept if one.is_file())
    weights = [6 if one.suffix in (".h5", ".ledger") else 1 for one in files]
    file = chance.choices(files, weights)[0]
    data = bytearray(file.read_bytes())
    how = chance.choice(("bit", "bit", "bit", "bit", "hole", "cut", "gone", "text"))
    at = chance.randrange(max(len(data), 1))
    if how == "bit" and data:
        data[at] ^= 1 << chance.randrange(8)
    elif how == "hole":
        data[at : at + 512] = bytes(len(data[at : at + 512]))
    elif how == "cut":
        data = data[:at]
    elif how == "gone":
        file.unlink()
        return f"{file.name}: gone"
    elif file.name == "run.json":
        values = list(re.finditer(rb": ([^,\n{\[]+)", bytes(data)))
        if values:
            one = chance.choice(values)
            at = one.start(1)
            odd = chance.choice((b"null", b"-1", b"true", b'"x"', b"1e999", b"[]"))
            data[one.start(1) : one.end(1)] = odd
            how = f"{odd.decode()} for {one.group(1)[:20]!r}"
    elif data:
        data[at : at + 1] = b"\0\xff"
    file.write_bytes(data)
    return f"{file.name}: {how} at {at} of {len(data)}"


@cache
def _content(folder: str) -> dict[str, Any]:
    return content(Path(folder))


def content(folder: Path) -> dict[str, Any]:
    """All that a run says it measured, without derived files and the log."""
    info = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    held: dict[str, Any] = {
        f"run.json {name}": info.get(name)
        for name in ("simulated", "status", "samples", "scene", "protocol", "created")
    }

    def take(name: str, item: Any) -> None:
        for key, value in sorted(item.attrs.items()):
            held[f"{name}@{key}"] = repr(value)
        if isinstance(item, h5py.Dataset):
            held[name] = (str(item.dtype), item.shape, np.asarray(item[()]).tobytes())

    import hdf5plugin  # noqa: F401  for the filter of the samples

    with h5py.File(folder / "data.h5") as file:
        take("/", file)
        file.visititems(take)
    return held


def part_of(found: dict[str, Any], recorded: dict[str, Any]) -> bool:
    """Whether the samples found are the first of those recorded."""
    for name, (_, _, whole) in (
        (name, value) for name, value in recorded.items() if name.startswith("samples/")
        and "@" not in name
    ):  # fmt: skip
        value = found.get(name)
        if value is not None and not whole.startswith(value[2].rstrip(b"\0")[:-2]):
            return False
    return True
