"""Each row's conversation, recorded, replayed and fully consumed."""

from pathlib import Path

import pytest
from replay import Replay, read_transcript

from drivers.coil.source import CoilSource
from drivers.serial_line.transcript import Transcript
from drivers.teslameter import Teslameter
from drivers.thermometer import Thermometer
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.wires import plug_in
from sim_backend.teslameter import SimTeslameter
from sim_backend.thermometer import SimThermometer
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import SceneError
from tactile_lab.instruments.dialects import dialect_ids, load_dialect
from tactile_lab.instruments.serial_dialect import CoilDialect

FOLDER = Path(__file__).parent / "transcripts"


def converse(name, instrument, clock, spy=None):
    """A short session with whatever stands at the far end."""
    row = load_dialect(name)
    url = plug_in(instrument, row.serial, clock, name).url
    with clock.taking_part("test"):
        if not isinstance(row, CoilDialect):
            if row.role == "thermometer":
                meter = Thermometer(row.at(None), url, clock, spy=spy)
            else:
                meter = Teslameter(row, url, clock, spy=spy)
            meter.open()
            reading = meter.read().value
            meter.settings()
            meter.close()
            return reading
        coil = CoilSource(row, url, CoilLimits(), clock, spy=spy)
        coil.open()
        coil.energise()
        for _ in range(3):
            clock.sleep_until(clock.now() + 0.1)
            coil.set_current(0.25)
        clock.sleep_until(clock.now() + 0.2)
        reading = coil.read_current().value
        coil._wire.voltage()
        coil.settings()
        coil.close()
        assert coil.warnings == []
        return reading


def far_end(name, plant, clock):
    role = load_dialect(name).role
    if role == "coil":
        return SimCoilSource(plant, name, clock)
    if role == "thermometer":
        plant.temperature = lambda time: 295.15
        return SimThermometer(plant, name, clock)
    plant.output(0, True)
    plant.set_current(0, 0.25)
    return SimTeslameter(plant, name, clock)


READ = {"coil": 0.25, "field meter": 2.75e-3, "thermometer": 295.15}


@pytest.mark.parametrize("name", [one for role in READ for one in dialect_ids(role)])
def test_the_row_says_exactly_this(name):
    replay = Replay(FOLDER / f"{name}.txt")
    reading = converse(name, replay, SimulatedClock())
    replay.finish()
    assert reading == pytest.approx(READ[load_dialect(name).role], rel=1e-3)


@pytest.mark.parametrize("name", ["kepco-bop", "lakeshore-421", "lakeshore-218"])
def test_what_is_recorded_replays(name, resistor, tmp_path):
    clock = SimulatedClock()
    spy = Transcript(tmp_path / "talk.txt", about=name)
    recorded = converse(name, far_end(name, resistor, clock), clock, spy)
    spy.close()
    replay = Replay(tmp_path / "talk.txt")
    assert converse(name, replay, SimulatedClock()) == recorded
    replay.finish()


def test_another_word_or_silence_is_noticed(tmp_path):
    path = tmp_path / "talk.txt"
    path.write_text('0.0 > "*IDN?\\n"\n0.1 < "ME\\r\\n"\n0.2 > "A\\n"\n')
    replay = Replay(path)
    assert replay.line(b"*IDN?") == b"ME\r\n"
    with pytest.raises(AssertionError, match="1 lines"):
        replay.finish()
    with pytest.raises(AssertionError, match=r"has b'A'; b'B'"):
        replay.line(b"B")


@pytest.mark.parametrize("text", ["nonsense", '0.1 ? "x"', "0.1 > x", "x > 3"])
def test_a_broken_transcript_is_named(tmp_path, text):
    path = tmp_path / "talk.txt"
    path.write_text(text)
    with pytest.raises(SceneError, match=r"talk\.txt, line 1"):
        read_transcript(path)
