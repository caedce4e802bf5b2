"""Finding the vendor's library, binding it, and keeping to one thread."""

from __future__ import annotations

import ctypes
import struct
import threading
from pathlib import Path

import numpy as np
import pytest
from voltages import Voltages

from drivers.picoscope.scope import PicoScope
from drivers.picoscope.sdk import ENVIRONMENT, PROTOTYPES, bind, candidates, load
from drivers.picoscope.sdk_calls import LibraryCalls
from sim_backend.picoscope.sdk import FakePs3000a, StreamingReady
from sim_backend.plant.scope_source import Acquisition, Codes
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import NotFoundError, RefusedError
from tactile_lab.scope import Channel

ONE = (Channel(signal="V_K", input="A", range=5.0),)


def test_a_named_file_is_tried_alone_and_the_message_says_why(tmp_path: Path) -> None:
    missing = tmp_path / "libps3000a.so.2"
    with pytest.raises(NotFoundError) as caught:
        load(str(missing))
    text = str(caught.value)
    assert str(missing) in text and ENVIRONMENT in text and 'library = "..."' in text
    assert text.count("ps3000a.so") == text.count(str(missing))


def test_a_folder_stands_for_the_library_in_it(tmp_path: Path) -> None:
    names = [Path(c).name for c in candidates(str(tmp_path), {}, "linux")]
    assert names == ["libps3000a.so.2", "libps3000a.so"]
    assert candidates(str(tmp_path), {}, "win32") == [str(tmp_path / "ps3000a.dll")]


def test_the_environment_names_it_too(tmp_path: Path) -> None:
    wished = str(tmp_path / "x.so")
    assert candidates(None, {ENVIRONMENT: wished}) == [wished]
    assert candidates("/other.so", {ENVIRONMENT: wished}) == ["/other.so"]


@pytest.mark.parametrize(
    ("platform", "place", "last"),
    [
        ("linux", "/opt/picoscope/lib", "libps3000a.so"),
        ("darwin", "PicoSDK.framework", "libps3000a.dylib"),
        ("win32", "Pico Technology", "ps3000a.dll"),
    ],
)
def test_usual_places_then_the_loader(platform: str, place: str, last: str) -> None:
    tried = candidates(None, {}, platform)
    assert place in tried[0]
    assert tried[-1] == last


def test_a_file_that_is_no_library(tmp_path: Path) -> None:
    file = tmp_path / "libps3000a.so.2"
    file.write_bytes(b"not a library")
    with pytest.raises(NotFoundError, match="Tried"):
        load(str(file))


def test_a_library_of_the_wrong_bitness_is_called_that(tmp_path: Path) -> None:
    if struct.calcsize("P") != 8 or not Path("/proc/self/exe").exists():
        pytest.skip("needs 64-bit Linux")
    elf = bytearray(Path("/proc/self/exe").resolve().read_bytes()[:4096])
    elf[4] = 1  # ELFCLASS32
    file = tmp_path / "libps3000a.so.2"
    file.write_bytes(elf)
    with pytest.raises(NotFoundError, match=r"another bitness.*\n?.*64 bits"):
        load(str(file))


def test_a_library_without_our_functions_names_them() -> None:
    with pytest.raises(NotFoundError, match=r"lacks ps3000aOpenUnit.*PicoSDK"):
        bind(ctypes.CDLL(None))


def test_the_fake_has_all_functions_of_the_driver_and_refuses_nonsense() -> None:
    library = bind(FakePs3000a(Voltages({}), SimulatedClock()))
    for name, argtypes in PROTOTYPES.items():
        assert getattr(library, name).argtypes == argtypes
    handle = ctypes.c_int16()
    assert library.ps3000aPingUnit(1) == 0x0C
    assert library.ps3000aOpenUnit(ctypes.byref(handle), None) == 0
    assert library.ps3000aPingUnit(handle) == 0
    assert library.ps3000aPingUnit(77) == 0x0C
    assert library.ps3000aSetChannel(handle, 9, 1, 1, 8, 0.0) == 0x10
    assert library.ps3000aSetChannel(handle, 0, 1, 1, 0, 0.0) == 0x0F
    assert library.ps3000aSetChannel(handle, 0, 1, 7, 8, 0.0) == 0x45
    with pytest.raises(ctypes.ArgumentError):
        library.ps3000aOpenUnit(ctypes.byref(ctypes.c_int32()), None)


