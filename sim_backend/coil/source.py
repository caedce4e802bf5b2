"""Simulated current sources: what a Kepco or Keithley does with the lines it gets.

Written from the manuals' facts, not from the dialect rows, so that a wrong row fails.
No transport here: `sim_backend.serial_line.wires` brings the bytes.
"""

from __future__ import annotations

from sim_backend.coil.keithley import KEITHLEY_2400, KEITHLEY_2420
from sim_backend.coil.kepco import KEPCO, PLAIN
from sim_backend.coil.panel import CoilPanel, CoilPlant
from sim_backend.coil.tti import AIM_TTI
from sim_backend.serial_line.scpi import ScpiParser
from tactile_lab.clock import Clock
from tactile_lab.errors import SceneError

MODELS = {
    "kepco-bop": KEPCO,
    "scpi-generic": PLAIN,
    "keithley-2400": KEITHLEY_2400,
    "keithley-2420": KEITHLEY_2420,
    "aim-tti-pl": AIM_TTI,
}
"""Simulated models by the id of the dialect row they speak."""


class SimCoilSource(CoilPanel):
    """A simulated current source.

    Args:
        plant: the physics behind its terminals.
        model: name in `MODELS`.
        clock: the bench's time.
        output_on: whether the output is on when first connected.

    Raises:
        SceneError: nobody simulates that model.
    """

    def __init__(
        self, plant: CoilPlant, model: str, clock: Clock, *, output_on: bool = False
    ) -> None:
        if model not in MODELS:
            raise SceneError(
                f'There is no simulated source for the dialect "{model}"; there is one '
                f"for {', '.join(MODELS)}."
            )
        personality = MODELS[model]
        super().__init__(plant, clock, personality.rating, output_on)
        self.reply_end = personality.reply_end
        self.clearing = personality.clearing
        self._rewrite = personality.rewrite
        self.parser = ScpiParser(
            personality.commands(self),
            max_line=personality.max_line,
            max_queries=personality.max_queries,
            standard=personality.standard,
            errors=self.errors,
        )

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        return self.parser.line(self._rewrite(line))
