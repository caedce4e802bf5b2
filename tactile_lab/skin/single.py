"""One taxel of a skin as a single simulation: what the array must equal to the bit."""

from __future__ import annotations

from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import Result, simulate
from tactile_lab.model.specimen import specimen
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.press import first_specimen
from tactile_lab.skin.skin import Skin
from tactile_lab.waveform import Waveform


def circuit_of(skin: Skin, taxel: int) -> Circuit:
    """The circuit of one taxel, a specimen of its own where the array is spread."""
    if not 0 <= taxel < skin.array.size:
        raise ParameterError(
            f"Taxel {taxel} does not exist; they are numbered 0 to "
            f"{skin.array.size - 1}."
        )
    number = first_specimen(skin) + taxel if skin.array.spread else 0
    return specimen(skin.circuit, number)


def force_of(skin: Skin, taxel: int) -> Waveform:
    """The force on one taxel, as the array is computed with it, N.

    Raises:
        ParameterError: there is no such taxel.
    """
    circuit_of(skin, taxel)
    return Waveform(*Loads(skin).force(taxel))


def simulate_taxel(
    skin: Skin, taxel: int, keep: tuple[str, ...] = ("spikes",)
) -> Result:
    """One taxel alone, with any signals of it; dead and stuck ones as if whole.

    Raises:
        ParameterError: there is no such taxel.
        SolverError: the model cannot answer to the tolerance.
    """
    return simulate(
        circuit_of(skin, taxel),
        force_of(skin, taxel),
        keep=keep,
        until=skin.duration,
        tolerance=skin.tolerance,
    )
