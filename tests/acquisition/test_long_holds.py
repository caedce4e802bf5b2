"""What a hold of a day is told again and again does not pile up in memory."""

import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest

from tactile_lab.acquisition.account import Account
from tactile_lab.acquisition.coil_thread import Applied
from tactile_lab.acquisition.live_model import LiveModel
from tactile_lab.clock import SimulatedClock
from tactile_lab.magnetics import Magnet
from tactile_lab.model.circuit import Circuit

READINGS = 10_000
"""Of the coil current in a steady hold of an hour."""


def kept(work) -> int:
    """Bytes that are held once `work` is done, and were not before."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()


def read_back(account, times):
    """Have the account take steady readings of 0.5 A at these clock times."""
    for at in times:
        applied = [Applied(at - 0.01, at, 0.5, 0.501)]
        coil = SimpleNamespace(take_warnings=list, take_applied=lambda a=applied: a)
        account.readings(
            SimpleNamespace(coil=coil, meter=None, thermometer=None, voltages=())
        )


def test_readings_of_a_standing_current_take_16_bytes_each():
    journal = SimpleNamespace(current=lambda *_, **__: None)
    account = Account(SimulatedClock(), lambda _: journal, lambda _: None)
    account.begin(None)
    times = np.linspace(1.0, 3600.0, READINGS)
    assert kept(lambda: read_back(account, times)) < 32 * READINGS
    applied = account.applied_since(2.0)
    assert applied.shape[0] == pytest.approx(READINGS, rel=1e-3)
    assert applied[0, 0] >= 0.0
    assert np.all(applied[:, 1] == 0.501)
    assert account.applied_since(0.0).size == 0


def test_a_model_is_not_told_the_same_current_again():
    model = LiveModel(Circuit(), Magnet(r=6e-3))
    times = np.linspace(0.0, 3600.0, READINGS).tolist()
    assert kept(lambda: [model.add(at, 0.5) for at in times].clear()) < 32 * READINGS
