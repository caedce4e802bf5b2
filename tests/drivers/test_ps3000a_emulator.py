"""The unchanged driver on an independently compiled library with the vendor's ABI."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.diagnosis import picosdk
from drivers.picoscope.scope import PicoScope
from drivers.picoscope.sdk import ENVIRONMENT, load
from sim_backend.picoscope.sdk import FUNCTIONS
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import (
    LimitError,
    LinkLostError,
    RefusedError,
    SamplesLostError,
)
from tactile_lab.scope import Block, Channel

SOURCE = Path(__file__).with_name("ps3000a_emulator.c")
TWO = (
    Channel(signal="V_K", input="D", range=5.0, offset=-1.25),
    Channel(signal="V_C1", input="B", range=0.2),
)


@pytest.fixture(scope="session")
def library_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if compiler is None:
        pytest.skip("no C compiler")
    file = tmp_path_factory.mktemp("emulator") / "libps3000a.so.2"
    flags = ["-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run(
        [compiler, *flags, "-o", str(file), str(SOURCE), "-lpthread", "-lm"], check=True
    )
    return file


@pytest.fixture
def emulator(library_file: Path) -> Iterator[Any]:
    library = ctypes.CDLL(str(library_file))
    library.emulator_advance.argtypes = [ctypes.c_double]
    library.emulator_offset.restype = ctypes.c_double
    library.emulator_power.argtypes = [ctypes.c_uint32]
    library.emulator_reset()
    yield library
    library.emulator_reset()


def run(
    scope: PicoScope, emulator: Any, clock: SimulatedClock, steps: list[float]
) -> list[Block]:
    blocks = []
    with clock.taking_part("scope"):
        for step in steps:
            clock.sleep_until(clock.now() + step)
            emulator.emulator_advance(step)
            block = scope.poll()
            blocks += [] if block is None else [block]
    return blocks


@pytest.mark.parametrize("on_thread", [0, 1])
def test_every_sample_arrives_through_the_compiled_abi(
    emulator: Any, library_file: Path, on_thread: int
) -> None:
    emulator.emulator_callbacks_on_thread(on_thread)
    clock = SimulatedClock()
    with PicoScope(clock=clock, library=str(library_file), ring=70_001) as scope:
        assert scope.identity == "Pico Technology PicoScope 3404D EMU00/001"
        stream = scope.start(TWO, 128e-9)
        assert stream.interval == 128e-9
        assert emulator.emulator_offset(3) == -1.25
        assert [emulator.emulator_range(c) for c in range(4)] == [-1, 4, -1, 8]
        blocks = run(scope, emulator, clock, [0.002, 0.0031, 0.008, 0.0001] * 40)
    codes = np.concatenate([b.codes for b in blocks], axis=1)
    count = np.arange(codes.shape[1])
    assert codes.shape[1] == pytest.approx(0.0132 * 40 / 128e-9, abs=2)
    assert np.array_equal(codes[0], (count % 249 - 124 + 3) * 256)
    assert np.array_equal(codes[1], (count % 249 - 124 + 1) * 256)


def test_the_environment_leads_to_it(
    emulator: Any, library_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(ENVIRONMENT, str(library_file.parent))
    scope = PicoScope(clock=SimulatedClock(), serial="EMU00/001")
    scope.open()
    scope.close()


def test_overrange_bits_belong_to_inputs(emulator: Any, library_file: Path) -> None:
    channels = (
        Channel(signal="V_K", input="D", range=5.0),
        Channel(signal="V_C1", input="C", range=0.02),
    )
    clock = SimulatedClock()
    with PicoScope(clock=clock, library=str(library_file)) as scope:
        scope.start(channels, 1e-6)
        (block,) = run(scope, emulator, clock, [0.02])
    assert block.overrange == (False, True)


def test_starvation_is_noticed(emulator: Any, library_file: Path) -> None:
    clock = SimulatedClock()
    scope = PicoScope(clock=clock, library=str(library_file), ring=10_000)
    scope.open()
    scope.start(TWO, 1e-6)
    with pytest.raises(SamplesLostError, match=r"polled 0\.03 s after"):
        run(scope, emulator, clock, [0.005, 0.03, 0.005])
    scope.close()


def test_power_states_and_refusals(emulator: Any, library_file: Path) -> None:
    clock = SimulatedClock()
    emulator.emulator_power(0x11E)
    with pytest.raises(LimitError, match="allow_usb2"):
        PicoScope(clock=clock, library=str(library_file)).open()
    with PicoScope(clock=clock, library=str(library_file), allow_usb2=True) as scope:
        with pytest.raises(LimitError, match="sample rate is impossible"):
            scope.start(TWO, 8e-9)
        beyond = Channel(signal="V_K", input="A", range=0.1, offset=0.3)
        with pytest.raises(LimitError, match=r"-0\.25 to 0\.25 V"):
            scope.start([beyond], 1e-6)


def test_use_after_close_is_an_error(emulator: Any, library_file: Path) -> None:
    clock = SimulatedClock()
    scope = PicoScope(clock=clock, library=str(library_file))
    scope.open()
    scope.start(TWO, 1e-6)
    emulator.emulator_reset()  # the handle is gone
    with pytest.raises(LinkLostError, match="unplugged"):
        run(scope, emulator, clock, [0.02])
    scope.close()


def test_the_fake_exports_what_the_compiled_library_does(library_file: Path) -> None:
    library = load(str(library_file))
    for name, (_, argtypes) in FUNCTIONS.items():
        function = getattr(library, f"ps3000a{name}")
        assert len(argtypes) == len(function.argtypes)
        widths = [ctypes.sizeof(a) for a in argtypes]
        assert widths == [ctypes.sizeof(a) for a in function.argtypes]


def test_the_generator_speaks_the_compiled_abi(
    emulator: Any, library_file: Path
) -> None:
    with PicoScope(clock=SimulatedClock(), library=str(library_file)) as scope:
        scope.generator.hold(-1.25)
        assert emulator.emulator_generator(0) == -1_250_000  # uV
        volts = 1.5 * np.sin(np.linspace(0, np.pi, 101)).round(9)
        scope.generator.load(volts, 2**17 / 20e6 / 32)
        found = [emulator.emulator_generator(k) for k in (1, 2, 3, 4, 5, 6)]
        assert found == [1, 0, 101, 32767, 32, 3_000_000]
        scope.start(TWO, 128e-9)
        scope.generator.start()  # a stream may run
        assert emulator.emulator_generator(2) == 1
        with pytest.raises(RefusedError, match="busy"):
            scope.generator.hold(0.0)  # not for this
        scope.stop()
        for wrong, each in ((np.array([0, 2.5, 0]), 2**17 / 20e6), (volts, 5e-3)):
            with pytest.raises(LimitError):
                scope.generator.load(wrong, each)
        with pytest.raises(LimitError, match="begin and end at 0 V"):
            scope.generator.load(np.ones(5), 2**17 / 20e6)
        with pytest.raises(LimitError, match="does not fit"):
            scope.generator.load(np.zeros(40_000), 2**17 / 20e6)


def test_doctor_names_the_file_of_the_library(library_file: Path) -> None:
    """It said <CDLL '…', handle 56535d173c80 at 0x7f810521f690>."""
    assert picosdk(str(library_file)).text == str(library_file)
