"""A plant, its channels and how to read them, for the tests of the simulated world."""

import numpy as np

from sim_backend.plant.options import PlantOptions
from sim_backend.plant.plant import Plant
from tactile_lab.magnetics import Magnet
from tactile_lab.model.circuit import Circuit
from tactile_lab.scope import Channel

FULL, SHIFT = 32512, 8
MAGNET = Magnet(r=6e-3)
CHANNELS = (
    Channel(signal="V_C1", input="A", range=2.0, offset=-2.5),
    Channel(signal="V_C2", input="B", range=2.0, offset=-1.7),
    Channel(signal="V_K", input="C", range=5.0),
    Channel(signal="coil_current", input="D", range=0.2, scale=10.0),
)
QUIET = dict.fromkeys(("V_C1", "V_C2", "V_K", "coil_current", "field", "I_DS"), 0.0)
IDEAL = PlantOptions(follower=False, bias=0.0, noise=QUIET, coil_lag=0.0, eddy_lag=0.0)
SHARP = PlantOptions(coil_lag=0.0, eddy_lag=0.0)
"""Without lags few knots need solving, so tests are quick."""


def plant(options: PlantOptions = SHARP, seed: int = 1) -> Plant:
    made = Plant(Circuit(), MAGNET, options, seed)
    made.output(0.0, True)
    return made


def volts(codes: np.ndarray, channel: Channel) -> np.ndarray:
    return codes / FULL * channel.range - channel.offset


def newtons(force: float) -> float:
    """Amperes for a force."""
    return force / MAGNET.newtons_per_ampere


def render(
    made: Plant,
    duration: float,
    *,
    channels: tuple[Channel, ...] = CHANNELS,
    interval: float = 1e-5,
    started: float = 0.0,
    full_scale: int = FULL,
    shift: int = SHIFT,
) -> np.ndarray:
    codes, _ = made.render(
        0, round(duration / interval), interval, started, channels, full_scale, shift
    )
    return codes
