"""One taxel of a skin as a single simulation: what the array must equal to the bit."""

from __future__ import annotations

from tactile_lab.model.simulate import Result, simulate
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.skin import Skin
from tactile_lab.waveform import Waveform


def force_of(skin: Skin, taxel: int) -> Waveform:
    """The force on one taxel, as the array is computed with it, N.

    Raises:
        ParameterError: there is no such taxel.
    """
    skin.circuit_of(taxel)
    return Waveform(*Loads(skin).force(taxel))


def simulate_taxel(
    skin: Skin, taxel: int, keep: tuple[str, ...] = ("spikes",)
) -> Result:
    """One taxel alone, with any signals of it; dead and stuck ones as if whole.

    Raises:
        ParameterError: there is no such taxel, or its parts make no circuit.
        SolverError: the model cannot answer to the tolerance.
    """
    return simulate(
        skin.circuit_of(taxel),
        force_of(skin, taxel),
        keep=keep,
        until=skin.duration,
        tolerance=skin.tolerance,
    )
