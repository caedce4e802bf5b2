"""The rest between messages is counted from the last character on the wire."""

import itertools

import pytest
import serial

from drivers.serial_line import link as link_module
from drivers.serial_line.link import SerialLink
from tactile_lab.clock import SimulatedClock
from tactile_lab.instruments.dialects import teslameter_dialect


class Buffering(serial.SerialBase):
    """A port as an operating system has it: `write` returns before a character left."""

    def __init__(self, clock, wire):
        self.clock, self.wire, self.answers, self.spans = clock, wire, 0, []
        super().__init__()

    def open(self):
        self.is_open = True

    def close(self):
        self.is_open = False

    def write(self, data, /):
        begun = self.clock.now()
        self.spans.append((begun, begun + len(data) * self.wire.character_time))
        self.answers += b"?" in data
        return len(data)

    def read_until(self, expected=b"\n", size=None):
        answer = b"LSCI,MODEL421,0,010203\r\n" if self.answers else b""
        self.answers = 0
        begun = self.spans[-1][1]
        end = begun + len(answer) * self.wire.character_time
        self.clock.sleep_until(end)
        self.spans[-1] = (self.spans[-1][0], end)
        return answer

    def reset_input_buffer(self):
        pass

    in_waiting = 0

    def _reconfigure_port(self, force_update=False):
        pass


@pytest.mark.parametrize("model", ["421", "425", "455", "475"])
def test_no_line_begins_too_soon_after_the_one_before(model, monkeypatch):
    wire, clock = teslameter_dialect(f"lakeshore-{model}").serial, SimulatedClock()
    port = Buffering(clock, wire)
    monkeypatch.setattr(link_module, "open_port", lambda *_: port)
    line = SerialLink("somewhere", wire, clock, what="teslameter")
    with clock.taking_part("test"):
        line.open()
        for text in ("ACDC 0", "AUTO 1", "UNIT T"):
            line.write(text)
        line.query("UNIT?")
        line.write("AUTO 1")
    rests = [b[0] - a[1] for a, b in itertools.pairwise(port.spans)]
    assert len(rests) == 6
    assert min(rests) >= {"421": 0.05}.get(model, 0.03)