def test_two_threads_at_once_are_refused_by_us_before_the_library_is() -> None:
    clock = SimulatedClock()
    inside, go_on = threading.Event(), threading.Event()

    class Slow:
        def render(
            self, acquisition: Acquisition, first: int, samples: int
        ) -> tuple[Codes, tuple[bool, ...]]:
            inside.set()
            go_on.wait(60)
            return np.zeros((1, samples), dtype=np.int16), (False,)

    library = FakePs3000a(Slow(), clock)
    seen: list[BaseException] = []
    scope = PicoScope(clock=clock, library=library)

    def owner() -> None:
        with clock.taking_part("scope"):
            scope.open()
            scope.start(ONE, 1e-5)
            clock.sleep_until(0.01)
            scope.poll()

    thread = threading.Thread(target=owner)
    thread.start()
    assert inside.wait(60)
    for attempt in (scope.poll, scope.stop):
        try:
            attempt()
        except RefusedError as error:
            seen.append(error)
    # the library itself notices as well
    assert library.ps3000aPingUnit(1) == 0x43
    go_on.set()
    thread.join(60)
    assert "second thread" in str(seen[0])
    assert "under way" in str(seen[1])
    scope.close()


def test_closing_from_another_thread_is_allowed_when_idle() -> None:
    clock = SimulatedClock()
    scope = PicoScope(clock=clock, library=FakePs3000a(Voltages({}), clock))
    thread = threading.Thread(target=scope.open)
    thread.start()
    thread.join(60)
    with pytest.raises(RefusedError, match="thread that opened it"):
        scope.start(ONE, 1e-5)
    scope.close()
    scope.open()
    scope.close()


def test_calling_the_library_within_its_callback_is_refused() -> None:
    clock = SimulatedClock()
    library = bind(FakePs3000a(Voltages({}), clock))
    calls = LibraryCalls(library)
    scope = PicoScope(clock=clock, library=library)
    scope.open()
    scope.start(ONE, 1e-5)
    answers: list[int] = []
    ready = StreamingReady(lambda *_: answers.append(library.ps3000aPingUnit(1)))
    library.ps3000aGetStreamingLatestValues.argtypes = None
    with clock.taking_part("test"):
        clock.sleep_until(0.01)
        assert calls("ps3000aGetStreamingLatestValues", 1, ready, None) == 0
    assert answers == [0x23]
    scope.close()


def test_an_exception_in_the_callback_is_raised_after_the_c_call() -> None:
    clock = SimulatedClock()
    library = FakePs3000a(Voltages({}), clock)
    scope = PicoScope(clock=clock, library=library, ring=1000)
    with clock.taking_part("test"):
        scope.open()
        scope.start(ONE, 1e-5)
        library.device.read()  # nothing yet: no effect
        clock.sleep_until(0.005)
        assert scope.poll() is not None
        # the library now reports a part of the ring out of order
        streaming = library.device._streaming
        assert streaming is not None
        streaming.place = 700
        clock.sleep_until(0.006)
        with pytest.raises(OSError, match="jumped from ring index 500 to 700"):
            scope.poll()
    scope.close()
    library.raise_errors()


def test_an_exception_in_the_simulation_comes_through_c() -> None:
    clock = SimulatedClock()

    class Broken:
        def render(
            self, acquisition: Acquisition, first: int, samples: int
        ) -> tuple[Codes, tuple[bool, ...]]:
            raise ZeroDivisionError("the plant")

    library = FakePs3000a(Broken(), clock)
    scope = PicoScope(clock=clock, library=library)
    with clock.taking_part("test"):
        scope.open()
        scope.start(ONE, 1e-5)
        clock.sleep_until(0.01)
        with pytest.raises(ZeroDivisionError, match="the plant"):
            scope.poll()
        # C itself can say no more than this
        assert (
            library.ps3000aGetStreamingLatestValues(1, StreamingReady(), None) == 0x06
        )
    scope.close()
