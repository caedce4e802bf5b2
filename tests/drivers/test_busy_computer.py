"""A computer that is busy while an answer comes, and reads it when its time is over."""

import os
import pty
import time
import tty

import pytest
import serial

from drivers.serial_line import link as link_module
from drivers.serial_line.link import LONGEST_LATE, SerialLink
from tactile_lab.clock import RealClock
from tactile_lab.errors import NoReplyError
from tactile_lab.instruments.dialects import coil_dialect

OVER = 1e-6
"""Time for an answer, s: over, once the first byte of it was taken."""

NAME = b"KEPCO,BIT 4886,E1234,2.1\r\n"


class Busy(serial.Serial):
    """A port whose program goes on only when all of the answer is there."""

    far = -1
    answer = NAME

    def write(self, data, /):
        sent = super().write(data)
        heard = b""
        while not heard.endswith(data):
            heard += os.read(self.far, len(data))
        os.write(self.far, self.answer)
        while self.in_waiting < len(self.answer):
            os.sched_yield()
        time.sleep(0.02)  # at 9600 baud the question itself would take 11 ms
        return sent


@pytest.fixture
def line(monkeypatch):
    far, near = pty.openpty()
    tty.setraw(near)
    port = Busy(os.ttyname(near), timeout=OVER)
    port.far = far
    monkeypatch.setattr(link_module, "open_port", lambda *_: port)
    wire = coil_dialect("kepco-bop").serial.model_copy(
        update={"timeout": OVER, "preamble": ""}
    )
    yield SerialLink("somewhere", wire, RealClock(), what="source"), port
    port.close()
    os.close(near)
    os.close(far)


def test_an_answer_that_came_in_time_is_read_though_the_computer_was_busy(line):
    link, _port = line
    link.open()
    assert link.identity == NAME.decode().strip()
    assert link.query("SYST:ERR?") == link.identity


def test_one_that_has_no_end_is_still_refused(line):
    link, port = line
    link.open()
    port.answer = b"K" * (LONGEST_LATE // 2)
    with pytest.raises(NoReplyError, match="only b'K"):
        link.query("SYST:ERR?")
